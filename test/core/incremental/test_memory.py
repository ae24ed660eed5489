# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What a frame set asks for: nothing, a look at what has changed, or everything anew."""

from dataclasses import replace

from hooc_perception.core.incremental.changes import changes, FEWEST_PX
from hooc_perception.core.incremental.memory import next_step
from hooc_perception.core.segment.config import AccumulateConfig
from hooc_perception.core.segment.observe import observe
import numpy as np
import pytest
from scipy import ndimage

SHARE = 0.4
PAIR = ([-0.05, -0.2, 0.06], [0.1, 0.1, 0.12])
THIRD = ([0.1, -0.2, 0.03], [0.06, 0.06, 0.06])


@pytest.fixture(scope='module')
def observed(seen):
    """Return a function: boxes -> Observation, by three cameras, with noise."""
    return lambda *boxes, **kwargs: observe(seen(*boxes, **kwargs))


@pytest.fixture(scope='module')
def things(cube, board):
    """Return three boxes on the table."""
    return cube, board, PAIR


@pytest.fixture(scope='module')
def still(observed, things):
    """Return five observations of the same three boxes."""
    return [observed(*things, seed=k) for k in range(5)]


def step_of(memory, observation, **changed):
    """Return the Step with the parameters of these tests."""
    return next_step(memory, observation, AccumulateConfig(full_share=SHARE, **changed))


def calm_after(memory, observations, **changed):
    """Return what is known after frame sets that ask for nothing."""
    for observation in observations:
        step = step_of(memory, observation, **changed)
        assert (step.full, step.region, step.settled) == (False, None, False)
        memory = step.memory
    return memory


def hiding(observation, k, mask):
    """Return an observation in which something hides pixels of view k."""
    view = observation.views[k]
    hidden = replace(view, hidden=mask, foreground=view.foreground & ~mask,
                     depth=np.where(mask, np.float32(np.nan), view.depth))
    return replace(observation, views=tuple(
        hidden if i == k else v for i, v in enumerate(observation.views)))


def is_of(memory, observation):
    """Return whether an observation is what is remembered."""
    return all(a is b for a, b in zip(memory.seen.views, observation.views, strict=True))


def around(pixels):
    """Return the box around a mask, as a mask, with a margin of 3 pixels."""
    out = np.zeros_like(pixels)
    v, u = np.nonzero(pixels)
    out[v.min() - 3:v.max() + 4, u.min() - 3:u.max() + 4] = True
    return out


def test_the_first_frame_set_asks_for_everything(still):
    step = step_of(None, still[0])
    assert step.full and is_of(step.memory, still[0])
    for mask, view in zip(step.memory.pending, still[0].views, strict=True):
        np.testing.assert_array_equal(mask, view.foreground)


def test_a_scene_that_stands_still_asks_for_nothing_until_it_is_observed_anew(still):
    memory = calm_after(step_of(None, still[0]).memory, [still[0]] * 2)
    assert is_of(memory, still[0])
    # All of it was new: with better readings, everything is looked at once more.
    step = step_of(memory, still[3])
    assert step.full and not any(mask.any() for mask in step.memory.pending)
    assert is_of(step.memory, still[3])
    calm_after(step.memory, 2 * still)


@pytest.fixture(scope='module')
def settled(still):
    """Return what is known once three boxes have been looked at for the second time."""
    return step_of(step_of(None, still[0]).memory, still[3]).memory


@pytest.mark.parametrize('changed', [{'settle_frames': 0}, {'accumulate_frames': 1}])
def test_nothing_settles_where_nobody_asks_for_it(still, changed):
    calm_after(step_of(None, still[0], **changed).memory, 3 * still, **changed)


def test_a_change_is_looked_at_and_once_more_when_it_has_settled(observed, shown, things, settled):
    more = (*things, THIRD)
    changed = [observed(*more, seed=k) for k in range(10, 15)]
    step = step_of(settled, changed[0])
    assert not step.full and not step.settled
    for mask, pending, mine in zip(step.region, step.memory.pending, shown(more, 3), strict=True):
        assert mask[mine].mean() > 0.8 and not mask[~around(mine)].any()
        np.testing.assert_array_equal(mask, pending)
    region = step.region
    assert is_of(step.memory, changed[0])
    step = step_of(calm_after(step.memory, changed[:1]), changed[3])
    assert step.settled and not step.full
    for mask, again in zip(region, step.region, strict=True):
        np.testing.assert_array_equal(mask, again)
    assert is_of(step.memory, changed[3])
    calm_after(step.memory, 2 * changed)


def test_changes_add_up_until_they_settle(observed, shown, things, settled):
    one, two = observed(*things, THIRD, seed=10), observed(*things[:2], THIRD, seed=11)
    first = step_of(settled, one)
    second = step_of(calm_after(first.memory, [one]), two)
    assert second.region is not None and not second.settled
    for a, b, sum_ in zip(first.region, second.region, second.memory.pending):
        np.testing.assert_array_equal(a | b, sum_)
        assert (sum_ & ~b).any()


def test_where_much_has_changed_everything_is_looked_at(observed, things, settled):
    now = observed(THIRD, seed=10)
    step = step_of(settled, now)
    assert step.full and is_of(step.memory, now)
    for mask, view in zip(step.memory.pending, now.views, strict=True):
        np.testing.assert_array_equal(mask, view.foreground)
    lenient = next_step(settled, now, AccumulateConfig(full_share=1.0))
    assert not lenient.full and lenient.region is not None


