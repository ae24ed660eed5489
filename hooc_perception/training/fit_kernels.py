# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Growing one decision tree on quantised features, by information gain."""

from hooc_perception.core.classification.kernels.pixel_forest import respond
import numba as nb
import numpy as np

# Below this many samples a pass over all cells of the histogram costs more than a sort.
SMALL_NODE = 500


@nb.njit(cache=True, nogil=True)
def x_log_x(n):
    """Return (n + 1,) float64 with k log2 k: entropies of counts become look-ups."""
    out = np.zeros(n + 1)
    for k in range(2, n + 1):
        out[k] = k * np.log2(k)
    return out


@nb.njit(cache=True, nogil=True)
def _best_split_small(values, y, node_counts, n_bins, table, min_leaf):
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
        gain = parent - (table[n_left] - inside_left) - (table[n_right] - inside_right)
        if gain > best:
            best, best_bin = gain, b
    return best, best_bin


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
        gain = parent - (table[n_left] - inside_left) - (table[n_right] - inside_right)
        if gain > best:
            best, best_bin = gain, b
    return best, best_bin


@nb.njit(cache=True, nogil=True)
def _shuffle_first(samples, lo, hi, k):
    """Bring a random subset of samples[lo:hi] to its first k places."""
    for i in range(k):
        j = i + np.random.randint(0, hi - lo - i)
        samples[lo + i], samples[lo + j] = samples[lo + j], samples[lo + i]


