# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Growing one decision tree on quantised features."""

from typing import NamedTuple

from hooc_perception.core.arrays import Int32Array, Int64Array, UInt8Array
from hooc_perception.training.kernels.splits import (
    best_split,
    Limits,
    look_at,
    part,
    Scratch,
    scratch,
)
import numba as nb
import numpy as np

# A large node must not end because its draw held nothing but noise: it draws so many times as
# many features until one splits it.
MORE_DRAWS = 4


class Table(NamedTuple):
    """
    Labelled samples.

    :ivar binned: (F, n) uint8 quantised features; y (n,) uint8 classes.
    :ivar n_classes, n_bins: numbers of classes and of quantisation levels.
    """

    binned: UInt8Array
    y: UInt8Array
    n_classes: int
    n_bins: int


@nb.njit(cache=True, nogil=True)
def _best_feature(table: Table, shown: Int32Array, n_try: int, least: int, least_gain: float,
                  pool: Int64Array, work: Scratch) -> tuple[int, int]:
    """
    Return (feature, bin) of the best split of a node among randomly drawn features.

    :param shown: (k,) int32 samples that rank the splits, their classes in `work`.
    :param n_try: features to draw; least: fewest of `shown` on either side.
    :param least_gain: gain in bits times k that the split must exceed, else (-1, -1).
    :param pool: (F,) permutation of the features, shuffled further.
    """
    n_features, k = table.binned.shape[0], shown.shape[0]
    best, best_feature, best_bin = least_gain, -1, -1
    for t in range(min(MORE_DRAWS * n_try, n_features)):
        if t >= n_try and best_feature >= 0:
            break
        j = t + np.random.randint(0, n_features - t)
        pool[t], pool[j] = pool[j], pool[t]
        row = table.binned[pool[t]]
        for i in range(k):
            work.values[i] = row[shown[i]]
        gain, b = best_split(work.values[:k], work.classes[:k], work.counts, table.n_bins,
                             work.log_table, least, work.histogram, work.bin_sizes)
        if gain > best:
            best, best_feature, best_bin = gain, pool[t], b
    return best_feature, best_bin


@nb.njit(cache=True, nogil=True)
def grow_tree(table: Table, samples: Int32Array, n_try: int, limits: Limits,
              seed: int) -> tuple[Int32Array, UInt8Array, Int32Array]:
    """
    Return (feature, bin, left) of one tree, nodes in depth-first order; feature -1 = leaf.

    :param samples: (m,) int32 columns of the table that grow this tree; reordered in place.
    :param n_try: features drawn at each node.
    """
    np.random.seed(seed)
    m, min_leaf = samples.shape[0], limits.min_leaf
    capacity = 2 * (m // max(min_leaf, 1)) + 3
    feature = np.full(capacity, -1, np.int32)
    split = np.zeros(capacity, np.uint8)
    left = np.zeros(capacity, np.int32)
    work = scratch(m, m, table.n_bins, table.n_classes)
    pool = np.arange(table.binned.shape[0])
    buffer = np.empty(m, np.int32)
    goes_left = np.empty(m, np.bool_)
    stack = [(0, 0, m, 0)]
    used = 1
    while len(stack):
        node, lo, hi, depth = stack.pop()
        n = hi - lo
        if depth >= limits.max_depth or n < 2 * min_leaf:
            continue
        k = look_at(samples, table.y, lo, hi, limits.node_samples, work.classes, work.counts)
        if work.counts.max() == k:
            continue
        best_feature, best_bin = _best_feature(
            table, samples[lo:lo + k], n_try, max(1, min_leaf * k // n), limits.min_gain * k,
            pool, work)
        if best_feature < 0:
            continue
        row = table.binned[best_feature]
        for i in range(lo, hi):
            goes_left[i - lo] = row[samples[i]] <= best_bin
        a = part(samples, goes_left, lo, hi, buffer)
        if used + 2 > capacity:
            continue
        feature[node], split[node], left[node] = best_feature, best_bin, used
        stack.append((used + 1, a, hi, depth + 1))
        stack.append((used, lo, a, depth + 1))
        used += 2
    return feature[:used], split[:used], left[:used]


@nb.njit(cache=True, nogil=True)
def walk_binned(binned: UInt8Array, feature: Int32Array, split: UInt8Array,
                left: Int32Array) -> Int32Array:
    """Return (n,) int32 leaf nodes of quantised samples, binned (F, n) uint8."""
    out = np.empty(binned.shape[1], np.int32)
    for i in range(binned.shape[1]):
        node = 0
        while feature[node] >= 0:
            node = left[node] + (1 if binned[feature[node], i] > split[node] else 0)
        out[i] = node
    return out
