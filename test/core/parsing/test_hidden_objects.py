# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the robot hides stays in the results; what is seen to be gone does not."""

from dataclasses import replace

from hooc_perception.core.parsing.hidden_objects import HiddenObjects
from hooc_perception.core.parsing.tracking import TrackConfig, Tracker
from hooc_perception.core.segment.hidden import without_robot
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Candidates, Energy, ParsedScene
import numpy as np
import pytest

S = 10**9


def result(objects, sigmas=True):
    """Return the ParsedScene of Candidates."""
    n = len(objects)
    sigma = np.full(n, 0.01, np.float32) if sigmas else None
    return ParsedScene(objects, Energy(0.5, 0.2, 0.1), np.full(n, 0.9, np.float32),
                       np.full(n, 0.004, np.float32), np.full(n, 30.0, np.float32),
                       np.full(n, 3, np.uint8), Candidates.empty(), sigma_t=sigma, sigma_r=sigma)


@pytest.fixture
def cell(desk, empty_desk, small):
    """
    Return (function: robot parts -> Observation, with the objects or without; HiddenObjects).

    The box of the desk is class 1, the ball 2, the can 3.
    """
    def look(robot=(), gone=False):
        views = (empty_desk if gone else desk).views
        return observe([rectify(without_robot(view, robot)) for view in views])
    return look, HiddenObjects(desk.models)


def over_the_ball(small):
    """Return a slab above the ball, which hides it from every camera."""
    return [small.box([0.09, 0.06, 0.12], [0.22, 0.22, 0.02])]


def test_a_hidden_object_keeps_its_id_pose_and_score(cell, desk, small):
    look, keeper = cell
    tracker = Tracker(desk.models)
    ids, objects = tracker.update(0, desk.truth)
    first, ids = keeper.update(0, result(objects), ids, look())
    assert first.hidden_s is None
    for second in (1, 20, 40, 60):     # longer than track_ttl_s
        again, found = tracker.update(second * S, desk.truth.take([0, 2]))
        parsed, after = keeper.update(second * S, result(found), again,
                                      look(over_the_ball(small)))
        tracker.hold(after, second * S)
        assert after.tolist() == [ids[0], ids[2], ids[1]]
        np.testing.assert_array_equal(parsed.hidden_s, np.float32([0, 0, second]))
        np.testing.assert_array_equal(parsed.objects.translation[2], desk.truth.translation[1])
        assert parsed.n_views.tolist() == [3, 3, 0] and parsed.visible_ratio[2] == 0
        assert parsed.sigma_t[2] == np.float32(0.01) and parsed.objects.score[2] == 1
    back, _ = tracker.update(80 * S, desk.truth)
    np.testing.assert_array_equal(back, ids)


@pytest.mark.parametrize('case', ['no robot', 'elsewhere', 'gone', 'too long', 'off', 'new ids'])
def test_what_is_not_hidden_is_missing(cell, desk, small, case):
    look, keeper = cell
    limits = {'too long': {'keep_hidden_s': 9.0}, 'off': {'keep_hidden_s': 0.0},
              'new ids': {'track_ttl_s': 0.0}}
    keeper.config = TrackConfig(**limits.get(case, {}))
    keeper.update(0, result(desk.truth), np.array([1, 2, 3], np.uint32), look())
    robot = {'no robot': [], 'elsewhere': [small.box([-0.1, -0.1, 0.2], [0.1, 0.1, 0.02])],
             # A finger before the ball in one view; the others see the table through its place.
             'gone': [small.box(0.5 * (desk.cameras[0].T_world_camera[:3, 3]
                                       + desk.truth.translation[1]), [0.06, 0.06, 0.06])],
             }.get(case, over_the_ball(small))
    observation = look(robot, gone=case == 'gone')
    if case == 'gone':
        assert observation.views[0].hidden.sum() > 500
    parsed, ids = keeper.update(10 * S, result(desk.truth.take([0, 2])),
                                np.array([1, 3], np.uint32), observation)
    assert ids.tolist() == [1, 3] and parsed.hidden_s is None


def test_no_second_object_of_a_category_and_none_inside_of_another(cell, desk, small):
    look, keeper = cell
    keeper.max_instances = 1
    keeper.update(0, result(desk.truth), np.array([1, 2, 3], np.uint32), look())
    moved = replace(desk.truth, translation=desk.truth.translation + [0.0, 0.3, 0.0])
    _, ids = keeper.update(S, result(moved.take([1])), np.array([9], np.uint32),
                           look(over_the_ball(small)))
    assert 2 not in ids, 'the ball is found elsewhere'
    keeper.forget()
    keeper.update(2 * S, result(desk.truth), np.array([1, 2, 3], np.uint32), look())
    can_in_its_place = replace(desk.truth.take([2]), translation=desk.truth.translation[[1]])
    _, ids = keeper.update(3 * S, result(can_in_its_place), np.array([9], np.uint32),
                           look(over_the_ball(small)))
    assert 2 not in ids, 'a can is found in its place'


def test_time_that_is_set_back_forgets(cell, desk, small):
    look, keeper = cell
    keeper.update(10 * S, result(desk.truth), np.array([1, 2, 3], np.uint32), look())
    _, ids = keeper.update(9 * S, result(desk.truth.take([0])), np.array([4], np.uint32),
                           look(over_the_ball(small)))
    assert ids.tolist() == [4]


def test_without_sigmas(cell, desk, small):
    look, keeper = cell
    keeper.update(0, result(desk.truth, sigmas=False), np.array([1, 2, 3], np.uint32), look())
    parsed, ids = keeper.update(S, result(desk.truth.take([0, 2])), np.array([1, 3], np.uint32),
                                look(over_the_ball(small)))
    assert ids.tolist() == [1, 3, 2] and np.isnan(parsed.sigma_r[2])
    parsed, _ = keeper.update(2 * S, result(desk.truth.take([0, 2]), sigmas=False),
                              np.array([1, 3], np.uint32), look(over_the_ball(small)))
    assert parsed.sigma_t is None and len(parsed.objects) == 3
