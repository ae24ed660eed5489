# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Tests of what lies beyond the outline of a hypothesis (frame/kernels/outline.py)."""

from hooc_perception.core.frame.kernels.outline import (
    AGREES_M,
    ENDING,
    NEARER_M,
    OPEN,
    outlines,
    PLANE_M,
    SMOOTH_COSINE,
)
from hooc_perception.core.frame.kernels.pixel_lists import PixelLists
from hooc_perception.core.frame.kernels.records import Views
import numpy as np
import pytest

H, W = 60, 80
FX = 400.0
TABLE_M, TOP_M = 1.0, 0.95


def views_of(depth, foreground, normals=None):
    """Return Views of cameras at the origin that look along z; depth (V, H, W)."""
    n = len(depth)
    if normals is None:
        normals = np.tile(np.array([0, 0, -1], np.float32), (depth.size, 1))
    K = np.tile(np.array([[FX, 0, W / 2], [0, FX, H / 2], [0, 0, 1.0]]), (n, 1, 1))
    none = np.full(depth.size, -1, np.int32)
    return Views(K, np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)),
                 np.tile(np.array([W, H]), (n, 1)), np.arange(n + 1) * H * W,
                 depth.astype(np.float32).ravel(), foreground.ravel(),
                 normals.reshape(-1, 3).astype(np.float32), none, np.ones(1, np.int64),
                 np.zeros((0, 2), np.uint8), none)


def lists_of(masks, rendered):
    """Return the PixelLists of masks, each (V, H, W) bool, with rendered depth (V, H, W)."""
    pixels = [np.flatnonzero(mask) for mask in masks]
    offsets = np.concatenate([[0], np.cumsum([len(p) for p in pixels])])
    pixel = np.concatenate(pixels)
    return PixelLists(offsets, pixel, rendered.ravel()[pixel].astype(np.float32),
                      np.zeros(len(pixel), np.float32))


@pytest.fixture
def board():
    """Return (depth, foreground) of one view: a board of 20 x 40 pixels above the table."""
    depth, foreground = np.full((1, H, W), TABLE_M), np.zeros((1, H, W), bool)
    foreground[0, 20:40, 20:60] = True
    depth[foreground] = TOP_M
    return depth, foreground


def test_a_whole_object_ends_at_its_outline_and_a_part_does_not(board):
    depth, foreground = board
    half = foreground.copy()
    half[..., 40:] = False
    shares = outlines(lists_of([foreground, half], depth), views_of(depth, foreground))
    np.testing.assert_allclose(shares[0], [0, 1])
    # Of the half's outline of 80 pixels, 20 lie on the board.
    np.testing.assert_allclose(shares[1], [0.25, 0.75])


def test_what_hides_the_outline_says_nothing(board):
    depth, foreground = board
    half = foreground.copy()
    half[..., 40:] = False
    depth[0, :, 40:60] = TOP_M - 2 * NEARER_M
    foreground[0, :, 40:60] = True
    shares = outlines(lists_of([half], depth), views_of(depth, foreground))
    np.testing.assert_allclose(shares, [[0, 0.75]])


@pytest.mark.parametrize('change', ['crease', 'step', 'far off'])
def test_a_surface_that_does_not_go_on_ends(board, change):
    depth, foreground = board
    half = foreground.copy()
    half[..., 40:] = False
    normals = np.tile(np.array([0, 0, -1.0]), (1, H, W, 1))
    rendered = depth.copy()
    if change == 'crease':
        angle = 1.1 * np.arccos(SMOOTH_COSINE)
        normals[..., 40:, :] = [np.sin(angle), 0, -np.cos(angle)]
    elif change == 'step':
        depth[0, 20:40, 40:60] += 1.5 * PLANE_M
    else:
        rendered += 1.1 * AGREES_M
    shares = outlines(lists_of([half], rendered), views_of(depth, foreground, normals))
    np.testing.assert_allclose(shares, [[0, 0 if change == 'far off' else 1]])


def reference(mask, rendered, views):
    """Return (OPEN, ENDING) of one mask (V, H, W), pixel by pixel."""
    depth = views.depth.reshape(mask.shape)
    front = views.foreground.reshape(mask.shape)
    normals = views.normals.reshape(*mask.shape, 3)
    counts, steps = [0, 0], 0

    def point(v, y, x):
        return depth[v, y, x] * np.array([(x - W / 2) / FX, (y - H / 2) / FX, 1])

    for v, y, x in zip(*np.nonzero(mask)):
        if not abs(rendered[v, y, x] - depth[v, y, x]) < AGREES_M:
            continue
        for b, a in ((y, x + 1), (y, x - 1), (y + 1, x), (y - 1, x)):
            if not (0 <= b < H and 0 <= a < W) or mask[v, b, a]:
                continue
            steps += 1
            if np.isnan(depth[v, b, a]) or depth[v, b, a] < depth[v, y, x] - NEARER_M:
                continue
            n = normals[v, y, x]
            smooth = (front[v, b, a] and n @ normals[v, b, a] >= SMOOTH_COSINE
                      and abs(n @ (point(v, b, a) - point(v, y, x))) < PLANE_M)
            counts[OPEN if smooth else ENDING] += 1
    return np.array(counts) / max(steps, 1)


def test_the_kernel_agrees_with_the_plain_reference():
    rng = np.random.default_rng(0)
    depth = TOP_M + 0.004 * rng.standard_normal((2, H, W)) + 0.03 * (rng.random((2, H, W)) < 0.1)
    depth[rng.random(depth.shape) < 0.05] = np.nan
    foreground = rng.random(depth.shape) < 0.8
    normals = rng.normal([0, 0, -1], 0.15, (*depth.shape, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    views = views_of(depth, foreground, normals)
    masks = [np.zeros(depth.shape, bool) for _ in range(4)]
    masks[0][0, 10:30, 5:50] = masks[1][1, :, 70:] = masks[2][:, 40:, 3:9] = True
    rendered = TOP_M + 0.015 * rng.standard_normal(depth.shape)
    masks[3][:] = rng.random(depth.shape) < 0.3
    found = outlines(lists_of(masks, rendered), views)
    rendered = rendered.astype(np.float32)
    for row, mask in zip(found, masks):
        np.testing.assert_allclose(row, reference(mask, rendered, views), atol=1e-12)
    assert (found.max(0) > 0.2).all()


def test_a_row_without_pixels_has_no_outline(board):
    depth, foreground = board
    np.testing.assert_array_equal(
        outlines(lists_of([np.zeros_like(foreground)], depth), views_of(depth, foreground)),
        [[0, 0]])
