# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels of change detection against filters of scipy and plain numpy."""

from hooc_perception.core.incremental.kernels.windows import (
    accumulate_pixels,
    at_edges,
    compare_windows,
)
import numpy as np
import pytest
from scipy import ndimage

SHAPES = [(40, 31), (5, 5), (1, 9), (7, 1), (1, 1), (6, 11)]


def image(shape, seed, holes=0.3):
    """Return an (H, W) depth image of random steps, with holes."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.8, 1.2, shape) + rng.choice([0, 0.6], shape, p=[0.8, 0.2])
    return np.where(rng.random(shape) < holes, np.nan, depth).astype(np.float32)


def windows(values):
    """Return (H, W) means over 5 x 5 pixels, the border repeated."""
    return ndimage.uniform_filter(np.asarray(values, float), 5, mode='nearest')


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('holes', [0.0, 0.3, 1.0])
def test_edges_are_where_neighbours_differ(shape, holes):
    depth = image(shape, 1, holes)
    high = ndimage.maximum_filter(np.where(np.isnan(depth), -np.inf, depth), 3)
    low = ndimage.minimum_filter(np.where(np.isnan(depth), np.inf, depth), 3)
    expected = np.isfinite(low) & (high - low > 0.3 * low.astype(float))
    np.testing.assert_array_equal(at_edges(depth, 0.3), expected)
    assert holes or depth.size == 1 or expected.any()


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('holes', [0.0, 0.3, 1.0])
def test_windows_are_compared_in_the_mean(shape, holes):
    before, now = image(shape, 2, holes), image(shape, 3, holes)
    edge, clip = np.random.default_rng(4).random(shape) < 0.2, 0.05
    known, seen = np.isfinite(before), np.isfinite(now)
    counts = known & seen & ~edge
    shift = np.where(counts, np.clip(now - before, -clip, clip), 0)
    expected = [windows(a) for a in (shift, counts, ~known & seen, known & ~seen)]
    for got, own in zip(compare_windows(before, now, edge, clip), expected, strict=True):
        assert got.dtype == np.float32
        np.testing.assert_allclose(got, own, atol=1e-6)
    if holes == 0.3 and before.size > 50:
        assert np.ptp(expected[0]) > 0.01 and expected[2].max() > 0 and expected[3].max() > 0


def accumulated(depth, count, now, again, aside, noise, low, high, frames):
    """Return (depth, count) after one more image, rule by rule."""
    known, seen = np.isfinite(depth), np.isfinite(now)
    allowed = np.clip(noise * depth ** 2, low, high)
    with np.errstate(invalid='ignore'):
        agree = (known & seen & (np.abs(now - depth) <= allowed)) | (~known & ~seen)
    first = again | (~agree & (count <= 1))
    more = np.minimum(count.astype(int) + 1, frames)
    with np.errstate(invalid='ignore'):
        mean = np.where(agree & known, depth + (now - depth) / more, depth)
    mean = np.where(first, now, mean)
    number = np.where(first, 1, np.where(agree, more, count.astype(int) - 1))
    return np.where(aside, depth, mean), np.where(aside, count, number)


@pytest.mark.parametrize('shape', SHAPES)
def test_readings_are_accumulated_by_the_rules(shape):
    rng = np.random.default_rng(5)
    depth, count = image(shape, 6, 0.2), rng.integers(1, 6, shape).astype(np.uint8)
    for turn in range(20):
        # Most readings are near, some are off, some are missing.
        off = rng.choice([0, 0.5], shape, p=[0.8, 0.2])
        now = (image(shape, 6, 0.2) + rng.normal(0, 0.003, shape) + off).astype(np.float32)
        again, aside = rng.random(shape) < 0.1, rng.random(shape) < 0.1
        settings = (0.004, 0.003, 0.006, 5)
        expected = accumulated(depth, count, now, again, aside, *settings)
        depth, count = accumulate_pixels(depth, count, now, again, aside, *settings)
        np.testing.assert_allclose(depth, expected[0], rtol=1e-6)
        np.testing.assert_array_equal(count, expected[1])
    assert count.min() >= 1 and count.max() <= 5


def test_what_is_given_is_left_as_it_is():
    depth, count = image((6, 7), 1), np.ones((6, 7), np.uint8)
    before = depth.copy()
    none = np.zeros((6, 7), bool)
    accumulate_pixels(depth, count, depth + np.float32(0.001), none, none, 0.1, 0.1, 0.1, 9)
    np.testing.assert_array_equal(depth, before)
    assert (count == 1).all()
