# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bend of the surface around each voxel, at two reaches along the surface graph."""

from hooc_perception.core.arrays import (
    AnyArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
)
from hooc_perception.core.classification.kernels.graph import neighbours
from hooc_perception.core.kernels.linalg import eigen_jacobi
import numba as nb
import numpy as np

# Steps of averaging along the graph after which the measures are read.
REACHES = (3, 10)
# Measures of a voxel: `normal_shape` (4), then valley, ridge and curvature.
SHAPES, MEASURES = 4, 7
TEXTURE_FEATURES = MEASURES * len(REACHES)
# What is averaged: second moment of the normals (6), then valley, ridge and curvature.
MOMENTS, VALLEY, RIDGE, CURVATURE, RAW = 6, 6, 7, 8, 9


@nb.njit(cache=True, parallel=True)
def _diffuse(values: Float32Array, start: Int64Array, other: Int32Array, w: Float32Array,
             steps: int) -> Float32Array:
    """Return (m, C) after `steps` of averaging over the weighted graph, own weight 1."""
    m, n = values.shape
    now, new = values.copy(), np.empty_like(values)
    for _ in range(steps):
        for i in nb.prange(m):
            total = np.float32(1.0)
            for c in range(n):
                new[i, c] = now[i, c]
            for k in range(start[i], start[i + 1]):
                total += w[k]
                for c in range(n):
                    new[i, c] += w[k] * now[other[k], c]
            for c in range(n):
                new[i, c] /= total
        now, new = new, now
    return now


@nb.njit(cache=True)
def normal_shape(tensor: AnyArray, out: AnyArray) -> None:
    """
    Fill out (4,) with the shape that the second moment of normals (xx xy xz yy yz zz) indicates.

    The two smaller eigenvalues (plane 0 0, cylinder 0 1/2, ball 1/3 1/3), and the vertical
    components of the axis that the normals avoid and of their main direction.
    """
    a, v = np.empty((3, 3)), np.empty((3, 3))
    a[0, 0], a[0, 1], a[0, 2], a[1, 1], a[1, 2], a[2, 2] = (
        tensor[0], tensor[1], tensor[2], tensor[3], tensor[4], tensor[5])
    a[1, 0], a[2, 0], a[2, 1] = a[0, 1], a[0, 2], a[1, 2]
    eigen_jacobi(a, v)
    low, high = 0, 0        # they stay equal only if nothing is a number
    for k in range(1, 3):
        low = k if a[k, k] < a[low, low] else low
        high = k if a[k, k] >= a[high, high] else high
    middle = 3 - low - high if low != high else low
    out[0], out[1] = a[low, low], a[middle, middle]
    out[2], out[3] = abs(v[2, low]), abs(v[2, high])


@nb.njit(cache=True, parallel=True)
def _measure(averages: Float32Array, out: Float32Array) -> None:
    """Fill (m, MEASURES): `normal_shape` of the moments of (m, RAW), then the other columns."""
    for i in nb.prange(averages.shape[0]):
        normal_shape(averages[i, :MOMENTS], out[i, :SHAPES])
        for k in range(RAW - MOMENTS):
            out[i, SHAPES + k] = averages[i, MOMENTS + k]


@nb.njit(cache=True)
def _raw(points: Float64Array, normals: Float64Array, pairs: Int32Array) -> Float64Array:
    """Return (m, RAW) of voxels: second moment of the normal, mean valley, ridge, curvature."""
    m = points.shape[0]
    raw = np.zeros((m, RAW), np.float64)
    degree = np.full(m, 1e-6)
    for i in range(m):
        n = normals[i]
        raw[i, 0], raw[i, 1], raw[i, 2] = n[0] * n[0], n[0] * n[1], n[0] * n[2]
        raw[i, 3], raw[i, 4], raw[i, 5] = n[1] * n[1], n[1] * n[2], n[2] * n[2]
    for e in range(pairs.shape[0]):
        a, b = pairs[e, 0], pairs[e, 1]
        d, bend = 0.0, 0.0
        for k in range(3):
            d += (points[b, k] - points[a, k]) ** 2
            bend += (normals[b, k] - normals[a, k]) * (points[b, k] - points[a, k])
        d = np.sqrt(d)
        bend /= d
        for i in (a, b):
            raw[i, VALLEY] += max(0.0, -bend)
            raw[i, RIDGE] += max(0.0, bend)
            raw[i, CURVATURE] += bend / d
            degree[i] += 1
    for i in range(m):
        for k in range(MOMENTS, RAW):
            raw[i, k] /= degree[i]
    return raw


@nb.njit(cache=True)
def textures(points: Float64Array, normals: Float64Array, pairs: Int32Array,
             weight: Float64Array) -> Float32Array:
    """
    Return (m, TEXTURE_FEATURES) float32 of voxels: MEASURES columns per reach.

    :param points: (m, 3) and normals (m, 3); pairs (e, 2), weight (e,) in [0, 1].
    """
    out = np.empty((points.shape[0], TEXTURE_FEATURES), np.float32)
    start, other, w = neighbours(points.shape[0], pairs, weight)
    now, done = _raw(points, normals, pairs).astype(np.float32), 0
    for r in range(len(REACHES)):
        now = _diffuse(now, start, other, w, REACHES[r] - done)
        done = REACHES[r]
        _measure(now, out[:, MEASURES * r:MEASURES * r + MEASURES])
    return out
