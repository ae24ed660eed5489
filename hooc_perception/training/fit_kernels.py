# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Growing one decision tree on quantised features, by information gain."""

import numba as nb
import numpy as np


@nb.njit(cache=True, nogil=True)
def x_log_x(n):
    """Return (n + 1,) float64 with k log2 k: entropies of counts become look-ups."""
    out = np.zeros(n + 1)
    for k in range(2, n + 1):
        out[k] = k * np.log2(k)
    return out


@nb.njit(cache=True, nogil=True)
def best_split(values, y, node_counts, n_bins, table, min_leaf, histogram, bin_sizes):
    """
    Return (gain, bin): the split `value <= bin` with the largest information gain.

    :param values: (n,) uint8 quantised feature; y (n,) uint8 classes.
    :param node_counts: (C,) int64 classes of all samples in the node.
    :param table: k log2 k for k up to n at least.
    :param histogram: (n_bins, C) int32 scratch; bin_sizes (n_bins,) int32 scratch.
    :return: gain in bits times n, -1.0 where no split leaves `min_leaf` samples each side.
    """
    n, n_classes = values.shape[0], node_counts.shape[0]
    histogram[:] = 0
    bin_sizes[:] = 0
    for i in range(n):
        histogram[values[i], y[i]] += 1
        bin_sizes[values[i]] += 1
    parent, inside_right = table[n], 0.0
    for c in range(n_classes):
        parent -= table[node_counts[c]]
        inside_right += table[node_counts[c]]
    left = np.zeros(n_classes, np.int64)
    inside_left, n_left = 0.0, 0
    best, best_bin = -1.0, -1
    for b in range(n_bins - 1):
        if bin_sizes[b] == 0:
            continue
        for c in range(n_classes):
            k = histogram[b, c]
            if k:
                old = left[c]
                inside_left += table[old + k] - table[old]
                inside_right += table[node_counts[c] - old - k] - table[node_counts[c] - old]
                left[c] = old + k
        n_left += bin_sizes[b]
        n_right = n - n_left
        if n_right < min_leaf:
            break
        if n_left < min_leaf:
            continue
        gain = parent - (table[n_left] - inside_left) - (table[n_right] - inside_right)
        if gain > best:
            best, best_bin = gain, b
    return best, best_bin


@nb.njit(cache=True, nogil=True)
def grow_tree(binned, y, samples, n_classes, n_bins, n_try, max_depth, min_leaf, min_gain, seed):
    """
    Return (feature, bin, left) of one tree, nodes in depth-first order; feature -1 = leaf.

    :param binned: (F, n) uint8 quantised features; y (n,) uint8.
    :param samples: (m,) int32 columns of `binned` that grow this tree; reordered in place.
    :param n_try: features drawn at each node.
    :param min_gain: least information gain, bits, of a split.
    """
    np.random.seed(seed)
    n_features, m = binned.shape[0], samples.shape[0]
    capacity = 2 * (m // max(min_leaf, 1)) + 3
    feature = np.full(capacity, -1, np.int32)
    split = np.zeros(capacity, np.uint8)
    left = np.zeros(capacity, np.int32)
    table = x_log_x(m)
    pool = np.arange(n_features)
    histogram = np.zeros((n_bins, n_classes), np.int32)
    bin_sizes = np.zeros(n_bins, np.int32)
    values = np.empty(m, np.uint8)
    classes = np.empty(m, np.uint8)
    buffer = np.empty(m, np.int32)
    stack = [(0, 0, m, 0)]
    used = 1
    while len(stack):
        node, lo, hi, depth = stack.pop()
        n = hi - lo
        counts = np.zeros(n_classes, np.int64)
        for i in range(n):
            classes[i] = y[samples[lo + i]]
            counts[classes[i]] += 1
        if depth >= max_depth or n < 2 * min_leaf or counts.max() == n:
            continue
        best, best_feature, best_bin = min_gain * n, -1, -1
        for t in range(min(n_try, n_features)):
            j = t + np.random.randint(0, n_features - t)
            pool[t], pool[j] = pool[j], pool[t]
            row = binned[pool[t]]
            for i in range(n):
                values[i] = row[samples[lo + i]]
            gain, b = best_split(values[:n], classes[:n], counts, n_bins, table, min_leaf,
                                 histogram, bin_sizes)
            if gain > best:
                best, best_feature, best_bin = gain, pool[t], b
        if best_feature < 0:
            continue
        row = binned[best_feature]
        a, b = lo, 0
        for i in range(lo, hi):
            s = samples[i]
            if row[s] <= best_bin:
                samples[a] = s
                a += 1
            else:
                buffer[b] = s
                b += 1
        for i in range(b):
            samples[a + i] = buffer[i]
        feature[node], split[node], left[node] = best_feature, best_bin, used
        stack.append((used + 1, a, hi, depth + 1))
        stack.append((used, lo, a, depth + 1))
        used += 2
    return feature[:used], split[:used], left[:used]


@nb.njit(cache=True, nogil=True)
def walk_binned(binned, feature, split, left):
    """Return (n,) int32 leaf nodes of quantised samples, binned (F, n) uint8."""
    out = np.empty(binned.shape[1], np.int32)
    for i in range(binned.shape[1]):
        node = 0
        while feature[node] >= 0:
            node = left[node] + (1 if binned[feature[node], i] > split[node] else 0)
        out[i] = node
    return out
