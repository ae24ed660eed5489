# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Occupancy grids of meshes by winding, and sample bits of pairs of posed models."""

from typing import NamedTuple

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


class Poses(NamedTuple):
    """
    Where n objects lie.

    :ivar R: (n, 3, 3), t: (n, 3), model to world; size: (n, 3) metres along the model's axes.
    :ivar half: (n, 3) half of the box around it along the world's axes; radius: (n,) of the
        sphere around it, metres.
    :ivar model: (n,) int32 row of Solids.
    """

    R: Float64Array
    t: Float64Array
    size: Float64Array
    half: Float64Array
    radius: Float64Array
    model: Int32Array


class Solids(NamedTuple):
    """
    Interiors of models, in the unit bounding box centred at the origin.

    :ivar samples: (models, 64 * words, 3) float64.
    :ivar grids: (models, cells, cells, cells) bool.
    """

    samples: Float64Array
    grids: BoolArray


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


@nb.njit(cache=True, inline='always')
def _maps(k: int, j: int, poses: Poses, cells: int, A: Float64Array, b: Float64Array) -> None:
    """Write the affine map A (3, 3), b (3,) from samples of k to grid coordinates of j."""
    R, t, size = poses.R, poses.t, poses.size
    for row in range(3):
        scale = cells / size[j, row]
        for col in range(3):
            A[row, col] = scale * size[k, col] * (
                R[j, 0, row] * R[k, 0, col] + R[j, 1, row] * R[k, 1, col]
                + R[j, 2, row] * R[k, 2, col])
        b[row] = 0.5 * cells + scale * (
            R[j, 0, row] * (t[k, 0] - t[j, 0]) + R[j, 1, row] * (t[k, 1] - t[j, 1])
            + R[j, 2, row] * (t[k, 2] - t[j, 2]))


@nb.njit(cache=True)
def _sample_bits(k: int, j: int, poses: Poses, solids: Solids, A: Float64Array, b: Float64Array,
                 bits: UInt64Array) -> bool:
    """Set a bit of `bits` (words,) per sample of k inside j; return whether there is any."""
    cells = solids.grids.shape[1]
    _maps(k, j, poses, cells, A, b)
    grid, points = solids.grids[poses.model[j]], solids.samples[poses.model[k]]
    found = False
    for word in range(bits.shape[0]):
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
        bits[word] = value
        found |= value != 0
    return found


@nb.njit(cache=True, inline='always')
def _apart(k: int, j: int, poses: Poses) -> bool:
    """Return whether the spheres or the boxes around two objects do not meet."""
    squared = 0.0
    for axis in range(3):
        d = abs(poses.t[k, axis] - poses.t[j, axis])
        if d >= poses.half[k, axis] + poses.half[j, axis]:
            return True
        squared += d * d
    reach = poses.radius[k] + poses.radius[j]
    return squared >= reach * reach


@nb.njit(cache=True, parallel=True)
def compare(objects: Int64Array, poses: Poses, solids: Solids, meets: BoolArray,
            inside: UInt64Array, around: UInt64Array) -> None:
    """
    Compare each of some objects with all n.

    v_k of Eq. 1 (Basevi & Leonardis 2016) is made of these bits, see core/energy/overlap.py.

    :param objects: (m,) int64.
    :param meets: (m, n) bool, written: whether the two have a common volume.
    :param inside: (m, n, words) uint64, written: samples of objects[i] inside each other one.
    :param around: (m, n, words) uint64, written: samples of each other one inside objects[i].
    """
    n = poses.model.shape[0]
    for i in nb.prange(objects.shape[0]):
        k = objects[i]
        A, b = np.empty((3, 3)), np.empty(3)
        for j in range(n):
            meets[i, j] = False
            if j == k or _apart(k, j, poses):
                continue
            first = _sample_bits(k, j, poses, solids, A, b, inside[i, j])
            second = _sample_bits(j, k, poses, solids, A, b, around[i, j])
            meets[i, j] = first or second
