# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Thinning of pixels, and spreading of probabilities over the surface graph of all views."""

from hooc_perception.core.kernels.forest_texture import neighbours
import numba as nb
import numpy as np

SAME_SURFACE_M = 0.015


@nb.njit(cache=True)
def thin(camera, uv, points, stride):
    """
    Return (rows (k,), donor (n,)): pixels to classify, and the one that speaks for each.

    Rows are the pixels on a grid of `stride`, and those with no such pixel within `stride`
    pixels and SAME_SURFACE_M; `donor` indexes into `rows`.

    :param uv: (n, 2) uint16, in row-major order within each camera.
    """
    n = camera.shape[0]
    donor = np.full(n, -1, np.int64)
    rows = np.empty(n, np.int64)
    k, start = 0, 0
    while start < n:
        stop = start
        height, width = 0, 0
        while stop < n and camera[stop] == camera[start]:
            width, height = max(width, int(uv[stop, 0]) + 1), int(uv[stop, 1]) + 1
            stop += 1
        index = np.full((height, width), -1, np.int64)
        for i in range(start, stop):
            u, v = int(uv[i, 0]), int(uv[i, 1])
            if u % stride == 0 and v % stride == 0:
                index[v, u] = k
                rows[k] = i
                donor[i] = k
                k += 1
        for i in range(start, stop):
            if donor[i] >= 0:
                continue
            u, v = int(uv[i, 0]), int(uv[i, 1])
            best = SAME_SURFACE_M
            u0, v0 = u - u % stride, v - v % stride
            for a in (u0, u0 + stride):
                for b in (v0, v0 + stride):
                    if a < width and b < height and index[b, a] >= 0:
                        q = points[i] - points[rows[index[b, a]]]
                        d = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
                        if d < best:
                            best, donor[i] = d, index[b, a]
        for i in range(start, stop):
            if donor[i] < 0:
                donor[i] = k
                rows[k] = i
                k += 1
        start = stop
    return rows[:k], donor


@nb.njit(cache=True)
def spread(p, voxel, n_voxels, pairs, weight, steps):
    """
    Return (n_voxels, C) float32 probabilities, spread over a weighted graph.

    Each step replaces a voxel's distribution by the weighted mean of its neighbours' and of
    what its own pixels say; voxels without a pixel start unknown and take their neighbours'.

    :param p: (k, C) float32 of pixels, voxel (k,) where they lie.
    :param pairs: (e, 2) int32; weight (e,) float32 in [0, 1].
    """
    n_classes = p.shape[1]
    own = np.zeros((n_voxels, n_classes), np.float32)
    count = np.zeros(n_voxels, np.float32)
    for i in range(p.shape[0]):
        own[voxel[i]] += p[i]
        count[voxel[i]] += 1
    for v in range(n_voxels):
        if count[v] > 0:
            own[v] /= count[v]
    start, other, w = neighbours(n_voxels, pairs, weight)
    now, new = own.copy(), np.empty_like(own)
    known, reached = count > 0, count > 0
    for _ in range(steps):
        _step(own, count, start, other, w, now, known, new, reached)
        now, new = new, now
        known[:] = reached
    for v in range(n_voxels):
        if not known[v]:
            now[v, 0] = 1.0
    return now


@nb.njit(cache=True, parallel=True)
def _step(own, count, start, other, w, now, known, new, reached):
    """Write into `new` each voxel's mean with its neighbours; `reached` gets who has one."""
    for v in nb.prange(own.shape[0]):
        total = np.float32(1.0 if count[v] > 0 else 0.0)
        new[v] = own[v]
        for k in range(start[v], start[v + 1]):
            if known[other[k]]:
                total += w[k]
                for c in range(own.shape[1]):
                    new[v, c] += w[k] * now[other[k], c]
        if total > 1e-6:
            reached[v] = True
            for c in range(own.shape[1]):
                new[v, c] /= total
        else:
            new[v] = now[v]
