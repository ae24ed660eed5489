# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Walks of many samples down decision trees, in lock-step to hide memory latency."""

from typing import NamedTuple

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array, UInt8Array
import numba as nb
import numpy as np

# Samples that walk together, and samples per parallel task.
BLOCK = 16
CHUNK = 512


class Nodes(NamedTuple):
    """
    The nodes of trees, one after the other.

    :ivar feature: (nodes,) int32 column or test that a node looks at, -1 in a leaf.
    :ivar threshold: (nodes,) float32; a sample goes left where its value <= threshold.
    :ivar left: (nodes,) int32 left child, the right one is `left + 1`.
    """

    feature: Int32Array
    threshold: Float32Array
    left: Int32Array


class Leaves(NamedTuple):
    """
    The class distributions at the leaves.

    :ivar row: (nodes,) int32 row of `p` for leaves; p (L, C) uint8 probability x 255.
    """

    row: Int32Array
    p: UInt8Array


@nb.njit(cache=True, nogil=True)
def walk_tree(x: Float32Array, nodes: Nodes, root: int, out: Int32Array) -> None:
    """Fill out (n,) int32 with the node in which each row of x (n, F) float32 ends."""
    feature, threshold, left = nodes.feature, nodes.threshold, nodes.left
    node = np.empty(BLOCK, np.int32)
    for start in range(0, x.shape[0], BLOCK):
        n = min(BLOCK, x.shape[0] - start)
        for i in range(n):
            node[i] = root
        going = True
        while going:
            going = False
            for i in range(n):
                k = node[i]
                f = feature[k]
                if f >= 0:
                    going = True
                    right = not (x[start + i, f] <= threshold[k])
                    node[i] = left[k] + (1 if right else 0)
        for i in range(n):
            out[start + i] = node[i]


@nb.njit(cache=True, nogil=True)
def add_leaves(end: Int32Array, leaves: Leaves, out: Float32Array) -> None:
    """Add the distribution of the leaf end[i] to each row of out (n, C) float32."""
    for i in range(end.shape[0]):
        row = leaves.p[leaves.row[end[i]]]
        for c in range(row.shape[0]):
            out[i, c] += row[c]


@nb.njit(cache=True, nogil=True)
def normalize(out: Float32Array) -> None:
    """Scale each row of out (n, C) float32 to a sum of 1."""
    for i in range(out.shape[0]):
        total = np.float32(0.0)
        for c in range(out.shape[1]):
            total += out[i, c]
        for c in range(out.shape[1]):
            out[i, c] /= total


@nb.njit(cache=True, parallel=True)
def predict(x: Float32Array, nodes: Nodes, roots: Int32Array, leaves: Leaves) -> Float32Array:
    """Return (n, C) float32, the mean leaf distribution of x (n, F) over all trees."""
    n = x.shape[0]
    out = np.zeros((n, leaves.p.shape[1]), np.float32)
    for b in nb.prange((n + CHUNK - 1) // CHUNK):
        lo, hi = b * CHUNK, min(n, (b + 1) * CHUNK)
        end = np.empty(hi - lo, np.int32)
        for t in range(roots.shape[0]):
            walk_tree(x[lo:hi], nodes, roots[t], end)
            add_leaves(end, leaves, out[lo:hi])
        normalize(out[lo:hi])
    return out


@nb.njit(cache=True)
def is_sound(nodes: Nodes, roots: Int32Array, leaf: Int32Array, n_leaves: int) -> bool:
    """Return whether all roots, children (behind their node) and leaves are where they can be."""
    n = nodes.feature.shape[0]
    for root in roots:
        if root < 0 or root >= n:
            return False
    for i in range(n):
        if nodes.feature[i] >= 0:
            if nodes.left[i] <= i or nodes.left[i] >= n - 1:
                return False
        elif leaf[i] < 0 or leaf[i] >= n_leaves:
            return False
    return True


@nb.njit(cache=True, parallel=True)
def quantise_rows(p: Float64Array, totals: Float64Array) -> UInt8Array:
    """
    Return uint8 rows of probabilities (n, C) x 255; what rounding loses goes to the nearest.

    :param totals: (n,) the sum of each row.
    """
    n, n_classes = p.shape
    out = np.empty((n, n_classes), np.uint8)
    for i in nb.prange(n):
        lost, left = np.empty(n_classes), 255
        for c in range(n_classes):
            scaled = p[i, c] * 255.0 / max(totals[i], 1e-12)
            whole = int(np.floor(scaled))
            out[i, c] = whole
            left -= whole
            lost[c] = scaled - whole
        for _ in range(left):
            most = np.argmax(lost)
            if lost[most] < 0.0:
                break
            out[i, most] += 1
            lost[most] = -1.0
    return out
