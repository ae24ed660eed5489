# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""An arm is set aside in all views; what is put down is not."""

from dataclasses import replace

from hooc_perception.core.incremental.changes import changed_pixels
from hooc_perception.core.incremental.intruders import intruders
from hooc_perception.core.segment.config import AccumulateConfig, ObserveConfig
import numpy as np
import pytest

# Middle and sides, metres. It reaches beyond the table and the workspace.
ARM = ([0.55, 0.0, 0.2], [1.0, 0.08, 0.08])


def set_aside(before, now, config=ObserveConfig()):
    """Return what is set aside of views that follow others."""
    changed = [changed_pixels(a.depth, b.depth, b.camera.K[0, 0]) for a, b in zip(before, now)]
    return intruders([view.depth for view in before], now, changed, config)


@pytest.fixture
def before(seen, cube, board):
    """Return views of a cube and a board."""
    return seen(cube, board)


@pytest.fixture
def with_thing(seen, cube, board):
    """Return a function: middle, sides of a thing -> views with it, too."""
    return lambda *thing: seen(cube, board, thing, seed=9)


def test_an_arm_that_comes_from_outside_is_set_aside_in_all_views(before, with_thing, shown, cube,
                                                                  board):
    for mask, arm in zip(set_aside(before, with_thing(*ARM)), shown([cube, board, ARM], 2),
                         strict=True):
        assert arm.sum() > 300
        assert mask[arm].mean() > 0.95
        # With a rim, but without the table and what stands there.
        assert mask.sum() < 2.2 * arm.sum()


def test_nothing_is_set_aside_where_nothing_changes(before, seen, cube, board):
    for views in (before, seen(cube, board, seed=9), seen(cube, seed=9)):
        assert not any(mask.any() for mask in set_aside(before, views))


@pytest.mark.parametrize('thing', [
    ([0.0, -0.2, 0.05], [0.2, 0.15, 0.1]),      # a box is put down
    ([0.0, -0.2, 0.01], [0.40, 0.03, 0.02])],   # something long, well inside of the images
    ids=['box', 'long'])
def test_what_is_put_down_is_not_set_aside(before, with_thing, thing):
    now = with_thing(*thing)
    assert not any(mask.any() for mask in set_aside(before, now))
    # Objects that are smaller than it is would make it an arm.
    small = ObserveConfig(accumulate=AccumulateConfig(largest_object_m=0.15))
    assert all(mask.any() for mask in set_aside(before, now, small))


def test_what_is_longer_than_any_object_is_set_aside_wherever_it_comes_from(before, with_thing,
                                                                            shown, cube, board):
    stick = ([0.0, -0.15, 0.1], [0.55, 0.06, 0.06])
    for mask, pixels in zip(set_aside(before, with_thing(*stick)),
                            shown([cube, board, stick], 2), strict=True):
        v, u = np.nonzero(pixels)
        assert v.min() > 0 and u.min() > 0, 'it does not touch the border'
        assert mask[pixels].mean() > 0.95


def test_what_is_half_as_long_is_set_aside_if_it_reaches_in(before, with_thing, shown, cube,
                                                            board):
    """A forearm that only one image shows to come from outside is one in the others, too."""
    # 0.3 m of it are within the workspace of 0.35 m.
    config = ObserveConfig(workspace_radius_m=0.35)
    arm = ([0.25, -0.1, 0.25], [0.35, 0.07, 0.07])
    pixels = shown([cube, board, arm], 2)
    for mask, mine in zip(set_aside(before, with_thing(*arm), config), pixels, strict=True):
        assert mask[mine].mean() > 0.9
    inside = ([0.0, -0.1, 0.25], [0.35, 0.07, 0.07])
    assert not any(mask.any() for mask in set_aside(before, with_thing(*inside), config))


def narrowed(view, last, band=0):
    """Return a view that ends at a column, with a band without readings beyond it."""
    depth = view.depth[:, :last + 1 + band].copy()
    depth[:, last + 1:] = np.nan
    return replace(view, camera=replace(view.camera, width=depth.shape[1]), depth=depth)


STICK = ([0.0, -0.1, 0.1], [0.36, 0.06, 0.06])


def ends(pixels):
    """Return a column shortly before the end of each mask."""
    return [np.flatnonzero(mask.any(0))[-1] - 3 for mask in pixels]


@pytest.mark.parametrize('band', [0, 7])
def test_what_all_images_cut_off_reaches_in(before, with_thing, shown, cube, board, band):
    """As long as half of the longest object, and nobody sees its end."""
    now, pixels = with_thing(*STICK), shown([cube, board, STICK], 2)
    assert not any(mask.any() for mask in set_aside(before, now))
    views = [[narrowed(view, end, band) for view, end in zip(both, ends(pixels))]
             for both in (before, now)]
    for mask, mine, last in zip(set_aside(*views), pixels, ends(pixels)):
        assert mask[:, :last + 1][mine[:, :last + 1]].mean() > 0.9


def test_what_one_image_cuts_off_lies_at_its_border(before, with_thing, shown, cube, board):
    """Another one shows it from end to end: an object that is put down there."""
    now, pixels = with_thing(*STICK), shown([cube, board, STICK], 2)
    last = ends(pixels)[0]
    old, new = ([narrowed(views[0], last), *views[1:]] for views in (before, now))
    assert not any(mask.any() for mask in set_aside(old, new))
    # That camera alone cannot tell.
    alone, = set_aside(old[:1], new[:1])
    assert alone[pixels[0][:, :last + 1]].mean() > 0.9


def test_the_part_that_a_camera_sees_belongs_to_the_arm_that_another_one_sees(before, with_thing,
                                                                              shown, cube, board):
    now, (*_, pixels) = with_thing(*ARM), shown([cube, board, ARM], 2)
    # In the last camera, something that was there before covers all of it but a short stretch.
    middle = np.median(np.nonzero(pixels)[1])
    hand = pixels & (np.abs(np.arange(160) - middle) < 8)
    last, old = (replace(view, depth=np.where(pixels & ~hand, np.float32(0.4), view.depth))
                 for view in (now[2], before[2]))
    mask = set_aside([*before[:2], old], [*now[:2], last])[2]
    assert mask[hand].mean() > 0.8
    # By itself nobody could tell.
    assert not set_aside([old], [last])[0].any()


def test_what_is_outside_of_the_workspace_is_left_alone(before, with_thing):
    outside = ([0.75, 0.0, 0.1], [0.08, 0.9, 0.08])
    config = ObserveConfig(workspace_radius_m=0.5)
    assert not any(mask.any() for mask in set_aside(before, with_thing(*outside), config))


def test_cameras_of_which_nothing_is_known(before, with_thing):
    now = with_thing(*ARM)
    changed = [changed_pixels(a.depth, b.depth, 150.0) for a, b in zip(before, now)]
    old = [None, *(view.depth for view in before[1:])]
    masks = intruders(old, now, changed, ObserveConfig())
    assert not masks[0].any() and masks[1].any() and masks[2].any()
    for mask, view in zip(masks, now):
        assert mask.shape == view.depth.shape and mask.dtype == bool
