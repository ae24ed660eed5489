# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Runs of slots from the candidates' pixel lists, one run per pixel, and pixels of equal runs merged.

compositor.py says what a slot is, and what is done with the runs.
"""

from hooc_perception.core.arrays import AnyArray, Float32Array, Int32Array, Int64Array
from hooc_perception.core.energy.kernels.compositor import Lists, Runs
import numba as nb
import numpy as np


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
