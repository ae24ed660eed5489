# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 1 over time: what is taken over from earlier frame sets, and when nothing is."""

from dataclasses import fields, replace

from hooc_perception.core.geometry import inverse
from hooc_perception.core.incremental.watch import seen_so_far, watch
from hooc_perception.core.segment.config import AccumulateConfig, ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.errors import HoocError
import numpy as np
import pytest

ARM = ([0.55, 0.0, 0.25], [1.0, 0.08, 0.08])
PAIR = ([-0.05, -0.2, 0.06], [0.1, 0.1, 0.12])


def assert_same(a, b):
    """Assert that two Observations are the same to the bit."""
    assert (a.noise_m, a.troubles, len(a.views)) == (b.noise_m, b.troubles, len(b.views))
    for one, other in zip(a.views, b.views):
        np.testing.assert_array_equal(one.camera.T_world_camera, other.camera.T_world_camera)
        for f in fields(one)[1:]:
            np.testing.assert_array_equal(getattr(one, f.name), getattr(other, f.name))


def blind(view):
    """Return a view of a camera that has dropped out."""
    return replace(view, depth=np.full_like(view.depth, np.nan))


def watched(*frame_sets, config=ObserveConfig(), before=None):
    """Return what is known after some frame sets."""
    for views in frame_sets:
        before = watch(views, before, config)
    return before


@pytest.fixture
def start(seen, cube, board):
    """Return what is known after five frame sets of a cube, a board and another cube."""
    return watched(*(seen(cube, board, PAIR, seed=k) for k in range(5)))


def test_the_first_frame_set_is_observed_by_itself(seen, cube):
    first = watch(seen(cube), None)
    assert first.fresh
    assert_same(first.observation, observe(seen(cube)))


def test_a_scene_that_stands_still_is_seen_ever_better(seen, small, cube, board, start):
    assert not start.fresh
    clean = small.views_of([small.box(*b) for b in (cube, board, PAIR)], small.rig())[0]
    for one, first, true, counted in zip(start.observation.views, seen(cube, board, PAIR), clean,
                                         start.accumulated):
        inner = one.table & ~one.foreground
        spread = [np.nanstd((view.depth - true.depth)[inner]) for view in (one, first)]
        assert spread[0] < 0.65 * spread[1]
        assert np.median(counted.count) == 5


def test_every_frame_set_by_itself_where_that_is_asked_for(seen, cube):
    config = ObserveConfig(accumulate=AccumulateConfig(accumulate_frames=1))
    second = watched(seen(cube, seed=1), seen(cube, seed=2), config=config)
    assert second.fresh
    assert_same(second.observation, observe(seen(cube, seed=2), config))


def test_no_more_readings_count_than_is_asked_for(seen, cube):
    config = ObserveConfig(accumulate=AccumulateConfig(accumulate_frames=3))
    after = watched(*(seen(cube, seed=k) for k in range(6)), config=config)
    assert {int(a.count.max()) for a in after.accumulated} == {3}


def test_where_too_much_has_changed_only_the_frame_set_counts(seen, cube, start):
    views = seen(cube, seed=9)
    other = watch(views, start)
    assert other.fresh
    assert_same(other.observation, observe(views))
    assert all((a.count == 1).all() for a in other.accumulated)
    # With another limit, the rest is taken over.
    lenient = ObserveConfig(accumulate=AccumulateConfig(full_share=0.95))
    assert not watch(views, start, lenient).fresh


@pytest.mark.parametrize('case', ['moved', 'fewer', 'more', 'renamed'])
def test_other_cameras_begin_anew(seen, small, cube, board, start, case):
    views = seen(cube, board, PAIR, seed=9, cameras={
        'moved': (*small.rig()[:2], small.rig(start=0.35)[2]), 'fewer': small.rig()[:2],
        'more': small.rig(4)}.get(case))
    if case == 'renamed':
        views[0] = replace(views[0], camera=replace(views[0].camera, name='other'))
    other = watch(views, start)
    assert other.fresh
    assert_same(other.observation, observe(views))


def test_where_something_has_gone_it_begins_anew_and_elsewhere_goes_on(seen, shown, cube, board,
                                                                       start):
    views = seen(cube, board, seed=9)
    after = watch(views, start)
    assert not after.fresh
    for gone, a, view in zip(shown((cube, board, PAIR), 2), after.accumulated, views):
        inner = gone & (np.abs(a.depth - view.depth) == 0)
        assert inner.sum() > 0.85 * gone.sum() and (a.count[inner] == 1).mean() > 0.95
        assert (a.count[~gone] == 6).mean() > 0.9


def test_an_arm_is_hidden_and_what_it_hides_is_remembered(seen, shown, cube, board, start):
    things = (cube, board, PAIR)
    for seed in (10, 11):
        during = watched(seen(*things, ARM, seed=seed), before=start)
        assert not during.fresh
        for view, before, a, arm in zip(during.observation.views, start.accumulated,
                                        during.accumulated, shown((*things, ARM), 3)):
            assert view.hidden[arm].mean() > 0.95
            assert not view.foreground[view.hidden].any()
            assert np.isnan(view.depth[view.hidden]).all()
            np.testing.assert_array_equal(a.depth[view.hidden], before.depth[view.hidden])
            np.testing.assert_array_equal(a.count[view.hidden], before.count[view.hidden])
    after = watched(seen(*things, seed=12), before=during)
    for view, a in zip(after.observation.views, after.accumulated):
        assert view.hidden is None and np.median(a.count) == 7
        assert (a.count >= 5).mean() > 0.95


