# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bend of the surface around each voxel, at two reaches along the surface graph."""

import numba as nb
import numpy as np

REACHES = (3, 10)
TEXTURE_FEATURES = 7 * len(REACHES)


@nb.njit(cache=True)
def _neighbours(m, pairs, weight):
    """Return (start (m + 1,), other, w): the graph as neighbour lists, in the edges' order."""
    start = np.zeros(m + 1, np.int64)
    for e in range(pairs.shape[0]):
        start[pairs[e, 0] + 1] += 1
        start[pairs[e, 1] + 1] += 1
    start = np.cumsum(start)
    fill = start[:-1].copy()
    other = np.empty(2 * pairs.shape[0], np.int32)
    w = np.empty(2 * pairs.shape[0], np.float32)
    for e in range(pairs.shape[0]):
        a, b = pairs[e, 0], pairs[e, 1]
        other[fill[a]], w[fill[a]] = b, weight[e]
        other[fill[b]], w[fill[b]] = a, weight[e]
        fill[a] += 1
        fill[b] += 1
    return start, other, w


@nb.njit(cache=True, parallel=True)
def _diffuse(values, start, other, w, steps):
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


@nb.njit(cache=True, error_model='numpy')
def eigen(a, v):
    """
    Diagonalise a symmetric (3, 3) matrix in place; v (3, 3) gets the eigenvectors as columns.

    Cyclic Jacobi rotations (Golub & Van Loan, 8.5): a call of LAPACK costs ten times as much.
    """
    for i in range(3):
        for j in range(3):
            v[i, j] = 1.0 if i == j else 0.0
    for _ in range(12):
        off = abs(a[0, 1]) + abs(a[0, 2]) + abs(a[1, 2])
        if off <= 1e-12 * (abs(a[0, 0]) + abs(a[1, 1]) + abs(a[2, 2])):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] == 0.0:
                    continue
                theta = 0.5 * (a[q, q] - a[p, p]) / a[p, q]
                t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
                if theta < 0:
                    t = -t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    x, y = a[k, p], a[k, q]
                    a[k, p], a[k, q] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = a[p, k], a[q, k]
                    a[p, k], a[q, k] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = v[k, p], v[k, q]
                    v[k, p], v[k, q] = c * x - s * y, s * x + c * y


@nb.njit(cache=True)
def normal_shape(tensor, out):
    """
    Fill out (4,): what the second moment of normals (xx xy xz yy yz zz) says of the shape.

    The two smaller eigenvalues (plane 0 0, cylinder 0 1/2, ball 1/3 1/3), and the vertical
    components of the axis that the normals avoid and of their main direction.
    """
    a, v = np.empty((3, 3)), np.empty((3, 3))
    a[0, 0], a[0, 1], a[0, 2], a[1, 1], a[1, 2], a[2, 2] = (
        tensor[0], tensor[1], tensor[2], tensor[3], tensor[4], tensor[5])
    a[1, 0], a[2, 0], a[2, 1] = a[0, 1], a[0, 2], a[1, 2]
    eigen(a, v)
    low, high = 0, 0        # they stay together only where nothing is a number
    for k in range(1, 3):
        low = k if a[k, k] < a[low, low] else low
        high = k if a[k, k] >= a[high, high] else high
    middle = 3 - low - high if low != high else low
    out[0], out[1] = a[low, low], a[middle, middle]
    out[2], out[3] = abs(v[2, low]), abs(v[2, high])


@nb.njit(cache=True, parallel=True)
def _describe(moments, out):
    """Fill (m, 7): `normal_shape` of the first six columns, then the other three."""
    for i in nb.prange(moments.shape[0]):
        normal_shape(moments[i, :6], out[i, :4])
        for k in range(3):
            out[i, 4 + k] = moments[i, 6 + k]


@nb.njit(cache=True)
def textures(points, normals, pairs, weight):
    """
    Return (m, TEXTURE_FEATURES) float32 of voxels: `normal_shape`, valley, ridge, curvature.

    :param points: (m, 3) and normals (m, 3); pairs (e, 2), weight (e,) in [0, 1].
    """
    m = points.shape[0]
    raw = np.zeros((m, 9), np.float64)
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
            raw[i, 6] += max(0.0, -bend)
            raw[i, 7] += max(0.0, bend)
            raw[i, 8] += bend / d
            degree[i] += 1
    for i in range(m):
        for k in range(6, 9):
            raw[i, k] /= degree[i]
    out = np.empty((m, TEXTURE_FEATURES), np.float32)
    start, other, w = _neighbours(m, pairs, weight)
    now, done = raw.astype(np.float32), 0
    for r in range(len(REACHES)):
        now = _diffuse(now, start, other, w, REACHES[r] - done)
        done = REACHES[r]
        _describe(now, out[:, 7 * r:7 * r + 7])
    return out
