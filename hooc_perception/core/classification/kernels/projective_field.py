# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Projective distance field of all views, which the features of the fused forest probe.

A cell holds one signed number: how far behind it, along the optical axis, the best view has
measured. The other fused field, `core.frame.kernels.field`, holds Euclidean distance to the
nearest seen surface, its normal and the evidence for free space; poses are refined against it.
This one is cheaper (one projection per cell and view), tells free from hidden everywhere, and is
what trained forests have been trained on; it has no gradient that a pose could follow.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import Float32Array, Float64Array, Int8Array, Int64Array
import numba as nb
import numpy as np

FIELD_UNIT_M = 0.0005
FIELD_LIMIT = 120
UNKNOWN = -FIELD_LIMIT - 1
NEAR_M = 0.05


class ProjectiveField(NamedTuple):
    """
    The field of a scene.

    :ivar values: (nx, ny, nz) int8 in FIELD_UNIT_M: the largest `measured depth - cell depth`
        over the views that have a reading there. Positive = some view looks through it (free),
        about zero = on a surface, negative = hidden in every view; UNKNOWN = no view knows.
    :ivar origin: (3,) float64 centre of cell (0, 0, 0), metres, world.
    :ivar cell: side of a cell, metres.
    """

    values: Int8Array
    origin: Float64Array
    cell: float


class DepthImages(NamedTuple):
    """
    Rectified views of one scene.

    :ivar depth: (V, H, W) float32 metres, padded with NaN beyond (heights[v], widths[v]).
    :ivar heights, widths: (V,) int64; K (V, 3, 3) and T_camera_world (V, 4, 4) float64.
    """

    depth: Float32Array
    heights: Int64Array
    widths: Int64Array
    K: Float64Array
    T_camera_world: Float64Array


@nb.njit(cache=True)
def _raise_column(column: Int8Array, images: DepthImages, v: int,
                  foot: tuple[float, float, float], rises: Float64Array) -> None:
    """
    Raise the cells of one vertical column (nz,) to what view v measures behind them.

    :param foot: a point of the column, metres, world.
    :param rises: (nz,) heights of the cells' centres above it, metres.
    """
    x, y, z = foot
    T, K = images.T_camera_world[v], images.K[v]
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    xc = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]
    yc = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]
    zc = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
    for k in range(column.shape[0]):
        depth = zc + T[2, 2] * rises[k]
        if depth < NEAR_M:
            continue
        u = int(fx * (xc + T[0, 2] * rises[k]) / depth + cx + 0.5)
        w = int(fy * (yc + T[1, 2] * rises[k]) / depth + cy + 0.5)
        if u < 0 or w < 0 or u >= images.widths[v] or w >= images.heights[v]:
            continue
        d = images.depth[v, w, u]
        if d > 0:
            q = (d - depth) / FIELD_UNIT_M
            q = min(max(q, -FIELD_LIMIT), FIELD_LIMIT)
            if q > column[k]:
                column[k] = int(np.round(q))


@nb.njit(cache=True, parallel=True)
def fuse(images: DepthImages, origin: Float64Array, cell: float, shape: tuple[int, int],
         rises: Float64Array) -> Int8Array:
    """
    Return (nx, ny, nz) int8 values as those of the ProjectiveField, see there.

    :param rises: (nz,) heights of the cells' centres above the origin, metres.
    """
    nx, ny = shape
    out = np.empty((nx, ny, len(rises)), np.int8)
    for i in nb.prange(nx):
        x = origin[0] + i * cell
        for j in range(ny):
            y = origin[1] + j * cell
            out[i, j] = UNKNOWN
            for v in range(images.depth.shape[0]):
                _raise_column(out[i, j], images, v, (x, y, origin[2]), rises)
    return out


@nb.njit(cache=True, inline='always')
def probe(field: ProjectiveField, x: float, y: float, z: float) -> int:
    """Return the field (FIELD_UNIT_M) at a world point: free above and around, solid below."""
    values, origin, cell = field.values, field.origin, field.cell
    k = int((z - origin[2]) / cell + 0.5)
    if z < origin[2]:
        return -FIELD_LIMIT
    i = int(np.floor((x - origin[0]) / cell + 0.5))
    j = int(np.floor((y - origin[1]) / cell + 0.5))
    if (i < 0 or j < 0 or i >= values.shape[0] or j >= values.shape[1] or k >= values.shape[2]):
        return FIELD_LIMIT
    return int(values[i, j, k])


@nb.njit(cache=True)
def march(field: ProjectiveField, start: tuple[float, float, float],
          direction: tuple[float, float, float], step: float, n: int, free: bool,
          threshold: int) -> float:
    """
    Return how far in metres one can walk from a point before the field changes sides.

    :param direction: unit vector; `step` metres, `n` steps at most.
    :param free: True walks through free space until it meets something at or below
        `threshold`; False walks through what is not free until it exceeds `threshold`.
    """
    (x, y, z), (dx, dy, dz) = start, direction
    for s in range(n):
        q = probe(field, x + dx * step * s, y + dy * step * s, z + dz * step * s)
        if (q <= threshold) == free:
            return s * step
    return n * step
