# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Occupancy grids of meshes by winding, and sample bits of pairs of posed models."""

from hooc_perception.core.arrays import (
    BoolArray,
    Float64Array,
    Int16Array,
    Int32Array,
    Int64Array,
    UInt64Array,
)
import numba as nb
import numpy as np

# Rays pass beside the cells' centres by this share of a cell, so that they miss the vertices
# and edges that procedural meshes love to put on round coordinates.
OFF_CENTRE = (0.0137, 0.0093)


@nb.njit(cache=True)
def wind(vertices: Float64Array, faces: Int32Array, axis: int, cells: int,
         winding: Int16Array) -> None:
    """
    Count, signed, the crossings of the mesh by rays along one axis up to each cell's centre.

    :param vertices: (V, 3) float64 in cell units, the grid's corner at the origin.
    :param winding: (cells, cells, cells) int16, indexed x, y, z; start with 0.
    """
    ia, ib = (axis + 1) % 3, (axis + 2) % 3
    for f in range(faces.shape[0]):
        p, q, r = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        area = (q[ia] - p[ia]) * (r[ib] - p[ib]) - (q[ib] - p[ib]) * (r[ia] - p[ia])
        if area == 0.0:
            continue
        oa, ob = 0.5 + OFF_CENTRE[0], 0.5 + OFF_CENTRE[1]
        a_lo = max(0, int(np.ceil(min(p[ia], q[ia], r[ia]) - oa)))
        a_hi = min(cells - 1, int(np.floor(max(p[ia], q[ia], r[ia]) - oa)))
        b_lo = max(0, int(np.ceil(min(p[ib], q[ib], r[ib]) - ob)))
        b_hi = min(cells - 1, int(np.floor(max(p[ib], q[ib], r[ib]) - ob)))
        for a in range(a_lo, a_hi + 1):
            for b in range(b_lo, b_hi + 1):
                x, y = a + oa, b + ob
                wp = ((q[ia] - x) * (r[ib] - y) - (q[ib] - y) * (r[ia] - x)) / area
                wq = ((r[ia] - x) * (p[ib] - y) - (r[ib] - y) * (p[ia] - x)) / area
                wr = 1.0 - wp - wq
                if wp < 0.0 or wq < 0.0 or wr < 0.0:
                    continue
                height = wp * p[axis] + wq * q[axis] + wr * r[axis]
                turn = 1 if area > 0.0 else -1
                for c in range(max(0, int(np.ceil(height - 0.5))), cells):
                    if axis == 0:
                        winding[c, a, b] += turn
                    elif axis == 1:
                        winding[b, c, a] += turn
                    else:
                        winding[a, b, c] += turn


@nb.njit(cache=True)
def count_bits(word: np.uint64) -> np.int64:
    """Return the number of ones in a uint64 (Warren, Hacker's Delight, 5-1)."""
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    word = ((word & np.uint64(0x3333333333333333))
            + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333)))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@nb.njit(cache=True, parallel=True)
def sample_bits(pairs: Int32Array, model: Int32Array, R: Float64Array, t: Float64Array,
                size: Float64Array, samples: Float64Array, grids: BoolArray,
                bits: UInt64Array) -> None:
    """
    Set a bit for every interior sample of pairs[i, 0] that lies inside pairs[i, 1].

    v_k of Eq. 1 (Basevi & Leonardis 2016) is made of these bits, see core/energy/overlap.py.

    :param pairs: (m, 2) int32 objects.
    :param model: (n,) int32 row of each object in `samples` and `grids`.
    :param R: (n, 3, 3), t: (n, 3), model to world; size: (n, 3) metres along model axes.
    :param samples: (models, 64 * words, 3) float64, unit bounding box centred at the origin.
    :param grids: (models, cells, cells, cells) bool over the same box.
    :param bits: (m, words) uint64, written.
    """
    cells = grids.shape[1]
    for i in nb.prange(pairs.shape[0]):
        k, j = pairs[i, 0], pairs[i, 1]
        # One affine map takes samples of k to grid coordinates of j.
        A = np.empty((3, 3))
        b = np.empty(3)
        for row in range(3):
            scale = cells / size[j, row]
            for col in range(3):
                A[row, col] = scale * size[k, col] * (
                    R[j, 0, row] * R[k, 0, col] + R[j, 1, row] * R[k, 1, col]
                    + R[j, 2, row] * R[k, 2, col])
            b[row] = 0.5 * cells + scale * (
                R[j, 0, row] * (t[k, 0] - t[j, 0]) + R[j, 1, row] * (t[k, 1] - t[j, 1])
                + R[j, 2, row] * (t[k, 2] - t[j, 2]))
        grid, points = grids[model[j]], samples[model[k]]
        for word in range(bits.shape[1]):
            value = np.uint64(0)
            for s in range(64):
                p = points[64 * word + s]
                x = A[0, 0] * p[0] + A[0, 1] * p[1] + A[0, 2] * p[2] + b[0]
                if x < 0.0 or x >= cells:
                    continue
                y = A[1, 0] * p[0] + A[1, 1] * p[1] + A[1, 2] * p[2] + b[1]
                if y < 0.0 or y >= cells:
                    continue
                z = A[2, 0] * p[0] + A[2, 1] * p[1] + A[2, 2] * p[2] + b[2]
                if z < 0.0 or z >= cells:
                    continue
                if grid[int(x), int(y), int(z)]:
                    value |= np.uint64(1) << np.uint64(s)
            bits[i, word] = value


