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
such a merged one; compositor_layout.py lays out the runs. See core/energy/compositor.py for the
energy.

`Lists` and `Runs` are plain tuples, not NamedTuples: `add` and `remove` are called once per flip,
and numba takes 10 microseconds longer to recognise an argument that is a NamedTuple.
"""

from typing import TypeAlias

from hooc_perception.core.arrays import BoolArray, Float64Array, Int32Array, Int64Array
import numba as nb
import numpy as np

# Of the candidates: (offsets (n + 1,) int64, pixel (E,) int32, slot (E,) int32); entries
# offsets[k]:offsets[k + 1] belong to candidate k.
Lists: TypeAlias = tuple[Int64Array, Int32Array, Int32Array]
# Of the pixels: (owner (S,) int32, cost (S,) float64 of each slot, start (P + 1,) int32).
Runs: TypeAlias = tuple[Int32Array, Float64Array, Int32Array]


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
def _take_off(p: int, s: int, runs: Runs, active: BoolArray, first: Int32Array,
              second: Int32Array, deltas: Float64Array) -> int:
    """
    Bring `deltas` to where slot s of pixel p, the first or second active one, is off.

    :return: the slot that is the second active one then.
    """
    owner, slot_cost, start = runs
    t, u, end = first[p], second[p], start[p + 1] - 1
    v = u
    if u < end:
        v = u + 1
        while not active[owner[v]]:
            v += 1
    if s == u:
        deltas[owner[t]] += slot_cost[v] - slot_cost[u]
        return v
    old, new = slot_cost[t], slot_cost[u]
    for q in range(start[p], t):
        deltas[owner[q]] += old - new
    deltas[owner[t]] -= 2.0 * (new - old)
    for q in range(t + 1, u):
        deltas[owner[q]] += slot_cost[q] - new
    if u < end:
        deltas[owner[u]] += slot_cost[v] - new
    return v


@nb.njit(cache=True)
def remove(k: int, lists: Lists, runs: Runs, active: BoolArray, first: Int32Array,
           second: Int32Array, deltas: Float64Array) -> None:
    """Switch candidate k off and update first, second and the deltas of all that share pixels."""
    offsets, pixel, slot = lists
    active[k] = False
    for e in range(offsets[k], offsets[k + 1]):
        p, s = pixel[e], slot[e]
        t, u = first[p], second[p]
        if s != t and s != u:
            continue
        v = _take_off(p, s, runs, active, first, second, deltas)
        if s == t:
            first[p] = u
        second[p] = v


@nb.njit(cache=True, parallel=True)
def deltas_without(members: Int64Array, lists: Lists, runs: Runs, active: BoolArray,
                   first: Int32Array, second: Int32Array, deltas: Float64Array) -> Float64Array:
    """
    Return (m, n + 1) float64: for each of some active candidates, the deltas if it were off.

    What `remove` would make of `deltas`, without doing it; the rows are independent.

    :param members: (m,) int64.
    """
    offsets, pixel, slot = lists
    out = np.empty((members.shape[0], deltas.shape[0]))
    for i in nb.prange(members.shape[0]):
        k, row = members[i], out[i]
        row[:] = deltas
        for e in range(offsets[k], offsets[k + 1]):
            p, s = pixel[e], slot[e]
            if s == first[p] or s == second[p]:
                _take_off(p, s, runs, active, first, second, row)
    return out


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
