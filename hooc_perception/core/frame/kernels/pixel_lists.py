# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The pixels that hypotheses cover, hypothesis by hypothesis."""

from typing import NamedTuple

from hooc_perception.core.arrays import Float32Array, Float64Array, Int64Array
from hooc_perception.core.frame.kernels.records import Context, Hypotheses, Meshes, Views
from hooc_perception.core.kernels import raster
from hooc_perception.core.kernels.pose import posed
import numba as nb
import numpy as np


class PixelLists(NamedTuple):
    """
    The pixels that each of m hypotheses covers by itself, for core.energy.compositor.

    :ivar offsets: (m + 1,) int64; entries offsets[k]:offsets[k + 1] belong to row k.
    :ivar pixel: (E,) int64 numbers among the stacked pixels of all views.
    :ivar depth: (E,) float32 rendered, metres; `cost` (E,) float32, see kernels/compare.py.
    """

    offsets: Int64Array
    pixel: Int64Array
    depth: Float32Array
    cost: Float32Array

    def take(self, rows: Int64Array) -> 'PixelLists':
        """Return the lists of the given rows."""
        return packed(self.offsets[:-1][rows], np.diff(self.offsets)[rows], self.pixel,
                      self.depth, self.cost)

    def extended(self, other: 'PixelLists') -> 'PixelLists':
        """Return these rows followed by those of `other`."""
        return PixelLists(np.concatenate([self.offsets, self.offsets[-1] + other.offsets[1:]]),
                          np.concatenate([self.pixel, other.pixel]),
                          np.concatenate([self.depth, other.depth]),
                          np.concatenate([self.cost, other.cost]))


def packed(starts: Int64Array, counts: Int64Array, pixel: Int64Array, depth: Float32Array,
           cost: Float32Array) -> PixelLists:
    """
    Return the PixelLists of rows that lie anywhere in longer arrays.

    :param starts: (m,) int64 first entry of each row; `counts` (m,) int64 its entries.
    """
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return PixelLists(offsets, *_packed(starts, offsets, pixel, depth, cost))


@nb.njit(cache=True)
def _packed(starts: Int64Array, offsets: Int64Array, pixel: Int64Array, depth: Float32Array,
            cost: Float32Array) -> tuple[Int64Array, Float32Array, Float32Array]:
    """Return (pixel, depth, cost) without gaps: entries starts[k].. go to offsets[k].."""
    n = offsets[-1]
    out = np.empty(n, np.int64), np.empty(n, np.float32), np.empty(n, np.float32)
    for k in range(len(starts)):
        for e in range(offsets[k + 1] - offsets[k]):
            i, j = starts[k] + e, offsets[k] + e
            out[0][j], out[1][j], out[2][j] = pixel[i], depth[i], cost[i]
    return out


@nb.njit(cache=True, parallel=True)
def window_areas(hypotheses: Hypotheses, meshes: Meshes, views: Views) -> Int64Array:
    """Return (m,) int64, pixels of the windows of all views that the hypotheses lie in."""
    m = hypotheses.rows.shape[0]
    out = np.zeros(m, np.int64)
    for k in nb.prange(m):
        s = hypotheses.shape[k]
        V = meshes.vertices[meshes.vertex_start[s]:meshes.vertex_start[s + 1]]
        world = np.empty(V.shape)
        posed(hypotheses.rows[k], V, world)
        for v in range(views.K.shape[0]):
            u0, v0, u1, v1 = raster.in_view(world, views.R[v], views.t[v], views.K[v],
                                            views.size[v])[1]
            out[k] += (u1 - u0) * (v1 - v0)
    return out


@nb.njit(cache=True)
def compose(members: Int64Array, lists: PixelLists, context: Context) -> None:
    """Add rows of PixelLists to a Context, in place: nearest wins, the next one stands behind."""
    for k in members:
        for e in range(lists.offsets[k], lists.offsets[k + 1]):
            i, depth, cost = lists.pixel[e], lists.depth[e], lists.cost[e]
            if depth < context.depth[i]:
                context.next_depth[i], context.next_cost[i] = context.depth[i], context.cost[i]
                context.depth[i], context.cost[i], context.owner[i] = depth, cost, k
            elif depth < context.next_depth[i]:
                context.next_depth[i], context.next_cost[i] = depth, cost


@nb.njit(cache=True)
def mean_probabilities(lists: PixelLists, views: Views, mean_p: Float64Array,
                       foreground: Float64Array) -> None:
    """
    Average the category probabilities over the pixels of every row of PixelLists.

    :param mean_p: (m, N + 1) float64, starts with 0; `foreground` (m,) float64, starts with 0,
        gets the number of foreground pixels.
    """
    for k in range(len(lists.offsets) - 1):
        known = 0
        for e in range(lists.offsets[k], lists.offsets[k + 1]):
            i = lists.pixel[e]
            foreground[k] += views.foreground[i]
            if views.p_row[i] >= 0:
                known += 1
                for c in range(views.p.shape[1]):
                    mean_p[k, c] += views.p[views.p_row[i], c]
        mean_p[k] /= 255.0 * max(known, 1)
