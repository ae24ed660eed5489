# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Join points of a cloud where the surface goes on smoothly."""

import numba as nb
import numpy as np


@nb.njit(cache=True)
def root(parent, i):
    """Return the first member of the part that `i` is joined to, and shorten the way there."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@nb.njit(cache=True)
def smooth_labels(points, normals, radius, smooth_cos, step):
    """
    Return (n,) int32 patch of each point, numbered as they come; see core/frame/patches.py.

    Neighbours are looked for in the cells of a grid of width `radius`: in a point's own and in
    those next to it.
    """
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
    order = np.argsort(key)
    ordered = key[order]
    parent = np.arange(n)
    for at in range(n):
        i = order[at]
        for dx in range(-1, 2):
            for dy in range(-1, 2):
                # Cells along z follow one another.
                first = key[i] + (dx * shape[1] + dy) * shape[2] - 1
                j_at = np.searchsorted(ordered, first)
                while j_at < n and ordered[j_at] <= first + 2:
                    j = order[j_at]
                    j_at += 1
                    if j <= i:
                        continue
                    apart, along_i, along_j, dot = 0.0, 0.0, 0.0, 0.0
                    for k in range(3):
                        d = points[j, k] - points[i, k]
                        apart += d * d
                        along_i += d * normals[i, k]
                        along_j += d * normals[j, k]
                        dot += normals[i, k] * normals[j, k]
                    if (apart <= radius * radius and dot > smooth_cos
                            and abs(along_i) + abs(along_j) < step):
                        a, b = root(parent, i), root(parent, j)
                        parent[max(a, b)] = min(a, b)
    labels, known = np.empty(n, np.int32), 0
    for i in range(n):
        first = root(parent, i)
        if first == i:
            labels[i] = known
            known += 1
        else:
            labels[i] = labels[first]
    return labels
