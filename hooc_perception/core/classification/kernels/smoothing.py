# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Thinning of pixels, and spreading of probabilities over the surface graph of all views."""

from hooc_perception.core.arrays import (
    AnyArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    UInt8Array,
    UInt16Array,
)
from hooc_perception.core.classification.kernels.graph import neighbours
import numba as nb
import numpy as np

SAME_SURFACE_M = 0.015


@nb.njit(cache=True)
def thin(camera: UInt8Array, uv: UInt16Array, points: Float64Array,
         stride: int) -> tuple[Int64Array, Int64Array]:
    """
    Return (rows (k,), donor (n,)): pixels to classify, and for each pixel the one it copies.

    Rows are the pixels on a grid of `stride`, and those with no such pixel within `stride`
    pixels and SAME_SURFACE_M; `donor` indexes into `rows`.

    :param camera: (n,) uint8; uv (n, 2) uint16, in row-major order within each camera.
    :param points: (n, 3) float64 world, metres.
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


@nb.njit(cache=True, parallel=True)
def spread(p: Float32Array, voxel: AnyArray, n_voxels: int, pairs: Int32Array,
           weight: Float32Array, steps: int) -> Float32Array:
    """
    Return (n_voxels, C) float32 probabilities, spread over a weighted graph.

    Each step replaces a voxel's distribution by the weighted mean of its neighbours' and of
    that of its own pixels; voxels without a pixel start unknown and take their neighbours'.

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
    now, known = own.copy(), count > 0
    new, reached = np.empty_like(own), np.empty_like(known)
    for _ in range(steps):
        for v in nb.prange(n_voxels):
            sums = np.empty(n_classes, np.float32)
            total = np.float32(1.0 if count[v] > 0 else 0.0)
            for c in range(n_classes):
                sums[c] = own[v, c]
            for k in range(start[v], start[v + 1]):
                u, share = other[k], w[k]
                if known[u]:
                    total += share
                    for c in range(n_classes):
                        sums[c] += share * now[u, c]
            reached[v] = known[v] or total > 1e-6
            for c in range(n_classes):
                new[v, c] = sums[c] / total if total > 1e-6 else now[v, c]
        now, new = new, now
        known, reached = reached, known
    for v in range(n_voxels):
        if not known[v]:
            now[v, 0] = 1.0
    return now
