# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Ids that stay with objects, and orientations that do not jump."""

from dataclasses import replace

from hooc_perception.core.parsing.tracking import TrackConfig, Tracker
from hooc_perception.core.symmetry import rotation_error, symmetry_rotations
from hooc_perception.core.types import Candidates
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

S = 1_000_000_000
BOX, BALL, CAN = 1, 2, 3


def found(models, *rows):
    """Return Candidates of (category, (x, y, z), Rotation)."""
    category = np.array([row[0] for row in rows], np.uint16)
    return Candidates(
        category, np.array([row[1] for row in rows], float).reshape(-1, 3),
        np.array([row[2].as_quat() for row in rows]).reshape(-1, 4),
        np.array([models[c - 1].extents for c in category], np.float32).reshape(-1, 3),
        np.ones(len(rows), np.float32))


def up(angle=0.0):
    return Rotation.from_euler('z', angle)


def matrices(objects):
    return Rotation.from_quat(objects.rotation_xyzw).as_matrix()


def test_ids_follow_objects_through_reordering_motion_and_noise(things):
    rng, tracker = np.random.default_rng(0), Tracker(things)
    rows = [(BOX, (0, 0, 0.03), up(0.3)), (CAN, (0.1, 0, 0.06), up()), (CAN, (0.2, 0, 0.06), up()),
            (CAN, (0.3, 0, 0.06), up()), (BALL, (0, 0.2, 0.04), up())]
    first, _ = tracker.update(0, found(things, *rows))
    assert len(set(first.tolist())) == 5 and first.dtype == np.uint32
    for step in range(1, 30):
        order = rng.permutation(5)
        moved = [(c, np.add(t, rng.normal(0, 0.01, 3)) + [0.004 * step, 0, 0], r)
                 for c, t, r in rows]
        ids, _ = tracker.update(step * S, found(things, *(moved[i] for i in order)))
        np.testing.assert_array_equal(ids, first[order])


def test_neighbours_keep_their_ids_where_greedy_matching_would_swap_them(things):
    # The second can moves next to where the first one was; both moved the same way.
    tracker = Tracker(things)
    before = [(CAN, (0.0, 0, 0.06), up()), (CAN, (0.1, 0, 0.06), up())]
    after = [(CAN, (0.06, 0, 0.06), up()), (CAN, (0.16, 0, 0.06), up())]
    first, _ = tracker.update(0, found(things, *before))
    second, _ = tracker.update(S, found(things, *after))
    np.testing.assert_array_equal(first, second)


def test_what_vanishes_comes_back_with_its_id_until_its_time_is_over(things):
    tracker = Tracker(things, TrackConfig(track_ttl_s=5.0))
    can, box = (CAN, (0.1, 0, 0.06), up()), (BOX, (0, 0, 0.03), up())
    (a, b), _ = tracker.update(0, found(things, can, box))
    assert tracker.update(2 * S, found(things, box))[0].tolist() == [b]
    assert tracker.update(5 * S, found(things, can, box))[0].tolist() == [a, b]
    assert tracker.update(9 * S, found(things, box))[0].tolist() == [b]
    late, _ = tracker.update(11 * S, found(things, can, box))
    assert late[1] == b and late[0] not in (a, b)


def test_the_time_until_the_next_result_does_not_count(things):
    """A machine that stood still, or a parse that takes longer than track_ttl_s."""
    tracker = Tracker(things, TrackConfig(track_reach_m=0.1, track_ttl_s=5.0))
    can, box = (CAN, (0.1, 0, 0.06), up()), (BOX, (0, 0, 0.03), up())
    (a, b), _ = tracker.update(0, found(things, can, box))
    assert tracker.update(100 * S, found(things, can, box))[0].tolist() == [a, b]
    # Carried meanwhile; and missing in one result, which is when its time begins.
    away = CAN, (0.6, 0, 0.06), up()
    assert tracker.update(200 * S, found(things, away, box))[0].tolist() == [a, b]
    assert tracker.update(300 * S, found(things, box))[0].tolist() == [b]
    assert tracker.update(400 * S, found(things, away, box))[0].tolist() == [b + 1, b]
    # A result that was retracted does not stand.
    tracker.retract()
    assert tracker.update(404 * S, found(things, away, box))[0].tolist() == [b + 1, b]
    tracker.retract()
    assert tracker.update(500 * S, found(things, away, box))[0].tolist() == [b + 2, b + 3]


def test_another_category_or_another_size_is_another_object(things):
    tracker = Tracker(things, TrackConfig(track_reach_m=0.1))
    can = found(things, (CAN, (0, 0, 0.06), up()))
    (a,), _ = tracker.update(0, can)
    (b,), _ = tracker.update(S, found(things, (BALL, (0.02, 0, 0.06), up())))
    far = found(things, (CAN, (0.5, 0, 0.06), up()))
    (c,), _ = tracker.update(2 * S, replace(far, size=1.5 * far.size))
    assert len({a, b, c}) == 3


