# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Nearest-wins compositing of candidate pixel lists, with the cost of every possible flip.

Each pixel owns a run of *slots*: the candidates that cover it, nearest first, and a last slot
for "no candidate". `owner[slot]` is the candidate, n for the last slot; `active` has n + 1
entries, of which the last is always true, so that a scan down a run always ends. `first` and
`second` hold, per pixel, the slots of the two nearest active owners (`second` is meaningless
where `first` is the last slot). Pixels with the same owners in the same order always show the
same candidate, so they are merged into one with the sum of their costs; below, a pixel is
such a merged one except in `build` and `merge`. See core/energy/compositor.py for the energy.

`Lists` and `Runs` are plain tuples, not NamedTuples: `add` and `remove` are called once per flip,
and numba takes 10 microseconds longer to recognise an argument that is a NamedTuple.
"""

from typing import TypeAlias

from hooc_perception.core.arrays import (
    AnyArray,
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
)
import numba as nb
import numpy as np

# Of the candidates: (offsets (n + 1,) int64, pixel (E,) int32, slot (E,) int32); entries
# offsets[k]:offsets[k + 1] belong to candidate k.
Lists: TypeAlias = tuple[Int64Array, Int32Array, Int32Array]
# Of the pixels: (owner (S,) int32, cost (S,) float64 of each slot, start (P + 1,) int32).
Runs: TypeAlias = tuple[Int32Array, Float64Array, Int32Array]


@nb.njit(cache=True, parallel=True)
def build(offsets: Int64Array, pixel: Int32Array, depth: Float32Array, cost: Float32Array,
          cost_none: Float32Array, blocks: int,
          ) -> tuple[Int32Array, Float32Array, Int32Array, Int32Array]:
    """
    Sort the candidates' entries into runs of slots, one run per pixel, nearest first.

    :param offsets: (n + 1,) int64, entries offsets[k]:offsets[k + 1] belong to candidate k.
    :param pixel: (E,) int32 index into cost_none; a candidate names a pixel at most once.
    :param depth: (E,) float32; equal depths keep the candidates' order.
    :param cost: (E,) float32.
    :param cost_none: (P,) float32.
    :param blocks: number of threads; it does not change the result.
    :return: owner (E + P,) int32, slot_cost (E + P,) float32, start (P + 1,) int32 of each
        pixel's run, entry (E + P,) int32 of each slot, -1 for none.
    """
    n, n_pixels, n_entries = offsets.shape[0] - 1, cost_none.shape[0], pixel.shape[0]
    start = np.zeros(n_pixels + 1, np.int32)
    for e in range(n_entries):
        start[pixel[e] + 1] += 1
    for p in range(n_pixels):
        start[p + 1] += start[p] + 1
    owner = np.full(n_entries + n_pixels, n, np.int32)
    slot_cost = np.empty(n_entries + n_pixels, np.float32)
    entry = np.full(n_entries + n_pixels, -1, np.int32)
    filled = np.zeros(n_pixels, np.int32)
    for p in range(n_pixels):
        slot_cost[start[p + 1] - 1] = cost_none[p]
    # Each block of pixels is filled by one thread, which looks at all entries in their order.
    for block in nb.prange(blocks):
        low, high = block * n_pixels // blocks, (block + 1) * n_pixels // blocks
        for k in range(n):
            for e in range(offsets[k], offsets[k + 1]):
                p = pixel[e]
                if p < low or p >= high:
                    continue
                s = start[p] + filled[p]
                filled[p] += 1
                while s > start[p] and depth[entry[s - 1]] > depth[e]:
                    entry[s] = entry[s - 1]
                    owner[s] = owner[s - 1]
                    s -= 1
                entry[s] = e
                owner[s] = k
        for p in range(low, high):
            for s in range(start[p], start[p + 1] - 1):
                slot_cost[s] = cost[entry[s]]
    return owner, slot_cost, start, entry


@nb.njit(cache=True)
def fingerprints(start: Int32Array, owner: Int32Array) -> AnyArray:
    """Return (P,) uint64, equal for runs of equal owners (hashed in the manner of FNV-1a)."""
    out = np.empty(start.shape[0] - 1, np.uint64)
    for p in range(out.shape[0]):
        h = np.uint64(14695981039346656037)
        for s in range(start[p], start[p + 1]):
            h = (h ^ np.uint64(owner[s] + 1)) * np.uint64(1099511628211)
            h ^= h >> np.uint64(29)
        out[p] = h
    return out


@nb.njit(cache=True)
def merge(start: Int32Array, owner: Int32Array, cost: Float32Array, n: int, kind: Int64Array,
          example: Int64Array) -> tuple[bool, Lists, Runs]:
    """
    Merge pixels of one kind.

    :param kind: (P,) int64 merged pixel of each pixel; `example` (C,) int64, one of each kind.
    :return: whether the pixels of every kind have equal runs; the merged Lists and Runs.
    """
    n_kinds = example.shape[0]
    new_start = np.zeros(n_kinds + 1, np.int32)
    for c in range(n_kinds):
        new_start[c + 1] = new_start[c] + start[example[c] + 1] - start[example[c]]
    new_owner = np.empty(new_start[n_kinds], np.int32)
    new_cost = np.zeros(new_start[n_kinds])
    offsets = np.zeros(n + 2, np.int64)
    for c in range(n_kinds):
        for i in range(new_start[c + 1] - new_start[c]):
            k = owner[start[example[c]] + i]
            new_owner[new_start[c] + i] = k
            offsets[k + 1] += 1
    for k in range(n):
        offsets[k + 1] += offsets[k]
    pixel, slot = np.empty(offsets[n], np.int32), np.empty(offsets[n], np.int32)
    filled = offsets[:n].copy()
    for c in range(n_kinds):
        for s in range(new_start[c], new_start[c + 1] - 1):
            k = new_owner[s]
            pixel[filled[k]], slot[filled[k]] = c, s
            filled[k] += 1
    same = True
    for p in range(kind.shape[0]):
        to = new_start[kind[p]]
        same &= start[p + 1] - start[p] == new_start[kind[p] + 1] - to
        if not same:
            break
        for i in range(start[p + 1] - start[p]):
            same &= owner[start[p] + i] == new_owner[to + i]
            new_cost[to + i] += cost[start[p] + i]
    return same, (offsets[:n + 1], pixel, slot), (new_owner, new_cost, new_start)


@nb.njit(cache=True)
def restart(active: BoolArray, runs: Runs, first: Int32Array, second: Int32Array,
            deltas: Float64Array) -> float:
    """
    Set first, second and deltas for the given `active`; return the sum of the shown costs.

    :param deltas: (n + 1,) float64, overwritten: change of the pixel costs if k flips.
    """
    owner, slot_cost, start = runs
    deltas[:] = 0.0
    total = 0.0
    for p in range(start.shape[0] - 1):
        t = start[p]
        while not active[owner[t]]:
            t += 1
        first[p] = t
        total += float(slot_cost[t])
        for s in range(start[p], t):
            deltas[owner[s]] += slot_cost[s] - slot_cost[t]
        second[p] = t
        if t < start[p + 1] - 1:
            u = t + 1
            while not active[owner[u]]:
                u += 1
            second[p] = u
            deltas[owner[t]] += slot_cost[u] - slot_cost[t]
    return total


@nb.njit(cache=True)
def add(k: int, lists: Lists, runs: Runs, active: BoolArray, first: Int32Array,
        second: Int32Array, deltas: Float64Array) -> None:
    """Switch candidate k on and update first, second and the deltas of all that share pixels."""
    (offsets, pixel, slot), (owner, slot_cost, start) = lists, runs
    active[k] = True
    for e in range(offsets[k], offsets[k + 1]):
        p, s = pixel[e], slot[e]
        t = first[p]
        if s < t:
            # k hides t: whatever lies in front of k is now compared with k, the slots between
            # k and t are hidden, t itself can go without a change, k can be taken away.
            new, old = slot_cost[s], slot_cost[t]
            for q in range(start[p], s):
                deltas[owner[q]] += old - new
            deltas[k] += 2.0 * (old - new)
            for q in range(s + 1, t):
                deltas[owner[q]] -= slot_cost[q] - old
            if t < start[p + 1] - 1:
                deltas[owner[t]] -= slot_cost[second[p]] - old
            first[p] = s
            second[p] = t
        else:
            u = second[p]
            if s < u:
                deltas[owner[t]] += slot_cost[s] - slot_cost[u]
                second[p] = s


@nb.njit(cache=True)
def remove(k: int, lists: Lists, runs: Runs, active: BoolArray, first: Int32Array,
           second: Int32Array, deltas: Float64Array) -> None:
    """Switch candidate k off and update first, second and the deltas of all that share pixels."""
    (offsets, pixel, slot), (owner, slot_cost, start) = lists, runs
    active[k] = False
    for e in range(offsets[k], offsets[k + 1]):
        p, s = pixel[e], slot[e]
        t = first[p]
        if s < t or s > second[p]:
            continue
        end = start[p + 1] - 1
        u = second[p]
        v = u
        if u < end:
            v = u + 1
            while not active[owner[v]]:
                v += 1
        if s == t:
            old, new = slot_cost[t], slot_cost[u]
            for q in range(start[p], t):
                deltas[owner[q]] += old - new
            deltas[k] -= 2.0 * (new - old)
            for q in range(t + 1, u):
                deltas[owner[q]] += slot_cost[q] - new
            if u < end:
                deltas[owner[u]] += slot_cost[v] - new
            first[p] = u
            second[p] = v
        elif s == u:
            deltas[owner[t]] += slot_cost[v] - slot_cost[u]
            second[p] = v


@nb.njit(cache=True)
def evaluate(members: Int64Array, lists: Lists, runs: Runs, nearest: Int32Array) -> float:
    """
    Return the sum of the shown costs of the subset `members` (m,) int, from scratch.

    :param nearest: (P,) int32 work space; afterwards the slot shown at each pixel.
    """
    (offsets, pixel, slot), (_, slot_cost, start) = lists, runs
    n_pixels = nearest.shape[0]
    for p in range(n_pixels):
        nearest[p] = start[p + 1] - 1
    for k in members:
        for e in range(offsets[k], offsets[k + 1]):
            p = pixel[e]
            if slot[e] < nearest[p]:
                nearest[p] = slot[e]
    total = 0.0
    for p in range(n_pixels):
        total += float(slot_cost[nearest[p]])
    return total
