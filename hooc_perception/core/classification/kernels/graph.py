# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The surface graph as neighbour lists: what is gathered per voxel needs no edge to be locked."""

from hooc_perception.core.arrays import AnyArray, Float32Array, Int32Array, Int64Array
import numba as nb
import numpy as np


@nb.njit(cache=True)
def neighbours(m: int, pairs: Int32Array, weight: AnyArray
               ) -> tuple[Int64Array, Int32Array, Float32Array]:
    """
    Return (start (m + 1,), other, w): a graph of m voxels as neighbour lists, in the edges' order.

    :param pairs: (e, 2) int32; weight (e,).
    """
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
