# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Walks of many samples down decision trees, in lock-step to hide memory latency."""

import numba as nb
import numpy as np

BLOCK = 16


@nb.njit(cache=True, nogil=True)
def walk_tree(x, feature, threshold, left, root, out):
    """
    Fill (n,) int32 with the node in which each row of x (n, F) float32 ends.

    A row goes to `left[node]` where x[feature] <= threshold and else to `left[node] + 1`;
    `feature` < 0 marks a leaf.
    """
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


@nb.njit(cache=True, parallel=True)
def predict(x, feature, threshold, left, roots, leaf, leaf_p):
    """
    Return (n, C) float32, the mean leaf distribution over all trees.

    :param leaf: (nodes,) int32 row of `leaf_p` for leaves.
    :param leaf_p: (L, C) uint8, probability x 255.
    """
    n, n_classes = x.shape[0], leaf_p.shape[1]
    out = np.zeros((n, n_classes), np.float32)
    chunk = 512
    for b in nb.prange((n + chunk - 1) // chunk):
        lo, hi = b * chunk, min(n, (b + 1) * chunk)
        end = np.empty(hi - lo, np.int32)
        for t in range(roots.shape[0]):
            walk_tree(x[lo:hi], feature, threshold, left, roots[t], end)
            for i in range(hi - lo):
                row = leaf_p[leaf[end[i]]]
                for c in range(n_classes):
                    out[lo + i, c] += row[c]
        for i in range(lo, hi):
            total = np.float32(0.0)
            for c in range(n_classes):
                total += out[i, c]
            for c in range(n_classes):
                out[i, c] /= total
    return out