@nb.njit(cache=True)
def cover(k: int, start: Int64Array, other: Int32Array, bits: UInt64Array, active: BoolArray,
          union: UInt64Array, once: UInt64Array) -> None:
    """Set union[k] and once[k]: samples of k in any, and in exactly one, active neighbour."""
    for word in range(bits.shape[1]):
        any_bits, twice = np.uint64(0), np.uint64(0)
        for e in range(start[k], start[k + 1]):
            if active[other[e]]:
                twice |= any_bits & bits[e, word]
                any_bits |= bits[e, word]
        union[k, word] = any_bits
        once[k, word] = any_bits & ~twice


@nb.njit(cache=True)
def cover_all(start: Int64Array, other: Int32Array, bits: UInt64Array, active: BoolArray,
              union: UInt64Array, once: UInt64Array) -> int | np.int64:
    """Set union and once of all; return the samples of active ones that are covered."""
    total = 0
    for k in range(active.shape[0]):
        cover(k, start, other, bits, active, union, once)
        if active[k]:
            for word in range(bits.shape[1]):
                total += count_bits(union[k, word])
    return total


@nb.njit(cache=True)
def flip_delta(k: int, start: Int64Array, other: Int32Array, reverse: Int64Array,
               bits: UInt64Array, active: BoolArray, union: UInt64Array,
               once: UInt64Array) -> int | np.int64:
    """Return the change of the number of covered samples of active ones if k flips."""
    total = 0
    for word in range(bits.shape[1]):
        total += count_bits(union[k, word])
    for e in range(start[k], start[k + 1]):
        j = other[e]
        if active[j]:
            for word in range(bits.shape[1]):
                # Samples of j inside k that are covered by k alone, or would be.
                alone = once[j, word] if active[k] else ~union[j, word]
                total += count_bits(bits[reverse[e], word] & alone)
    return -total if active[k] else total


@nb.njit(cache=True)
def flip_deltas(start: Int64Array, other: Int32Array, reverse: Int64Array, bits: UInt64Array,
                active: BoolArray, union: UInt64Array, once: UInt64Array,
                deltas: Int64Array) -> None:
    """Set deltas (n,) int64, the flip_delta of every candidate."""
    for k in range(active.shape[0]):
        deltas[k] = flip_delta(k, start, other, reverse, bits, active, union, once)


@nb.njit(cache=True)
def flip(k: int, start: Int64Array, other: Int32Array, bits: UInt64Array, active: BoolArray,
         union: UInt64Array, once: UInt64Array) -> None:
    """Flip k and update union and once of its neighbours."""
    active[k] = not active[k]
    for e in range(start[k], start[k + 1]):
        cover(other[e], start, other, bits, active, union, once)


@nb.njit(cache=True)
def covered(members: Int64Array, chosen: BoolArray, start: Int64Array, other: Int32Array,
            bits: UInt64Array, counts: Int64Array) -> None:
    """Set counts (m,): samples of each of `members` inside any other with chosen (n,) True."""
    for i in range(members.shape[0]):
        k = members[i]
        total = 0
        for word in range(bits.shape[1]):
            value = np.uint64(0)
            for e in range(start[k], start[k + 1]):
                if chosen[other[e]]:
                    value |= bits[e, word]
            total += count_bits(value)
        counts[i] = total
