# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How the volumes that chosen objects cover change with each flip, from the bits of overlap.py."""

from hooc_perception.core.arrays import BoolArray, Int64Array, UInt64Array
import numba as nb
import numpy as np


@nb.njit(cache=True)
def count_bits(word: np.uint64) -> np.int64:
    """Return the number of ones in a uint64 (Warren, Hacker's Delight, 5-1)."""
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    word = ((word & np.uint64(0x3333333333333333))
            + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333)))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@nb.njit(cache=True)
def cover(k: int, rows: Int64Array, meets: BoolArray, around: UInt64Array, union: UInt64Array,
          once: UInt64Array) -> None:
    """Set union[k] and once[k]: samples of k in any, and in exactly one, chosen object."""
    for word in range(union.shape[1]):
        any_bits, twice = np.uint64(0), np.uint64(0)
        for i in rows:
            if meets[i, k]:
                twice |= any_bits & around[i, k, word]
                any_bits |= around[i, k, word]
        union[k, word] = any_bits
        once[k, word] = any_bits & ~twice


@nb.njit(cache=True)
def flip_delta(k: int, chosen: Int64Array, rows: Int64Array, active: BoolArray,
               meets: BoolArray, inside: UInt64Array, union: UInt64Array, once: UInt64Array,
               ) -> int | np.int64:
    """
    Return the change of the number of covered samples of chosen objects if k flips.

    :param inside: seen from k's side, [i, k]: samples of chosen[i] inside k.
    """
    total = 0
    for word in range(union.shape[1]):
        total += count_bits(union[k, word])
    for c in range(chosen.shape[0]):
        i, j = rows[c], chosen[c]
        if meets[i, k]:
            for word in range(union.shape[1]):
                # Samples of j inside k that are covered by k alone, or would be.
                alone = once[j, word] if active[k] else ~union[j, word]
                total += count_bits(inside[i, k, word] & alone)
    return -total if active[k] else total


@nb.njit(cache=True)
def restart(chosen: Int64Array, rows: Int64Array, active: BoolArray, meets: BoolArray,
            inside: UInt64Array, around: UInt64Array, union: UInt64Array, once: UInt64Array,
            deltas: Int64Array) -> int | np.int64:
    """
    Set union, once and deltas of all; return the samples of chosen objects that are covered.

    :param chosen: (s,) int64 objects of the subset; `rows` (s,) their rows in meets, inside and
        around; `active` (n,) bool, the same subset.
    :param deltas: (n,) int64, the flip_delta of each object.
    """
    total = 0
    for k in range(active.shape[0]):
        cover(k, rows, meets, around, union, once)
        if active[k]:
            for word in range(union.shape[1]):
                total += count_bits(union[k, word])
    for k in range(active.shape[0]):
        deltas[k] = flip_delta(k, chosen, rows, active, meets, inside, union, once)
    return total


@nb.njit(cache=True)
def _stale(flipped: int, row: int, chosen: Int64Array, rows: Int64Array,
           meets: BoolArray) -> BoolArray:
    """Return (n,) bool: whose delta may change with a flip: it looks at chosen neighbours, too."""
    stale = meets[row].copy()
    stale[flipped] = True
    for c in range(chosen.shape[0]):
        if meets[row, chosen[c]]:
            stale |= meets[rows[c]]
    return stale


@nb.njit(cache=True)
def update(flipped: int, row: int, chosen: Int64Array, rows: Int64Array, active: BoolArray,
           meets: BoolArray, inside: UInt64Array, around: UInt64Array, union: UInt64Array,
           once: UInt64Array, deltas: Int64Array) -> None:
    """
    Bring union, once and deltas up to date after one object has joined or left the subset.

    :param row: of the flipped object in meets, inside and around.
    """
    n = active.shape[0]
    for k in range(n):
        if meets[row, k]:
            cover(k, rows, meets, around, union, once)
    stale = _stale(flipped, row, chosen, rows, meets)
    for k in range(n):
        if stale[k]:
            deltas[k] = flip_delta(k, chosen, rows, active, meets, inside, union, once)


@nb.njit(cache=True, parallel=True)
def deltas_without(members: Int64Array, member_rows: Int64Array, chosen: Int64Array,
                   rows: Int64Array, active: BoolArray, meets: BoolArray, inside: UInt64Array,
                   around: UInt64Array, union: UInt64Array, deltas: Int64Array) -> Int64Array:
    """
    Return (m, n) int64: for each of some chosen objects, the deltas of the others without it.

    What `update` would make of the deltas of the objects that are not chosen, without doing it.

    :param members: (m,) int64 chosen objects; `member_rows` (m,) their rows in meets, inside
        and around.
    """
    n = active.shape[0]
    out = np.empty((members.shape[0], n), np.int64)
    for i in nb.prange(members.shape[0]):
        gone = member_rows[i]
        stay = rows != gone
        others, their_rows = chosen[stay], rows[stay]
        left, once = union.copy(), np.empty_like(union)
        for k in range(n):
            if meets[gone, k]:
                cover(k, their_rows, meets, around, left, once)
        stale = _stale(members[i], gone, others, their_rows, meets)
        for k in range(n):
            out[i, k] = deltas[k]
            # What is not chosen has no need of `once`.
            if stale[k] and not active[k]:
                out[i, k] = flip_delta(k, others, their_rows, active, meets, inside, left, once)
    return out


@nb.njit(cache=True)
def covered(members: Int64Array, rows: Int64Array, meets: BoolArray, around: UInt64Array,
            counts: Int64Array) -> None:
    """Set counts (m,): samples of each of `members` (m,) inside any other, with their `rows`."""
    for i in range(members.shape[0]):
        k = members[i]
        total = 0
        for word in range(around.shape[2]):
            value = np.uint64(0)
            for row in rows:
                if meets[row, k]:
                    value |= around[row, k, word]
            total += count_bits(value)
        counts[i] = total
