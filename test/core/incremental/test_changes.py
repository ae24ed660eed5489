# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What has changed between two depth images: objects, not noise."""

from dataclasses import replace

from hooc_perception.core.incremental import changes as module
from hooc_perception.core.incremental.changes import (
    changed_share,
    changes,
    comparable,
    same_camera,
)
from hooc_perception.core.segment.observe import observe
import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

SHAPE, FOCAL_PX = (120, 160), 150.0


def changed_pixels(before, now):
    """Return the changed pixels of a coarse camera."""
    return module.changed_pixels(before, now, FOCAL_PX)


def slope():
    """Return (H, W) depth of a table from 1.5 m at the top to 0.6 m at the bottom."""
    return np.repeat(np.linspace(1.5, 0.6, SHAPE[0])[:, None], SHAPE[1], 1)


def noisy(depth, seed, noise=0.001, holes=0.0):
    """Return a depth image with noise (metres at 1 m) that grows with the square of depth."""
    rng = np.random.default_rng(seed)
    image = depth + rng.normal(0, 1, depth.shape) * noise * depth ** 2
    image[rng.random(depth.shape) < holes] = np.nan
    return image.astype(np.float32)


def nearer(depth, rows, columns, by):
    """Return depth with something `by` metres nearer at some pixels."""
    depth = depth.copy()
    depth[rows, columns] -= by
    return depth


@pytest.mark.parametrize('holes', [0.0, 0.3])
@pytest.mark.parametrize('noise', [0.0, 0.0005, 0.001, 0.002, 0.004])
def test_noise_is_no_change_and_an_object_is(noise, holes):
    depth, box = slope(), (slice(50, 66), slice(70, 90))
    for seed in range(5):
        before = noisy(depth, 2 * seed, noise, holes)
        assert not changed_pixels(before, noisy(depth, 2 * seed + 1, noise, holes)).any()
        placed = noisy(nearer(depth, *box, 0.03), 2 * seed + 1, noise, holes)
        for a, b in ((before, placed), (placed, before)):
            changed = changed_pixels(a, b)
            assert changed[box].mean() > 0.7
            changed[44:72, 64:96] = False
            assert not changed.any(), 'nothing changes elsewhere'


@pytest.mark.parametrize('noise', [0.0, 0.0005, 0.001])
def test_a_knife_on_the_table_is_noticed(noise):
    """Three pixels wide and 6 mm high: as much as the noise of single pixels, or little more."""
    depth = np.full(SHAPE, 1.0)
    knife = (slice(40, 80), slice(70, 73))
    for seed in range(5):
        before = noisy(depth, 2 * seed, noise)
        changed = changed_pixels(before, noisy(nearer(depth, *knife, 0.006), 2 * seed + 1, noise))
        assert changed[knife].mean() > 0.9
        changed[36:84, 66:77] = False
        assert not changed.any()


def test_edges_that_flicker_are_no_change():
    depth = nearer(np.full(SHAPE, 1.2), slice(30, 90), slice(40, 100), 0.4)

    def flickering(seed):
        """Return the image with the pixels on either side of the edge at any depth between."""
        rng, image = np.random.default_rng(seed), noisy(depth, seed)
        for columns in ([39, 40], [99, 100]):
            image[30:90, columns] = rng.choice([0.8, 0.95, 1.2], (60, 2))
        for rows in ([29, 30], [89, 90]):
            image[rows, 40:100] = rng.choice([0.8, 0.95, 1.2], (2, 60))
        return image

    for seed in range(5):
        a, b = flickering(seed), flickering(100 + seed)
        assert (np.abs(a - b) > 0.1).sum() > 200
        assert not changed_pixels(a, b).any()
        gone = changed_pixels(a, noisy(np.full(SHAPE, 1.2), 100 + seed))
        assert gone[34:86, 44:96].all(), 'the box itself is noticed'


def test_readings_that_appear_and_disappear():
    full = noisy(np.full(SHAPE, 1.0), 0)
    hole = full.copy()
    hole[50:60, 70:80] = np.nan
    for a, b in ((full, hole), (hole, full)):
        changed = changed_pixels(a, b)
        assert changed[51:59, 71:79].all()
        assert changed.sum() <= 100, 'no more than the hole'
    few = full.copy()
    few[50:53, 70:73] = np.nan
    assert not changed_pixels(full, few).any(), 'a few pixels are no change'
    elsewhere = full.copy()
    elsewhere[20:30, 70:80] = np.nan
    changed = changed_pixels(hole, elsewhere)
    assert changed[51:59, 71:79].all() and changed[21:29, 71:79].all()


