# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
What an object's own shape error leaves over: foreground next to what the object explains.

A real pan is deeper than the generic one. The part of its wall that the best fit does not reach
is no evidence for a second object. A pixel is residue of a hypothesis if it lies on a smooth patch
that the hypothesis explains in good part, and within reach of its bounding box.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import Float32Array, Float64Array, Int64Array
from hooc_perception.core.frame.kernels.pixel_lists import PixelLists
from hooc_perception.core.frame.kernels.records import Views
from hooc_perception.core.kernels.pose import rotation_of, TX
import numba as nb
import numpy as np

# Pixels that cost less are explained by the hypothesis that shows them.
EXPLAINED = 0.8


class PatchPixels(NamedTuple):
    """
    The pixels of each smooth patch.

    :ivar start: (patches + 1,) int64; `pixel` (E,) int64, ascending in each patch.
    """

    start: Int64Array
    pixel: Int64Array


class ResidueSettings(NamedTuple):
    """
    Which pixels are residue, and what they cost.

    :ivar cost: of a pixel, between 0 and that of unexplained foreground, 1.
    :ivar least_share: of a patch that a hypothesis has to explain.
    :ivar behind_m: distance behind the measured surface at which residue is drawn, so that
        whatever explains the reading itself is nearer.
    """

    cost: float
    least_share: float
    behind_m: float


@nb.njit(cache=True)
def _patches(k: int, lists: PixelLists, views: Views, least_share: float) -> Int64Array:
    """Return the patches that row k explains in good part."""
    hits = np.zeros(len(views.patch_size), np.int64)
    for e in range(lists.offsets[k], lists.offsets[k + 1]):
        patch = views.patch[lists.pixel[e]]
        if patch >= 0 and lists.cost[e] < EXPLAINED:
            hits[patch] += 1
    return np.flatnonzero((hits > 0) & (hits >= least_share * views.patch_size))


@nb.njit(cache=True, inline='always')
def _within(i: int, views: Views, view: int, h: Float64Array, R: Float64Array,
            half: Float64Array) -> bool:
    """Return whether the reading of pixel i lies in a box of half sides `half` around h."""
    width: int = views.size[view, 0]
    j = i - views.first[view]
    d = views.depth[i]
    local = np.empty(3)
    local[0] = (j % width - views.K[view, 0, 2]) / views.K[view, 0, 0] * d
    local[1] = (j // width - views.K[view, 1, 2]) / views.K[view, 1, 1] * d
    local[2] = d
    world = views.R[view].T @ (local - views.t[view])
    for axis in range(3):
        x = 0.0
        for a in range(3):
            x += R[a, axis] * (world[a] - h[TX + a])
        if abs(x) > half[axis]:
            return False
    return True


@nb.njit(cache=True)
def _residue_of(k: int, lists: PixelLists, views: Views, patches: PatchPixels, h: Float64Array,
                half: Float64Array, settings: ResidueSettings) -> Int64Array:
    """Return the residue pixels of row k."""
    mine = lists.pixel[lists.offsets[k]:lists.offsets[k + 1]]
    chosen = _patches(k, lists, views, settings.least_share)
    most = 0
    for patch in chosen:
        most += patches.start[patch + 1] - patches.start[patch]
    out, n = np.empty(most, np.int64), 0
    R = np.empty((3, 3))
    rotation_of(h, R)
    for patch in chosen:
        for e in range(patches.start[patch], patches.start[patch + 1]):
            i = patches.pixel[e]
            at = np.searchsorted(mine, i)
            if at < len(mine) and mine[at] == i:
                continue
            view = int(np.searchsorted(views.first, i, side='right')) - 1
            if _within(i, views, view, h, R, half):
                out[n] = i
                n += 1
    return out[:n]


@nb.njit(cache=True, parallel=True)
def with_residue(lists: PixelLists, views: Views, patches: PatchPixels, rows: Float64Array,
                 half: Float64Array, settings: ResidueSettings,
                 ) -> tuple[Int64Array, Int64Array, Float32Array, Float32Array]:
    """
    Return (offsets, pixel, depth, cost) of PixelLists with the residue of every row appended.

    :param lists: pixels of each row ascending.
    :param rows: (m, 10) hypotheses, see core/kernels/pose.py; `half` (m, 3) half sides of the box
        within which their residue lies, metres.
    """
    m = rows.shape[0]
    extra = [np.empty(0, np.int64) for _ in range(m)]
    for k in nb.prange(m):
        extra[k] = _residue_of(k, lists, views, patches, rows[k], half[k], settings)
    offsets = np.zeros(m + 1, np.int64)
    for k in range(m):
        offsets[k + 1] = offsets[k] + lists.offsets[k + 1] - lists.offsets[k] + len(extra[k])
    pixel = np.empty(offsets[m], np.int64)
    depth, cost = np.empty(offsets[m], np.float32), np.empty(offsets[m], np.float32)
    for k in nb.prange(m):
        a, b, at = lists.offsets[k], lists.offsets[k + 1], offsets[k]
        n = b - a
        pixel[at:at + n], depth[at:at + n] = lists.pixel[a:b], lists.depth[a:b]
        cost[at:at + n] = lists.cost[a:b]
        for e in range(len(extra[k])):
            i = extra[k][e]
            pixel[at + n + e] = i
            depth[at + n + e] = views.depth[i] + settings.behind_m
            cost[at + n + e] = settings.cost
    return offsets, pixel, depth, cost
