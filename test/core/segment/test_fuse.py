# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fusion of repeated images of a scene that stands still."""

from hooc_perception.core.segment.fusion import block_means, fuse_depth, Fusion
import numpy as np
import pytest

rng = np.random.default_rng(0)


@pytest.mark.parametrize('n', [1, 2, 3, 5, 8])
def test_median_and_count_as_plain_python_has_them(n):
    stack = rng.uniform(0.5, 2.0, (n, 6, 7)).astype(np.float32)
    stack[rng.random(stack.shape) < 0.4] = np.nan
    depth, count = fuse_depth(stack)
    for v in range(6):
        for u in range(7):
            seen = sorted(x for x in stack[:, v, u] if x == x)
            assert count[v, u] == len(seen)
            if not seen or 2 * len(seen) < n:
                assert np.isnan(depth[v, u])
            else:
                assert depth[v, u] == seen[(len(seen) - 1) // 2]
    assert depth.dtype == np.float32 and count.dtype == np.uint8


def test_noise_falls():
    stack = (1.0 + 0.01 * rng.standard_normal((9, 50, 60))).astype(np.float32)
    assert np.std(fuse_depth(stack)[0]) < 0.5 * np.std(stack[0])


def test_pixels_whose_history_is_short_count_only_that():
    stack = rng.uniform(0.5, 2.0, (5, 6, 7)).astype(np.float32)
    stack[rng.random(stack.shape) < 0.4] = np.nan
    newest = rng.integers(1, 8, (6, 7))
    depth, count = fuse_depth(stack, newest)
    for v in range(6):
        for u in range(7):
            alone, n = fuse_depth(stack[-newest[v, u]:, v:v + 1, u:u + 1])
            np.testing.assert_array_equal(depth[v, u], alone[0, 0])
            assert count[v, u] == n[0, 0]


def test_block_means_as_plain_python_has_them():
    depth = rng.uniform(0.5, 2.0, (19, 26)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.6] = np.nan
    means, readings = block_means(depth)
    assert means.shape == readings.shape == (3, 4)
    for v in range(3):
        for u in range(4):
            seen = [x for x in depth[8 * v:8 * v + 8, 8 * u:8 * u + 8].ravel() if x == x]
            assert readings[v, u] == len(seen)
            expected = np.mean(seen) if len(seen) >= 16 else np.nan
            np.testing.assert_allclose(means[v, u], expected, rtol=1e-6)


# A small thing on a table 1 m away, 3 cm high: 0.5 % of the pixels.
PLACE, ELSEWHERE = np.s_[40:56, 60:84], np.s_[90:106, 120:144]


def image(*things, height_m=0.03):
    """Return a depth image (200, 400) with noise, holes and edges that flicker."""
    depth = np.ones((200, 400), np.float32)
    for thing in things:
        depth[thing] -= height_m
    depth += 0.003 * rng.standard_normal(depth.shape).astype(np.float32)
    depth[:, 200:202] += 0.3 * rng.integers(0, 2, (200, 2))
    depth[rng.random(depth.shape) < 0.05] = np.nan
    return depth


def fused(images, frames=5):
    """Return (fused depth, counts) of images that came in one after the other."""
    fusion = Fusion()
    for depth in images:
        fusion.add(depth, frames)
    return fusion.fused()


@pytest.mark.parametrize('after', [1, 2, 3, 4])
def test_a_small_thing_is_never_shown_where_it_was(after):
    moved = [image(PLACE) for _ in range(6)] + [image(ELSEWHERE) for _ in range(after)]
    depth, _ = fused(moved)
    assert (np.abs(depth[PLACE] - 1) < 0.015).mean() > 0.9
    assert (np.abs(depth[ELSEWHERE] - 0.97) < 0.015).mean() > 0.9
    gone, _ = fused(moved[:6] + [image() for _ in range(after)])
    assert (np.abs(gone[PLACE] - 1) < 0.015).mean() > 0.9


def test_what_stands_still_keeps_its_images_while_something_moves():
    depth, count = fused([image(PLACE) for _ in range(5)]
                         + [image(ELSEWHERE) for _ in range(2)])
    still = np.s_[120:, :180]
    assert count[still].mean() > 4.5
    assert np.nanstd(depth[still]) < 0.7 * 0.003
    # Two images of the new place, no more, have been seen.
    assert count[ELSEWHERE].max() <= 2 and count[PLACE].max() <= 2


def test_noise_and_edges_that_flicker_are_no_motion():
    depth, count = fused([image(PLACE) for _ in range(30)])
    assert count.mean() > 4.5 and np.nanstd(depth[:, :190]) < 0.008
    assert np.nanstd(depth[120:, :180]) < 0.7 * 0.003


def test_one_odd_image_costs_nothing_and_is_shown_but_once():
    images = [image() for _ in range(5)] + [image(PLACE, height_m=0.2), image()]
    assert (fused(images[:6])[0][PLACE] < 0.85).mean() > 0.9
    depth, count = fused(images)
    assert (np.abs(depth[PLACE] - 1) < 0.015).mean() > 0.9 and count[PLACE].mean() > 4


def test_what_can_no_longer_be_measured_is_forgotten_with_the_second_image():
    images = [image(PLACE) for _ in range(9)]
    for _ in range(2):
        images.append(image())
        images[-1][PLACE] = np.nan
    assert np.isnan(fused(images, 9)[0][PLACE]).all()


def test_all_that_changes_begins_anew_and_so_does_another_size():
    depth, count = fused([image() for _ in range(5)] + [image() - np.float32(0.3)])
    assert np.nanmax(depth[:, :190]) < 0.75 and count.max() == 1
    depth, count = fused([image() for _ in range(5)] + [image()[:100, :99]])
    assert depth.shape == (100, 99) and count.max() == 1
