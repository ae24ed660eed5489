# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The pixels that hypotheses cover, hypothesis by hypothesis: see frame.evidence.PixelLists."""

from hooc_perception.core.frame.kernels.compare import posed
from hooc_perception.core.kernels import raster
import numba as nb
import numpy as np


@nb.njit(cache=True, parallel=True)
def window_areas(H, category, vertices, vertex_start, K, R_cw, t_cw, size):
    """Return (m,) int64, pixels of the windows of all views that hypotheses (m, 10) lie in."""
    out = np.zeros(H.shape[0], np.int64)
    for k in nb.prange(H.shape[0]):
        V = vertices[vertex_start[category[k] - 1]:vertex_start[category[k]]]
        world = np.empty(V.shape)
        posed(H[k], V, world)
        for v in range(K.shape[0]):
            u0, v0, u1, v1 = raster.in_view(world, R_cw[v], t_cw[v], K[v], size[v])[1]
            out[k] += (u1 - u0) * (v1 - v0)
    return out


@nb.njit(cache=True)
def packed(starts, offsets, pixel, depth, cost):
    """Return (pixel, depth, cost) without gaps: entries starts[k].. go to offsets[k].."""
    n = offsets[-1]
    out = np.empty(n, np.int64), np.empty(n, np.float32), np.empty(n, np.float32)
    for k in range(len(starts)):
        for e in range(offsets[k + 1] - offsets[k]):
            i, j = starts[k] + e, offsets[k] + e
            out[0][j], out[1][j], out[2][j] = pixel[i], depth[i], cost[i]
    return out


@nb.njit(cache=True)
def compose(members, offsets, pixel, depth, cost, owner, depth_1, cost_1, depth_2, cost_2):
    """Write nearest and next member of every pixel into the last five arrays, see explain_one."""
    for k in members:
        for e in range(offsets[k], offsets[k + 1]):
            i = pixel[e]
            if depth[e] < depth_1[i]:
                depth_2[i], cost_2[i] = depth_1[i], cost_1[i]
                depth_1[i], cost_1[i], owner[i] = depth[e], cost[e], k
            elif depth[e] < depth_2[i]:
                depth_2[i], cost_2[i] = depth[e], cost[e]


@nb.njit(cache=True)
def opinions(offsets, pixel, p_row, p, foreground, mean_p, front):
    """
    Average the class probabilities over the pixels of every row of PixelLists.

    :param mean_p: (n, N + 1) float64, starts with 0; `front` (n,) gets the foreground pixels.
    """
    for k in range(len(offsets) - 1):
        said = 0
        for e in range(offsets[k], offsets[k + 1]):
            i = pixel[e]
            front[k] += foreground[i]
            if p_row[i] >= 0:
                said += 1
                for c in range(p.shape[1]):
                    mean_p[k, c] += p[p_row[i], c]
        mean_p[k] /= 255.0 * max(said, 1)