@nb.njit(cache=True, nogil=True)
def _look_at(samples, y, lo, hi, most, classes, counts):
    """
    Bring at most `most` random samples of a node to its first places; return how many.

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
def _part(samples, goes_left, lo, hi, buffer):
    """Bring the samples of a node that go left before the others; return where these begin."""
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


@nb.njit(cache=True, nogil=True)
def grow_tree(binned, y, samples, n_classes, n_bins, n_try, node_samples, max_depth, min_leaf,
              min_gain, seed):
    """
    Return (feature, bin, left) of one tree, nodes in depth-first order; feature -1 = leaf.

    :param binned: (F, n) uint8 quantised features; y (n,) uint8.
    :param samples: (m,) int32 columns of `binned` that grow this tree; reordered in place.
    :param n_try: features drawn at each node.
    :param node_samples: a random subset of this size ranks the features of a larger node.
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
    counts = np.zeros(n_classes, np.int64)
    buffer = np.empty(m, np.int32)
    goes_left = np.empty(m, np.bool_)
    stack = [(0, 0, m, 0)]
    used = 1
    while len(stack):
        node, lo, hi, depth = stack.pop()
        n = hi - lo
        if depth >= max_depth or n < 2 * min_leaf:
            continue
        k = _look_at(samples, y, lo, hi, node_samples, classes, counts)
        if counts.max() == k:
            continue
        least = max(1, min_leaf * k // n)
        best, best_feature, best_bin = min_gain * k, -1, -1
        for t in range(min(4 * n_try, n_features)):
            # A large node must not end because its draw held nothing but noise.
            if t >= n_try and best_feature >= 0:
                break
            j = t + np.random.randint(0, n_features - t)
            pool[t], pool[j] = pool[j], pool[t]
            row = binned[pool[t]]
            for i in range(k):
                values[i] = row[samples[lo + i]]
            gain, b = best_split(values[:k], classes[:k], counts, n_bins, table, least,
                                 histogram, bin_sizes)
            if gain > best:
                best, best_feature, best_bin = gain, pool[t], b
        if best_feature < 0:
            continue
        row = binned[best_feature]
        for i in range(lo, hi):
            goes_left[i - lo] = row[samples[i]] <= best_bin
        a = _part(samples, goes_left, lo, hi, buffer)
        if used + 2 > capacity:
            continue
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


@nb.njit(cache=True, nogil=True)
def _draw_tests(n, n_views, region, centre_share, view, offsets):
    """Fill the first n random tests: a view and two offsets (metres), or one and the centre."""
    for t in range(n):
        view[t] = np.random.randint(0, n_views)
        for k in range(4):
            offsets[t, k] = np.random.uniform(-region, region)
        if np.random.random() < centre_share:
            offsets[t, 2], offsets[t, 3] = 0.0, 0.0


@nb.njit(cache=True, nogil=True)
def grow_pixel_tree(images, scene, centre, y, samples, n_classes, n_tests, n_thresholds, region,
                    centre_share, node_samples, max_depth, min_leaf, min_gain, far, seed):
    """
    Return (feature, threshold, left, view, offsets) of one multi-view tree.

    Each node draws `n_tests` tests over all views and thresholds from their responses, on at
    most `node_samples` of its pixels, and keeps the split with the largest information gain.

    :param images: (S, V, H, W) uint16 mm; scene (n,), centre (n, V, 3), y (n,) of pixels.
    :param samples: (m,) int32 pixels that grow the tree; reordered in place.
    :return: as in `core.classification.pixel_forest.PixelForest`, one test an inner node.
    """
    np.random.seed(seed)
    m, n_views = samples.shape[0], images.shape[1]
    capacity = 2 * (m // max(min_leaf, 1)) + 3
    feature = np.full(capacity, -1, np.int32)
    threshold = np.zeros(capacity, np.float32)
    left = np.zeros(capacity, np.int32)
    test_view = np.zeros(capacity, np.uint8)
    test_offsets = np.zeros((capacity, 4), np.float32)
    n_tests_kept = 0
    table = x_log_x(max(m, 2))
    view = np.zeros(n_tests, np.uint8)
    offsets = np.zeros((n_tests, 4), np.float32)
    histogram = np.zeros((n_thresholds + 1, n_classes), np.int32)
    bin_sizes = np.zeros(n_thresholds + 1, np.int32)
    response = np.empty(node_samples, np.int32)
    values = np.empty(node_samples, np.uint8)
    classes = np.empty(node_samples, np.uint8)
    cuts = np.empty(n_thresholds, np.int32)
    counts = np.zeros(n_classes, np.int64)
    buffer = np.empty(m, np.int32)
    goes_left = np.empty(m, np.bool_)
    stack = [(0, 0, m, 0)]
    used = 1
    while len(stack):
        node, lo, hi, depth = stack.pop()
        n = hi - lo
        if depth >= max_depth or n < 2 * min_leaf:
            continue
        # A random subset of a large node suffices to rank tests; its cost is bounded.
        k = _look_at(samples, y, lo, hi, node_samples, classes, counts)
        if counts.max() == k:
            continue
        _draw_tests(n_tests, n_views, region, centre_share, view, offsets)
        least = max(1, min_leaf * k // n)
        best, best_test, best_cut = min_gain * k, -1, 0
        for t in range(n_tests):
            v = view[t]
            for i in range(k):
                s = samples[lo + i]
                response[i] = respond(images[scene[s], v], centre[s, v], offsets[t, 0],
                                      offsets[t, 1], offsets[t, 2], offsets[t, 3], far)
            for b in range(n_thresholds):
                cuts[b] = response[np.random.randint(0, k)]
            cuts.sort()
            for i in range(k):
                values[i] = np.searchsorted(cuts, response[i])
            gain, b = best_split(values[:k], classes[:k], counts, n_thresholds + 1, table, least,
                                 histogram, bin_sizes)
            if gain > best:
                best, best_test, best_cut = gain, t, cuts[b]
        if best_test < 0:
            continue
        v = view[best_test]
        for i in range(lo, hi):
            s = samples[i]
            goes_left[i - lo] = respond(
                images[scene[s], v], centre[s, v], offsets[best_test, 0], offsets[best_test, 1],
                offsets[best_test, 2], offsets[best_test, 3], far) <= best_cut
        a = _part(samples, goes_left, lo, hi, buffer)
        if a == lo or a == hi or used + 2 > capacity:
            continue
        feature[node], threshold[node], left[node] = n_tests_kept, best_cut, used
        test_view[n_tests_kept] = v
        test_offsets[n_tests_kept] = offsets[best_test]
        n_tests_kept += 1
        stack.append((used + 1, a, hi, depth + 1))
        stack.append((used, lo, a, depth + 1))
        used += 2
    return (feature[:used], threshold[:used], left[:used], test_view[:n_tests_kept],
            test_offsets[:n_tests_kept])
