# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Growing one tree of the paper's multi-view forest.

Basevi & Leonardis 2016, section 4, after Brachmann et al. 2014.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import BoolArray, Float32Array, Int32Array, UInt8Array
from hooc_perception.core.classification.kernels.pixel_forest import (
    DepthTests,
    respond,
    Samples,
)
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


class DrawRules(NamedTuple):
    """
    How the tests of a node are drawn.

    :ivar tests: random tests over all views; thresholds: cuts tried per test, drawn from its
        responses.
    :ivar region: half the side of the bounding region, metres.
    :ivar centre_share: share of tests against the centre instead of a second offset.
    :ivar far: depth in mm outside of the image.
    """

    tests: int
    thresholds: int
    region: float
    centre_share: float
    far: int


@nb.njit(cache=True, nogil=True)
def _draw_tests(n_views: int, rules: DrawRules, view: UInt8Array,
                offsets: Float32Array) -> None:
    """Fill random tests: a view and two offsets (metres), or one offset and the centre."""
    for t in range(rules.tests):
        view[t] = np.random.randint(0, n_views)
        for k in range(4):
            offsets[t, k] = np.random.uniform(-rules.region, rules.region)
        if np.random.random() < rules.centre_share:
            offsets[t, 2], offsets[t, 3] = 0.0, 0.0


@nb.njit(cache=True, nogil=True)
def _best_test(pixels: Samples, shown: Int32Array, tests: DepthTests, n_thresholds: int,
               least: int, least_gain: float, work: Scratch) -> tuple[int, int]:
    """
    Return (test, threshold in mm) of the best split of a node, (-1, 0) where none gains enough.

    :param shown: (k,) int32 pixels that rank the tests, their classes in `work`.
    :param least: fewest of `shown` on either side; least_gain: bits times k to exceed.
    """
    k = shown.shape[0]
    response, cuts = np.empty(k, np.int32), np.empty(n_thresholds, np.int32)
    best, best_test, best_cut = least_gain, -1, 0
    for t in range(tests.in_view.shape[0]):
        v = tests.in_view[t]
        for i in range(k):
            s = shown[i]
            response[i] = respond(pixels.images[pixels.scene[s], v], pixels.centre[s, v],
                                  tests.offsets[t], tests.far)
        for b in range(n_thresholds):
            cuts[b] = response[np.random.randint(0, k)]
        cuts.sort()
        for i in range(k):
            work.values[i] = np.searchsorted(cuts, response[i])
        gain, b = best_split(work.values[:k], work.classes[:k], work.counts, n_thresholds + 1,
                             work.log_table, least, work.histogram, work.bin_sizes)
        if gain > best:
            best, best_test, best_cut = gain, t, cuts[b]
    return best_test, best_cut


@nb.njit(cache=True, nogil=True)
def _passes(pixels: Samples, samples: Int32Array, view: int, offsets: Float32Array, far: int,
            cut: int) -> BoolArray:
    """Return (m,) bool, which of the pixels `samples` respond to a test by at most `cut` mm."""
    out = np.empty(samples.shape[0], np.bool_)
    for i in range(samples.shape[0]):
        s = samples[i]
        out[i] = respond(pixels.images[pixels.scene[s], view], pixels.centre[s, view], offsets,
                         far) <= cut
    return out


@nb.njit(cache=True, nogil=True)
def grow_pixel_tree(pixels: Samples, y: UInt8Array, samples: Int32Array, n_classes: int,
                    rules: DrawRules, limits: Limits, seed: int,
                    ) -> tuple[Int32Array, Float32Array, Int32Array, UInt8Array, Float32Array]:
    """
    Return (feature, threshold, left, view, offsets) of one multi-view tree.

    Each node draws tests over all views and thresholds from their responses, on at most
    `limits.node_samples` of its pixels, and keeps the split with the largest information gain.

    :param y: (n,) uint8 classes of the pixels.
    :param samples: (m,) int32 pixels that grow the tree; reordered in place.
    :return: as in `core.classification.pixel_forest.PixelForest`, one test per inner node.
    """
    np.random.seed(seed)
    m, min_leaf = samples.shape[0], limits.min_leaf
    capacity = 2 * (m // max(min_leaf, 1)) + 3
    feature = np.full(capacity, -1, np.int32)
    threshold = np.zeros(capacity, np.float32)
    left = np.zeros(capacity, np.int32)
    test_view = np.zeros(capacity, np.uint8)
    test_offsets = np.zeros((capacity, 4), np.float32)
    kept = 0
    drawn = DepthTests(np.zeros(rules.tests, np.uint8), np.zeros((rules.tests, 4), np.float32),
                       rules.far)
    work = scratch(max(m, 2), limits.node_samples, rules.thresholds + 1, n_classes)
    buffer = np.empty(m, np.int32)
    stack = [(0, 0, m, 0)]
    used = 1
    while len(stack):
        node, lo, hi, depth = stack.pop()
        n = hi - lo
        if depth >= limits.max_depth or n < 2 * min_leaf:
            continue
        k = look_at(samples, y, lo, hi, limits.node_samples, work.classes, work.counts)
        if work.counts.max() == k:
            continue
        _draw_tests(pixels.images.shape[1], rules, drawn.in_view, drawn.offsets)
        t, cut = _best_test(pixels, samples[lo:lo + k], drawn, rules.thresholds,
                            max(1, min_leaf * k // n), limits.min_gain * k, work)
        if t < 0:
            continue
        view, offsets = drawn.in_view[t], drawn.offsets[t]
        a = part(samples, _passes(pixels, samples[lo:hi], view, offsets, rules.far, cut), lo,
                 hi, buffer)
        if a == lo or a == hi or used + 2 > capacity:
            continue
        feature[node], threshold[node], left[node] = kept, cut, used
        test_view[kept] = view
        test_offsets[kept] = offsets
        kept += 1
        stack.append((used + 1, a, hi, depth + 1))
        stack.append((used, lo, a, depth + 1))
        used += 2
    return feature[:used], threshold[:used], left[:used], test_view[:kept], test_offsets[:kept]
