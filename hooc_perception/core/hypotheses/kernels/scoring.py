# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Score posed, scaled models in the fused field.

With the sums over n model points that field_evidence returns and the mean a of the products of
two scales,

    score = 1.5 a / (a + 0.5) (agree - free violate - shell crowded) / n
            - size_prior |log scale|^2

free, shell and size_prior are ScoreWeights.
"""

from hooc_perception.core.arrays import Float64Array, Int8Array, UInt8Array
from hooc_perception.core.frame.kernels.field import DISTANCE, FREE, HEIGHT, NORMAL
from hooc_perception.core.frame.kernels.records import Field
from hooc_perception.core.hypotheses.kernels.records import ScoreWeights, Surface
from hooc_perception.core.kernels.gauss_newton import add_equation
from hooc_perception.core.kernels.pose import (
    rotation_of,
    squared_log_scale,
    SX,
    SY,
    SZ,
    TX,
    TY,
    TZ,
)
import numba as nb
import numpy as np

# There should be free space this far in front of the surface of a model, metres.
SHELL_M = 0.014
# Points this far below the table violate it, metres.
LOWEST_M = -0.010
# Violations by points below the table and by points outside of the field.
BELOW, OUTSIDE = 1.0, 0.7
# Distances as stored in the field: a violation needs more than FREE_FROM, and a point
# in front of the model counts as crowded below CROWDED.
FREE_FROM, FREE_RANGE = 100, 100.0
CROWDED = 90.0
# What the quick test takes off for a point outside of the field.
QUICK_OUTSIDE = 70.0
# Least cosine for a Gauss-Newton equation.
MIN_COSINE = 0.3


@nb.njit(cache=True, inline='always')
def _inside(gx: float, gy: float, gz: float, nx: int, ny: int, nz: int) -> bool:
    """Return whether grid coordinates lie inside of a field of nx x ny x nz voxels."""
    return 0.0 <= gx < nx and 0.0 <= gy < ny and 0.0 <= gz < nz


@nb.njit(cache=True, inline='always')
def _world_normal(normals: Float64Array, k: int, R: Float64Array,
                  inverse_scale: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the unit normal in the world of point k of a scaled model with rotation R."""
    a = normals[k, 0] * inverse_scale[0]
    b = normals[k, 1] * inverse_scale[1]
    c = normals[k, 2] * inverse_scale[2]
    n = 1.0 / np.sqrt(a * a + b * b + c * c + 1e-20)
    a, b, c = a * n, b * n, c * n
    return (R[0, 0] * a + R[0, 1] * b + R[0, 2] * c,
            R[1, 0] * a + R[1, 1] * b + R[1, 2] * c,
            R[2, 0] * a + R[2, 1] * b + R[2, 2] * c)


@nb.njit(cache=True, error_model='numpy')
def field_evidence(h: Float64Array, surface: Surface, first: int, last: int, field: Field,
                   R: Float64Array, equations: Float64Array) -> tuple[float, float, float]:
    """
    Return (agree, violate, crowded), sums over model points first..last - 1 of hypothesis `h`.

    A point on the measured surface that faces as it does counts up to 1 in `agree`; a point in
    space that some view sees through, or below the table, up to 1 in `violate`; a point without
    free space in front of it up to 1 in `crowded`: it would lie inside of a larger thing. Hidden
    points count nothing.

    :param R: (3, 3) scratch.
    :param equations: (9, 10) float64, filled with the Gauss-Newton equations of the agreeing
        points, see core/kernels/gauss_newton.py; (0, 0) = not wanted.
    """
    rotation_of(h, R)
    equations[:] = 0.0
    data, origin, voxel = field.data, field.origin, field.voxel
    points = surface.points
    nx, ny, nz = data.shape[:3]
    inv = 1.0 / voxel
    # From here on in units of voxels.
    ox, oy, oz = (h[TX] - origin[0]) * inv, (h[TY] - origin[1]) * inv, (h[TZ] - origin[2]) * inv
    px, py, pz = h[SX] * inv, h[SY] * inv, h[SZ] * inv
    inverse_scale = 1.0 / h[SX], 1.0 / h[SY], 1.0 / h[SZ]
    reach = SHELL_M * inv
    lowest = (LOWEST_M - origin[2]) * inv
    agree, violate, crowded = 0.0, 0.0, 0.0
    for k in range(first, last):
        x, y, z = points[k, 0] * px, points[k, 1] * py, points[k, 2] * pz
        gz = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + oz
        if gz < lowest:
            violate += BELOW
            continue
        gx = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + ox
        gy = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + oy
        if not _inside(gx, gy, gz, nx, ny, nz):
            violate += OUTSIDE
            continue
        ix, iy, iz = int(gx), int(gy), int(gz)
        d, f = data[ix, iy, iz, DISTANCE], data[ix, iy, iz, FREE]
        if f > 0 and d > FREE_FROM:
            violate += f / 255.0 * min(1.0, (d - FREE_FROM) / FREE_RANGE)
        wx, wy, wz = _world_normal(surface.normals, k, R, inverse_scale)
        if d < 255:
            u, v, w = _measured_normal(data, ix, iy, iz)
            cosine = wx * u + wy * v + wz * w
            if cosine > 0:
                e = d / 255.0
                agree += (1.0 - e * e) * min(1.0, cosine)
                if equations.shape[0] and cosine > MIN_COSINE:
                    add_equation(equations, h, R,
                                 (gx * voxel + origin[0], gy * voxel + origin[1],
                                  gz * voxel + origin[2]), (u, v, w),
                                 _height(field, gx, gy, gz, (u, v, w)), min(1.0, cosine))
        gx, gy, gz = gx + reach * wx, gy + reach * wy, gz + reach * wz
        if _inside(gx, gy, gz, nx, ny, nz):
            d = data[int(gx), int(gy), int(gz), DISTANCE]
            if d < CROWDED:
                crowded += 1.0 - d / CROWDED
    return agree, violate, crowded