def test_other_cameras_ask_for_everything(observed, small, things, settled):
    assert step_of(settled, observed(*things, cameras=small.rig(start=0.35))).full
    assert step_of(settled, observed(*things, cameras=small.rig()[:2])).full


@pytest.mark.parametrize('side, asks', [(5, False), (8, True)])
def test_a_few_pixels_are_noise_but_are_not_forgotten(still, settled, side, asks):
    view = settled.seen.views[0]
    v, u = np.argwhere(ndimage.binary_erosion(view.foreground, iterations=6))[0]
    depth = view.depth.copy()
    depth[v - 3:v - 3 + side, u - 3:u - 3 + side] = np.nan
    seen = replace(settled.seen, views=(replace(view, depth=depth), *settled.seen.views[1:]))
    assert 0 < sum(int(mask.sum()) for mask in changes(seen, still[4])) < 3 * FEWEST_PX
    step = step_of(replace(settled, seen=seen), still[4])
    assert (step.region is not None) == asks
    assert (is_of(step.memory, seen)) == (not asks)


def test_what_is_hidden_is_compared_when_it_is_seen_again(observed, shown, things, settled):
    gone = observed(*things[:2], seed=10)
    pixels = [around(mask) for mask in shown(things, 2)]
    during = gone
    for k in range(3):
        during = hiding(during, k, pixels[k])
    # It is taken away behind an arm; meanwhile something else is put down.
    memory = calm_after(settled, [during])
    beside = observed(*things[:2], ([0.25, 0.2, 0.02], [0.08, 0.08, 0.04]), seed=11)
    for k in range(3):
        beside = hiding(beside, k, pixels[k])
    step = step_of(memory, beside)
    assert step.region is not None and not step.full
    assert not any((mask & mine).any() for mask, mine in zip(step.region, pixels))
    assert not any(view.hidden.any() for view in step.memory.seen.views)
    after = observed(*things[:2], ([0.25, 0.2, 0.02], [0.08, 0.08, 0.04]), seed=12)
    step = step_of(step.memory, after)
    for mask, mine in zip(step.region, shown(things, 2)):
        assert mask[mine].mean() > 0.8 and not mask[~around(mine)].any()


def test_what_is_seen_for_the_first_time_is_looked_at(observed, shown, things, still):
    """The robot has hidden it since the first frame set."""
    pixels = [around(mask) for mask in shown(things, 2)]
    start, settled = still[0], still[3]
    for k in range(3):
        start, settled = hiding(start, k, pixels[k]), hiding(settled, k, pixels[k])
    memory = step_of(None, start).memory
    memory = calm_after(memory, [start, start])
    memory = step_of(memory, settled).memory
    step = step_of(memory, still[4])
    assert step.region is not None and not step.full
    for mask, mine, view in zip(step.region, pixels, still[4].views):
        np.testing.assert_array_equal(mask, mine & view.foreground)
    assert not any(view.hidden is not None and view.hidden.any() for view in
                   step.memory.seen.views)
    assert not any((mask & ~pending).any() for mask, pending in zip(
        step.region, step.memory.pending))


def test_what_is_hidden_settles_later(shown, things, still):
    """Before the first look has settled, an arm comes, stays, and leaves."""
    pixels = [around(mask) for mask in shown(things, 2)]
    arm = still[1]
    for k in range(3):
        arm = hiding(arm, k, pixels[k])
    step = step_of(calm_after(step_of(None, still[0]).memory, still[:1]), arm)
    assert step.settled and not step.full, 'what the arm hides must not be forgotten'
    for mask, mine, view in zip(step.region, pixels, still[0].views):
        np.testing.assert_array_equal(mask, view.foreground & ~mine)
    memory = calm_after(step.memory, 4 * [arm])
    step = step_of(memory, still[2])
    assert step.settled and not step.full
    for mask, mine, view in zip(step.region, pixels, still[0].views):
        np.testing.assert_array_equal(mask, view.foreground & mine)
    calm_after(step.memory, 2 * still)


def test_a_camera_that_drops_out_asks_for_nothing(observed, seen, things, settled):
    def without_first(seed):
        views = seen(*things, seed=seed)
        return observe([replace(views[0], depth=np.full_like(views[0].depth, np.nan)),
                        *views[1:]])

    memory = calm_after(settled, [without_first(10), without_first(11),
                                  observed(*things, seed=12)])
    # What has changed meanwhile is noticed when it is back.
    memory = calm_after(memory, [without_first(13)])
    step = step_of(memory, observed(*things, THIRD, seed=14))
    assert step.region is not None and all(mask.any() for mask in step.region)


def test_a_camera_that_was_not_there_at_first_is_looked_at(seen, observed, things):
    views = seen(*things)
    first = observe([replace(views[0], depth=np.full_like(views[0].depth, np.nan)), *views[1:]])
    now = observed(*things, seed=1)
    step = next_step(step_of(None, first).memory, now, AccumulateConfig(full_share=0.9))
    np.testing.assert_array_equal(step.region[0], now.views[0].foreground)
    assert not step.region[1].any() and not step.region[2].any()