def test_what_is_carried_elsewhere_keeps_its_id_if_it_has_vanished(things):
    tracker = Tracker(things, TrackConfig(track_reach_m=0.1, track_ttl_s=10.0))
    here, there = (CAN, (0, 0, 0.06), up()), (CAN, (0.5, 0, 0.06), up())
    (a,), _ = tracker.update(0, found(things, here))
    # Both are there: the one that stays keeps the id.
    (b, c), _ = tracker.update(S, found(things, there, here))
    assert c == a and b != a
    # The second one is carried to a third place while the first one stays.
    (d, e), _ = tracker.update(2 * S, found(things, here, (CAN, (0, 0.4, 0.06), up())))
    assert (d, e) == (a, b)
    # Taken away, and put down elsewhere later.
    assert tracker.update(3 * S, found(things, here))[0].tolist() == [a]
    assert tracker.update(5 * S, found(things, here, there))[0].tolist() == [a, b]


def test_a_clock_that_jumps_back_forgets_and_never_repeats_an_id(things):
    tracker, seen = Tracker(things), []
    for stamp in (10, 11, 3, 4):
        seen += tracker.update(stamp * S, found(things, (CAN, (0, 0, 0.06), up())))[0].tolist()
    assert seen[0] == seen[1] and seen[2] == seen[3] and seen[2] > seen[0]
    tracker.forget()
    assert tracker.update(5 * S, found(things, (CAN, (0, 0, 0.06), up())))[0][0] > seen[2]


def test_without_memory_every_answer_stands_for_itself(things):
    tracker = Tracker(things, TrackConfig(track_ttl_s=0.0))
    objects = found(things, (CAN, (0, 0, 0.06), up(1.0)), (BOX, (0.2, 0, 0.03), up(0.4)))
    ids = [tracker.update(t, objects) for t in (0, 0, S)]
    assert [i.tolist() for i, _ in ids] == [[1, 2], [3, 4], [5, 6]]
    for _, same in ids[1:]:
        assert same.rotation_xyzw.tobytes() == ids[0][1].rotation_xyzw.tobytes()


def test_orientations_of_symmetric_objects_do_not_jump(things):
    rng, tracker = np.random.default_rng(3), Tracker(things)
    # The box has half turns, the can any turn about z and half turns, the ball everything.
    true = [(BOX, (0, 0, 0.03), up(np.pi / 2 - 0.02)), (CAN, (0.2, 0, 0.06), up()),
            (BALL, (0, 0.2, 0.04), up()), (CAN, (0.3, 0.1, 0.03), Rotation.from_euler('y', 1.57))]
    orders = [things[c - 1].symmetry for c, _, _ in true]
    assert tuple(orders[1]) == (2, 2, 0) and tuple(orders[0]) == (2, 2, 2)
    last = None
    for step in range(40):
        turned = [(c, t, Rotation.from_rotvec(rng.normal(0, 0.02, 3)) * r * Rotation.from_matrix(
            symmetry_rotations(o)[rng.integers(len(symmetry_rotations(o)))])
            * (Rotation.random(None, rng) if c == BALL else Rotation.identity()))
            for (c, t, r), o in zip(true, orders)]
        given = found(things, *turned)
        _, objects = tracker.update(step * S, given)
        for R, R_given, order in zip(matrices(objects), matrices(given), orders):
            assert rotation_error(R, R_given, order) < 1e-6
        if last is not None:
            jump = [Rotation.from_matrix(a.T @ b).magnitude()
                    for a, b in zip(last, matrices(objects))]
            assert max(jump) < 0.15, step
        last = matrices(objects)


def test_an_object_that_is_turned_by_hand_is_followed(things):
    tracker, model = Tracker(things), things[BOX - 1]
    for step in range(50):      # in steps of 10 degrees, once around and more
        R = up(np.radians(10 * step))
        _, objects = tracker.update(step * S, found(things, (BOX, (0, 0, 0.03), R)))
        np.testing.assert_allclose(matrices(objects)[0], R.as_matrix(), atol=1e-9)
        np.testing.assert_allclose(objects.size[0], model.extents, rtol=1e-6)


def test_no_objects_and_models_without_any(things):
    tracker = Tracker(things)
    ids, objects = tracker.update(0, Candidates.empty())
    assert len(ids) == len(objects) == 0
    one = found(things, (CAN, (0, 0, 0.06), up()))
    assert tracker.update(S, one)[0].tolist() == [1]
    assert len(tracker.update(2 * S, replace(Candidates.empty()))[0]) == 0


@pytest.mark.parametrize('frames', [200])
def test_memory_stays_bounded(things, frames):
    tracker = Tracker(things, TrackConfig(track_ttl_s=10.0, track_reach_m=0.001))
    rng = np.random.default_rng(0)
    for step in range(frames):
        at = rng.uniform(-1, 1, (3, 3))
        tracker.update(step * S, found(things, *((CAN, t, up()) for t in at)))
    assert len(tracker._tracks) <= 3 * 11