@nb.njit(cache=True, inline='always')
def _measured_normal(data: UInt8Array, x: int, y: int, z: int) -> tuple[float, float, float]:
    """Return the normal of the measured surface at a voxel of the field."""
    return ((data[x, y, z, NORMAL] - 128.0) / 127.0,
            (data[x, y, z, NORMAL + 1] - 128.0) / 127.0,
            (data[x, y, z, NORMAL + 2] - 128.0) / 127.0)


@nb.njit(cache=True, inline='always')
def _height(field: Field, gx: float, gy: float, gz: float,
            normal: tuple[float, float, float]) -> float:
    """Return the distance of grid coordinates from the tangent plane of their voxel, metres."""
    ix, iy, iz = int(gx), int(gy), int(gz)
    return ((field.data[ix, iy, iz, HEIGHT] - 128.0) * (field.truncation / 127.0)
            + field.voxel * (normal[0] * (gx - ix - 0.5) + normal[1] * (gy - iy - 0.5)
                             + normal[2] * (gz - iz - 0.5)))


@nb.njit(cache=True)
def score(h: Float64Array, surface: Surface, n: int, field: Field, weights: ScoreWeights,
          R: Float64Array, equations: Float64Array) -> float:
    """Return the score of hypothesis `h` from the first n points of its model; see the module."""
    return score_of(h, n, field_evidence(h, surface, 0, n, field, R, equations), weights)


@nb.njit(cache=True)
def score_of(h: Float64Array, n: int, evidence: tuple[float, float, float],
             weights: ScoreWeights) -> float:
    """Return the score of hypothesis `h` from what field_evidence returned for n points."""
    agree, violate, crowded = evidence
    area = (h[SX] * h[SY] + h[SY] * h[SZ] + h[SX] * h[SZ]) / 3.0
    return ((agree - weights.free * violate - weights.shell * crowded) / n * area / (area + 0.5)
            * 1.5 - weights.size_prior * squared_log_scale(h))


@nb.njit(cache=True)
def quick_field(data: UInt8Array) -> Int8Array:
    """
    Return a coarser score per voxel of a field's data (X, Y, Z, 8).

    :return: (X, Y, Z) int8: 100 on the measured surface, 0 hidden, -100 in free space.
    """
    out = np.zeros(data.shape[:3], np.int8)
    for x in range(data.shape[0]):
        for y in range(data.shape[1]):
            for z in range(data.shape[2]):
                d, f = data[x, y, z, DISTANCE], data[x, y, z, FREE]
                if d < 255:
                    out[x, y, z] = np.int8(100 * (1.0 - (d / 255.0) ** 2))
                elif f > 0:
                    out[x, y, z] = -np.int8(100 * (f / 255.0))
    return out


@nb.njit(cache=True, error_model='numpy')
def quick_score(h: Float64Array, points: Float64Array, n: int, quick: Int8Array, field: Field,
                R: Float64Array) -> float:
    """
    Return the sum of a quick field over the first n model points of hypothesis `h`.

    :param quick: (X, Y, Z) int8 from quick_field, of the same grid as `field`.
    :param R: (3, 3) scratch.
    """
    rotation_of(h, R)
    origin = field.origin
    nx, ny, nz = quick.shape
    inv = 1.0 / field.voxel
    ox, oy, oz = (h[TX] - origin[0]) * inv, (h[TY] - origin[1]) * inv, (h[TZ] - origin[2]) * inv
    px, py, pz = h[SX] * inv, h[SY] * inv, h[SZ] * inv
    total = 0.0
    for k in range(n):
        x, y, z = points[k, 0] * px, points[k, 1] * py, points[k, 2] * pz
        gx = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + ox
        gy = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + oy
        gz = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + oz
        if _inside(gx, gy, gz, nx, ny, nz):
            total += quick[int(gx), int(gy), int(gz)]
        else:
            total -= QUICK_OUTSIDE
    return total
