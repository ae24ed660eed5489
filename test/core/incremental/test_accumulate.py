# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Depth over several images: a mean of what agrees, which starts again where something changes."""

from dataclasses import replace

from hooc_perception.core.incremental.accumulate import (
    accumulate,
    Accumulated,
    changed_in,
    fused_view,
)
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np
import pytest

SHAPE, NOISE = (60, 80), 0.002
CAMERA = Camera('c', 80, 60, np.array([[90.0, 0, 39.5], [0, 90, 29.5], [0, 0, 1]]), np.zeros(5),
                np.eye(4))
NONE = np.zeros(SHAPE, bool)


def view(seed, depth=1.0, noise=NOISE):
    """Return a view of a wall, with noise."""
    image = np.full(SHAPE, depth) + np.random.default_rng(seed).normal(0, noise, SHAPE)
    return RectifiedView(CAMERA, image.astype(np.float32))


@pytest.fixture
def wall():
    """Return what ten images of the wall give, of which at most eight count."""
    seen = Accumulated.first(view(0))
    for seed in range(1, 10):
        seen = accumulate(seen, view(seed), NONE, NONE, 8)
    return seen


def test_the_mean_is_better_than_an_image_and_its_count_is_capped(wall):
    assert wall.camera is CAMERA and wall.count.dtype == np.uint8
    # Here and there a reading is too far off to agree.
    assert wall.count.max() == 8 and (wall.count == 8).mean() > 0.95
    assert np.std(wall.depth) < 1.3 * NOISE / np.sqrt(8)
    two = accumulate(Accumulated.first(view(0)), view(1), NONE, NONE, 8)
    agreed = two.count == 2
    np.testing.assert_allclose(
        two.depth[agreed], (0.5 * (view(0).depth + view(1).depth))[agreed], rtol=1e-6)
    assert agreed.mean() > 0.98


def test_a_change_is_shown_at_once_and_not_smeared(wall):
    changed, now = NONE.copy(), view(20)
    changed[10:30, 20:40] = True
    now.depth[changed] -= np.float32(0.015)
    got = accumulate(wall, now, changed, NONE, 8)
    np.testing.assert_array_equal(got.depth[changed], now.depth[changed])
    assert (got.count[changed] == 1).all() and got.count[~changed].max() == 8
    gone = replace(now, depth=np.where(changed, np.float32(np.nan), now.depth))
    assert np.isnan(accumulate(wall, gone, changed, NONE, 8).depth[changed]).all()


@pytest.mark.parametrize('reading', [0.4, 2.5, np.nan])
def test_a_reading_that_disagrees_is_outvoted(wall, reading):
    odd = view(20)
    odd.depth[5:8, 5:8] = reading
    got = accumulate(wall, odd, NONE, NONE, 8)
    np.testing.assert_array_equal(got.depth[5:8, 5:8], wall.depth[5:8, 5:8])
    np.testing.assert_array_equal(got.count[5:8, 5:8], wall.count[5:8, 5:8] - 1)
    # One that keeps on disagreeing wins in the end, however small it is.
    for seed in range(21, 30):
        odd = view(seed)
        odd.depth[5:8, 5:8] = reading
        got = accumulate(got, odd, NONE, NONE, 8)
    np.testing.assert_allclose(got.depth[5:8, 5:8], reading)
    assert 1 <= got.count[5:8, 5:8].min() and got.count[5:8, 5:8].max() <= 4


def test_what_has_no_reading_is_filled_at_once():
    holed = view(0)
    holed.depth[5:8, 5:8] = np.nan
    got = accumulate(Accumulated.first(holed), view(1), NONE, NONE, 8)
    np.testing.assert_array_equal(got.depth[5:8, 5:8], view(1).depth[5:8, 5:8])


def test_what_is_set_aside_stays_as_it_was(wall):
    aside = NONE.copy()
    aside[:, :40] = True
    got = accumulate(wall, view(20, 0.5), aside, aside, 8)
    np.testing.assert_array_equal(got.depth[aside], wall.depth[aside])
    np.testing.assert_array_equal(got.count[aside], wall.count[aside])


def test_readings_agree_within_the_noise_of_the_image():
    """What is 5 mm off does not agree where noise is a tenth of a millimetre."""
    for noise, agrees in ((0.0001, False), (0.01, True)):
        first = view(0, noise=noise)
        now = view(1, noise=noise)
        now.depth[5, 5] = first.depth[5, 5] + np.float32(0.005)
        got = accumulate(Accumulated.first(first), now, NONE, NONE, 8)
        assert (got.count[5, 5] == 2) == agrees


def test_images_without_readings():
    empty = RectifiedView(CAMERA, np.full(SHAPE, np.nan, np.float32))
    first = Accumulated.first(empty)
    again = accumulate(first, empty, NONE, NONE, 8)
    assert np.isnan(again.depth).all() and (again.count == 2).all()
    assert not changed_in(first, empty).any()


def test_the_latest_view_with_the_accumulated_depth(wall):
    now = view(20)
    assert fused_view(wall, now, NONE).hidden is None
    np.testing.assert_array_equal(fused_view(wall, now, NONE).depth, wall.depth)
    robot, aside = NONE.copy(), NONE.copy()
    robot[:, :10], aside[:10] = True, True
    got = fused_view(wall, replace(now, hidden=robot), aside)
    np.testing.assert_array_equal(got.hidden, robot | aside)
    assert np.isnan(got.depth[robot | aside]).all()
    np.testing.assert_array_equal(got.depth[~got.hidden], wall.depth[~got.hidden])
    assert np.isfinite(wall.depth).all(), 'what was accumulated stays'


def test_what_the_robot_hides_has_not_changed(wall):
    now = view(20)
    now.depth[10:40, 10:30] = 0.8
    robot = NONE.copy()
    robot[:, :20] = True
    assert changed_in(wall, now)[12:38, 12:28].all()
    got = changed_in(wall, replace(now, hidden=robot))
    assert not got[:, :20].any() and got[12:38, 20:28].all()


def test_another_camera_does_not_continue(wall):
    assert wall.continues(view(1))
    assert not wall.continues(replace(view(1), camera=replace(CAMERA, name='other')))