def test_the_robot_stays_hidden_and_does_not_count(seen, cube, board, start):
    views = seen(cube, board, PAIR, seed=9)
    robot = np.zeros(views[0].depth.shape, bool)
    robot[:, :60] = True
    views[0] = replace(views[0], hidden=robot, depth=np.where(robot, np.nan, views[0].depth)
                       .astype(np.float32))
    after = watch(views, start)
    assert not after.fresh
    np.testing.assert_array_equal(after.observation.views[0].hidden, robot)
    np.testing.assert_array_equal(after.accumulated[0].depth[robot],
                                  start.accumulated[0].depth[robot])
    assert after.observation.views[1].hidden is None


def test_a_camera_that_drops_out_goes_on_when_it_returns(seen, cube, board, start):
    views = seen(cube, board, PAIR, seed=9)
    during = watch([blind(views[0]), *views[1:]], start)
    assert not during.fresh
    assert np.isnan(during.observation.views[0].depth).all()
    assert during.accumulated[0] is start.accumulated[0]
    assert np.median(during.accumulated[1].count) == 6
    after = watched(seen(cube, board, PAIR, seed=10), before=during)
    assert not after.fresh
    assert [np.median(a.count) for a in after.accumulated] == [6, 7, 7]


def test_a_camera_that_comes_later(seen, cube, board):
    views = seen(cube, board)
    first = watch([blind(views[0]), *views[1:]], None)
    assert first.accumulated[0] is None and first.accumulated[1] is not None
    again = watched([blind(views[0]), *seen(cube, board, seed=1)[1:]], before=first)
    assert again.accumulated[0] is None
    now = seen(cube, board, seed=2)
    after = watch(now, again)
    np.testing.assert_array_equal(after.accumulated[0].depth, now[0].depth)
    np.testing.assert_array_equal(after.observation.views[0].depth, now[0].depth)
    assert not after.fresh and np.median(after.accumulated[1].count) == 3


def test_a_camera_that_comes_later_in_another_size_than_was_expected(seen, cube, board):
    views = seen(cube, board)
    camera = views[0].camera
    nominal = replace(camera, width=2 * camera.width, height=2 * camera.height)
    nothing = np.full((nominal.height, nominal.width), np.nan, np.float32)
    first = watch([replace(views[0], camera=nominal, depth=nothing), *views[1:]], None)
    now = seen(cube, board, seed=1)
    after = watch(now, first)
    assert after.fresh
    assert_same(after.observation, observe(now))


def test_a_frame_set_without_any_reading_is_refused(seen, cube, board, start):
    with pytest.raises(HoocError, match='holds no reading'):
        watch([blind(view) for view in seen(cube, board)], start)


def test_in_any_target_frame(seen, shown, cube, board, start):
    """Where the table is elsewhere in the target frame, the same is set aside."""
    T = np.eye(4)
    T[:3, 3] = 3.0, -2.0, 0.7

    def elsewhere(views):
        return [replace(v, camera=replace(v.camera, T_world_camera=T @ v.camera.T_world_camera))
                for v in views]

    views = seen(cube, board, PAIR), seen(cube, board, PAIR, ARM, seed=9)
    here = watched(*views)
    there = watch(elsewhere(views[1]), watch(elsewhere(views[0]), None, T_target_table=T),
                  T_target_table=T)
    assert not there.fresh
    for a, b in zip(here.observation.views, there.observation.views):
        assert a.hidden.any()
        np.testing.assert_array_equal(a.hidden, b.hidden)
        np.testing.assert_allclose(inverse(a.camera.T_world_camera) @ b.camera.T_world_camera,
                                   np.eye(4), atol=1e-6)


def test_what_is_hidden_is_shown_as_it_was_seen_before(seen, cube, board):
    before, now = (observe(seen(cube, board, seed=k)) for k in (1, 2))
    robot, other = (np.zeros(before.views[0].depth.shape, bool) for _ in range(2))
    robot[:, :80], other[:, 60:100] = True, True
    hiding = replace(now, views=(replace(now.views[0], hidden=robot, depth=np.where(
        robot, np.float32(np.nan), now.views[0].depth), foreground=now.views[0].foreground
        & ~robot), *now.views[1:]))
    got = seen_so_far(before, hiding)
    for name in ('depth', 'foreground'):
        np.testing.assert_array_equal(getattr(got.views[0], name), np.where(
            robot, getattr(before.views[0], name), getattr(now.views[0], name)))
    assert not got.views[0].hidden.any()
    assert got.views[1] is now.views[1]
    # What was hidden before as well has never been seen.
    first = replace(before, views=(replace(before.views[0], hidden=other), *before.views[1:]))
    np.testing.assert_array_equal(seen_so_far(first, hiding).views[0].hidden, robot & other)


def test_a_camera_that_drops_out_shows_what_it_saw_before(seen, cube, board):
    before = observe(seen(cube, board))
    views = seen(cube, board, seed=1)
    during = observe([blind(views[0]), *views[1:]])
    got = seen_so_far(before, during)
    np.testing.assert_array_equal(got.views[0].depth, before.views[0].depth)
    np.testing.assert_array_equal(got.views[0].camera.T_world_camera,
                                  before.views[0].camera.T_world_camera)
    assert not got.views[0].hidden.any()
    assert seen_so_far(during, during).views[0].hidden.all()


def test_while_nothing_changes_the_observation_is_the_same(seen, cube):
    """New views are made when the scene has settled, and whenever all readings are new."""
    before, news = watch(seen(cube), None), []
    for k in range(1, 13):
        after = watch(seen(cube, seed=k), before)
        if after.observation is not before.observation:
            news.append(k)
        before = after
    assert news == [4, 12] and before.calm == 12
    changed = watch(seen(cube, PAIR, seed=20), before)
    assert changed.observation is not before.observation and changed.calm == 0
