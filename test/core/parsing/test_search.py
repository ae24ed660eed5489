# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Moves of the search that no refinement makes: one object for two, half turns, a small pool."""

from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.hypotheses.merge import merged_pairs
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.parsing.search import Search, search_scene
from hooc_perception.core.types import Candidates
from hooc_perception.objects.derive import derive
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

UPRIGHT = [0, 0, 0, 1.0]


def candidates(category, translation, rotation, size):
    """Return Candidates from lists."""
    n = len(category)
    return Candidates(np.array(category, np.uint16), np.array(translation, float),
                      np.broadcast_to(rotation, (n, 4)).astype(float),
                      np.array(size, np.float32), np.ones(n, np.float32))


@pytest.fixture(scope='module')
def long_box(make_desk):
    """Return a desk with one box of almost twice the generic length."""
    return make_desk(candidates([1], [[0, 0, 0.03]], UPRIGHT, [[0.26, 0.10, 0.06]]))


@pytest.fixture(scope='module')
def halves():
    """Return the two boxes of usual size that explain the long one as well."""
    return candidates([1, 1], [[-0.066, 0, 0.03], [0.066, 0, 0.03]], UPRIGHT,
                      [[0.13, 0.10, 0.06]] * 2)


def found(desk, pool, config=ParseConfig(), max_instances=0):
    """Return the chosen Candidates and all that were considered."""
    search, _, considered = search_scene(desk.frame, pool, config, stage_rng(0, 'parse'),
                                         max_instances)
    return search.chosen, considered


def test_one_large_object_takes_the_place_of_two(long_box, halves):
    objects, _ = found(long_box, halves)
    assert len(objects) == 1
    assert np.linalg.norm(objects.translation[0] - [0, 0, 0.03]) < 0.01
    np.testing.assert_allclose(objects.size[0], [0.26, 0.10, 0.06], rtol=0.12)
    # The move does it: without refinement nothing is merged.
    assert len(found(long_box, halves, ParseConfig(polish_steps=0, turn_steps=0))[0]) == 2


def test_two_that_are_two_stay_two(make_desk):
    truth = candidates([1, 1], [[-0.08, 0, 0.03], [0.06, 0.03, 0.03]], UPRIGHT,
                       [[0.13, 0.10, 0.06]] * 2)
    objects, _ = found(make_desk(truth), truth)
    assert len(objects) == 2


def test_a_box_around_two_holds_both(things, halves):
    merged, pairs = merged_pairs(halves, things)
    assert pairs.tolist() == [[0, 1], [1, 0]]
    np.testing.assert_allclose(merged.translation, [[0, 0, 0.03]] * 2, atol=1e-9)
    np.testing.assert_allclose(merged.size, [[0.262, 0.10, 0.06]] * 2, rtol=1e-5)
    quarter = Rotation.from_rotvec([0, 0, np.pi / 2]).as_quat()
    turned = candidates([1, 1], halves.translation, quarter, [[0.10, 0.13, 0.06]] * 2)
    # Twice the generic width is as far as a hypothesis may go.
    np.testing.assert_allclose(merged_pairs(turned, things)[0].size[0], [0.10, 0.20, 0.06],
                               rtol=1e-5)


def test_what_is_apart_or_of_another_kind_is_not_merged(things, halves):
    apart = candidates([1, 1], [[-0.2, 0, 0.03], [0.2, 0, 0.03]], UPRIGHT, [[0.1, 0.1, 0.06]] * 2)
    for objects in (apart, halves.take([0]), candidates(
            [1, 2], halves.translation, UPRIGHT, halves.size), Candidates.empty()):
        merged, pairs = merged_pairs(objects, things)
        assert len(merged) == 0 and pairs.shape == (0, 2)


def test_what_lies_the_wrong_way_round_is_turned(make_desk):
    head = trimesh.creation.box((0.05, 0.10, 0.05))
    handle = trimesh.creation.box((0.20, 0.03, 0.03))
    handle.apply_translation([0.11, 0, 0])
    mallet = derive('mallet', trimesh.util.concatenate([head, handle]), np.random.default_rng(0))
    truth = candidates([1], [[0, 0, 0.025]], Rotation.from_rotvec([0, 0, 0.5]).as_quat(),
                       [mallet.extents])
    desk = make_desk(truth, models=(mallet,))
    wrong = candidates([1], truth.translation, Rotation.from_rotvec([0, 0, 0.5 + np.pi]).as_quat(),
                       [mallet.extents])

    def off(**kwargs):
        objects, _ = found(desk, wrong, ParseConfig(**kwargs), 1)
        assert len(objects) == 1
        turn = (Rotation.from_quat(objects.rotation_xyzw[0])
                * Rotation.from_quat(truth.rotation_xyzw[0]).inv()).as_rotvec()
        return abs(turn[2])

    assert off(turn_steps=0) > 2.5
    assert off() < 0.1


def test_what_has_no_prospect_does_not_go_on_to_the_next_round(desk, desk_pool):
    search = Search(desk.frame.coarse, desk.models, ParseConfig(), 1)
    search.add(desk_pool)
    search.run(stage_rng(0, 'parse'), lambda: False)
    value = search.energy.value
    rows = search.shortlist(1)
    less = search.subset(rows)
    assert rows[search.mask].all() and len(less.pool) < len(desk_pool)
    assert less.energy.value == pytest.approx(value, abs=1e-6)
    np.testing.assert_array_equal(less.pool.translation, desk_pool.translation[rows])
    # All the same, all of them count as considered.
    _, considered = found(desk, desk_pool, ParseConfig(kept=1))
    assert len(considered) >= len(desk_pool)
