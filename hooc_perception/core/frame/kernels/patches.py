# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Join the points of a cloud where the surface continues smoothly."""

from hooc_perception.core.arrays import Float64Array, Int32Array, Int64Array
import numba as nb
import numpy as np


@nb.njit(cache=True)
def root(parent: Int64Array, i: int) -> int:
    """Return the representative of the set that `i` belongs to, halving the path to it."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@nb.njit(cache=True)
def smooth_labels(points: Float64Array, normals: Float64Array, radius: float, smooth_cos: float,
                  step: float) -> Int32Array:
    """
    Return (n,) int32 patch of each point, numbered as they come; see core/frame/patches.py.

    Neighbours are looked for in the cells of a grid of width `radius`: in a point's own and in
    those next to it.
    """
    n = points.shape[0]
    key, shape = _cells(points, radius)
    order = np.argsort(key)
    ordered = key[order]
    parent = np.arange(n)
    for at in range(n):
        i = order[at]
        for dx in range(-1, 2):
            for dy in range(-1, 2):
                # Cells along z are consecutive.
                first = key[i] + (dx * shape[1] + dy) * shape[2] - 1
                j_at = int(np.searchsorted(ordered, first))
                while j_at < n and ordered[j_at] <= first + 2:
                    j = order[j_at]
                    j_at += 1
                    if j > i and _continues(points, normals, i, j, radius, smooth_cos, step):
                        a, b = root(parent, i), root(parent, j)
                        parent[max(a, b)] = min(a, b)
    return _numbered(parent)


@nb.njit(cache=True)
def _cells(points: Float64Array, radius: float) -> tuple[Int64Array, Int64Array]:
    """Return (n,) int64, the number of the grid cell of each point, and the grid's (3,) shape."""
    n = points.shape[0]
    low, shape = np.empty(3), np.ones(3, np.int64)
    for k in range(3):
        low[k] = points[:, k].min() - radius
        shape[k] = int((points[:, k].max() - low[k]) / radius) + 2
    key = np.empty(n, np.int64)
    for i in range(n):
        key[i] = 0
        for k in range(3):
            key[i] = key[i] * shape[k] + int((points[i, k] - low[k]) / radius)
    return key, shape


@nb.njit(cache=True, inline='always')
def _continues(points: Float64Array, normals: Float64Array, i: int, j: int, radius: float,
               smooth_cos: float, step: float) -> bool:
    """Return whether the surface continues smoothly from point i to point j."""
    distance2, along_i, along_j, dot = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        d = points[j, k] - points[i, k]
        distance2 += d * d
        along_i += d * normals[i, k]
        along_j += d * normals[j, k]
        dot += normals[i, k] * normals[j, k]
    return (distance2 <= radius * radius and dot > smooth_cos
            and abs(along_i) + abs(along_j) < step)


@nb.njit(cache=True)
def _numbered(parent: Int64Array) -> Int32Array:
    """Return (n,) int32, the number of each point's set; sets are numbered as they come."""
    n, known = parent.shape[0], 0
    labels = np.empty(n, np.int32)
    for i in range(n):
        first = root(parent, i)
        if first == i:
            labels[i] = known
            known += 1
        else:
            labels[i] = labels[first]
    return labels