def test_images_without_readings_and_images_that_are_the_same():
    full, empty = noisy(slope(), 0, holes=0.1), np.full(SHAPE, np.nan, np.float32)
    assert not changed_pixels(full, full).any()
    assert not changed_pixels(empty, empty).any()
    assert changed_pixels(empty, full).mean() > 0.9
    assert changed_pixels(full, empty).mean() > 0.9
    one = np.full((1, 1), 1.0, np.float32)
    assert not changed_pixels(one, one).any()


def test_a_single_flying_pixel_is_no_change():
    before = noisy(np.full(SHAPE, 1.0), 0)
    now = noisy(np.full(SHAPE, 1.0), 1)
    now[60, 80] = 0.3
    assert not changed_pixels(before, now).any()


@pytest.fixture
def observed(seen):
    """Return a function: boxes -> Observation by three cameras."""
    return lambda *boxes, **kwargs: observe(seen(*boxes, **kwargs))


def test_changes_of_the_foreground_in_every_view(observed, cube, board):
    before, now = observed(cube, board), observed(board, seed=9)
    masks = changes(before, now)
    for mask, a, b in zip(masks, before.views, now.views, strict=True):
        gone = a.foreground & ~b.foreground
        assert mask[gone].mean() > 0.8 and mask.sum() < 1.3 * gone.sum()
    total = sum((a.foreground | b.foreground).sum() for a, b in zip(before.views, now.views))
    assert changed_share(before, now, masks) == sum(m.sum() for m in masks) / total
    assert 0.1 < changed_share(before, now, masks) < 0.6
    assert not any(mask.any() for mask in changes(before, observed(cube, board, seed=9)))


def test_what_changes_beside_the_table_does_not_count(observed, cube, board):
    before = observed(cube)
    view = before.views[0]
    elsewhere = view.table & ~ndimage.binary_dilation(view.foreground, iterations=5)
    depth = np.where(elsewhere, view.depth - np.float32(0.2), view.depth)
    now = replace(before, views=(replace(view, depth=depth), *before.views[1:]))
    assert changed_pixels(view.depth, depth)[elsewhere].mean() > 0.7
    assert not any(mask.any() for mask in changes(before, now))


def test_hidden_pixels_tell_nothing(observed, cube, board):
    before, now = observed(cube, board), observed(board, seed=9)
    everything = np.ones(before.views[0].depth.shape, bool)

    def hiding(observation, k):
        return replace(observation, views=tuple(
            replace(v, hidden=everything) if i == k else v
            for i, v in enumerate(observation.views)))

    plain = changes(before, now)
    for masks in (changes(hiding(before, 1), now), changes(before, hiding(now, 1))):
        assert not masks[1].any()
        for k in (0, 2):
            np.testing.assert_array_equal(masks[k], plain[k])


def test_other_cameras_cannot_be_compared(observed, small, cube):
    before = observed(cube)
    assert comparable(before, observed(cube, seed=5))
    fewer = replace(before, views=before.views[:2])
    assert not comparable(before, fewer)
    with pytest.raises(ValueError, match='different cameras'):
        changes(before, fewer)
    turned = observed(cube, cameras=small.rig(start=0.35))
    assert not comparable(before, turned)


def test_a_camera_that_is_only_levelled_stands_where_it_stood(small):
    c = small.rig()[0]

    def moved(rotvec=(0, 0, 0), by=(0, 0, 0)):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = Rotation.from_rotvec(rotvec).as_matrix(), by
        return replace(c, T_world_camera=T @ c.T_world_camera)

    assert same_camera(c, moved((0.001, 0.001, 0), (0, 0, 0.002)))
    assert not same_camera(c, moved((0, 0, 0.02)))
    assert not same_camera(c, moved(by=(0.006, 0, 0)))
    assert not same_camera(c, replace(c, name='other'))
    assert not same_camera(c, replace(c, K=c.K + np.diag([1.0, 0, 0])))
    assert not same_camera(c, replace(c, width=c.width + 1))
