# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Splits of the nodes of a decision tree by information gain."""

from typing import NamedTuple

from hooc_perception.core.arrays import (
    BoolArray,
    Float64Array,
    Int32Array,
    Int64Array,
    UInt8Array,
)
import numba as nb
import numpy as np

# Below this many samples a pass over all cells of the histogram costs more than a sort.
SMALL_NODE = 500


class Limits(NamedTuple):
    """
    When a node is split, and on how many samples its split is chosen.

    :ivar node_samples: a random subset of this size ranks the splits of a larger node; its cost
        is bounded.
    :ivar max_depth: deepest split.
    :ivar min_leaf: fewest training samples in a leaf.
    :ivar min_gain: least information gain of a split, bits.
    """

    node_samples: int
    max_depth: int
    min_leaf: int
    min_gain: float


class Scratch(NamedTuple):
    """
    Work space of the growth of one tree.

    :ivar log_table: k log2 k for k up to the number of samples.
    :ivar histogram: (n_bins, C) int32; bin_sizes (n_bins,) int32.
    :ivar values, classes: (k,) uint8 of the samples that rank the splits of a node.
    :ivar counts: (C,) int64 of these classes.
    """

    log_table: Float64Array
    histogram: Int32Array
    bin_sizes: Int32Array
    values: UInt8Array
    classes: UInt8Array
    counts: Int64Array


@nb.njit(cache=True, nogil=True)
def x_log_x(n: int) -> Float64Array:
    """Return (n + 1,) float64 with k log2 k: entropies of counts become look-ups."""
    out = np.zeros(n + 1)
    for k in range(2, n + 1):
        out[k] = k * np.log2(k)
    return out


@nb.njit(cache=True, nogil=True)
def scratch(samples: int, ranked: int, n_bins: int, n_classes: int) -> Scratch:
    """Return work space for a tree of so many samples, of which `ranked` rank a split."""
    return Scratch(x_log_x(samples), np.zeros((n_bins, n_classes), np.int32),
                   np.zeros(n_bins, np.int32), np.empty(ranked, np.uint8),
                   np.empty(ranked, np.uint8), np.zeros(n_classes, np.int64))


@nb.njit(cache=True, nogil=True)
def _best_split_small(values: UInt8Array, y: UInt8Array, node_counts: Int64Array, n_bins: int,
                      table: Float64Array, min_leaf: int) -> tuple[float, int]:
    """Return `best_split` of a small node, by moving samples over one at a time."""
    n, n_classes = values.shape[0], node_counts.shape[0]
    start = np.zeros(n_bins + 1, np.int32)
    for i in range(n):
        start[values[i] + 1] += 1
    for b in range(n_bins):
        start[b + 1] += start[b]
    fill = start.copy()
    ordered = np.empty(n, np.uint8)
    for i in range(n):
        ordered[fill[values[i]]] = y[i]
        fill[values[i]] += 1
    parent, inside_right = table[n], 0.0
    for c in range(n_classes):
        parent -= table[node_counts[c]]
        inside_right += table[node_counts[c]]
    left = np.zeros(n_classes, np.int64)
    inside_left = 0.0
    best, best_bin = -1.0, -1
    for b in range(n_bins - 1):
        if start[b + 1] == start[b]:
            continue
        for i in range(start[b], start[b + 1]):
            c = ordered[i]
            k = left[c]
            inside_left += table[k + 1] - table[k]
            inside_right += table[node_counts[c] - k - 1] - table[node_counts[c] - k]
            left[c] = k + 1
        n_left = start[b + 1]
        n_right = n - n_left
        if n_right < min_leaf:
            break
        if n_left < min_leaf:
            continue
        gain = float(parent - (table[n_left] - inside_left) - (table[n_right] - inside_right))
        if gain > best:
            best, best_bin = gain, b
    return best, best_bin


@nb.njit(cache=True, nogil=True)
def best_split(values: UInt8Array, y: UInt8Array, node_counts: Int64Array, n_bins: int,
               table: Float64Array, min_leaf: int, histogram: Int32Array,
               bin_sizes: Int32Array) -> tuple[float, int]:
    """
    Return (gain, bin): the split `value <= bin` with the largest information gain.

    :param values: (n,) uint8 quantised feature; y (n,) uint8 classes.
    :param node_counts: (C,) int64 classes of all samples in the node.
    :param table: k log2 k for k up to n at least.
    :param histogram: (n_bins, C) int32 scratch; bin_sizes (n_bins,) int32 scratch.
    :return: gain in bits times n, -1.0 if no split leaves `min_leaf` samples on each side.
    """
    n, n_classes = values.shape[0], node_counts.shape[0]
    if n < SMALL_NODE:
        return _best_split_small(values, y, node_counts, n_bins, table, min_leaf)
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
        gain = float(parent - (table[n_left] - inside_left) - (table[n_right] - inside_right))
        if gain > best:
            best, best_bin = gain, b
    return best, best_bin


@nb.njit(cache=True, nogil=True)
def _shuffle_first(samples: Int32Array, lo: int, hi: int, k: int) -> None:
    """Move a random subset of samples[lo:hi] to its first k places."""
    for i in range(k):
        j = i + np.random.randint(0, hi - lo - i)
        samples[lo + i], samples[lo + j] = samples[lo + j], samples[lo + i]


@nb.njit(cache=True, nogil=True)
def look_at(samples: Int32Array, y: UInt8Array, lo: int, hi: int, most: int,
            classes: UInt8Array, counts: Int64Array) -> int:
    """
    Move at most `most` random samples of a node to its first places; return how many.

    :param classes: (m,) uint8 and `counts` (C,) int64, filled with their classes.
    """
    k = min(hi - lo, most)
    if k < hi - lo:
        _shuffle_first(samples, lo, hi, k)
    counts[:] = 0
    for i in range(k):
        classes[i] = y[samples[lo + i]]
        counts[classes[i]] += 1
    return k


@nb.njit(cache=True, nogil=True)
def part(samples: Int32Array, goes_left: BoolArray, lo: int, hi: int, buffer: Int32Array) -> int:
    """Move the samples of a node that go left before the others; return where these begin."""
    a, b = lo, 0
    for i in range(lo, hi):
        if goes_left[i - lo]:
            samples[a] = samples[i]
            a += 1
        else:
            buffer[b] = samples[i]
            b += 1
    for i in range(b):
        samples[a + i] = buffer[i]
    return a
