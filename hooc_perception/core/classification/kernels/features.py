# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Rig-independent features of foreground points, read from the fused field.

The columns of a feature row, in this order: BASIC, MARCHES, HEIGHT_RINGS, FIELD_RINGS,
TEXTURE_FEATURES, one per probe, and SEGMENT_FEATURES + PLACE_FEATURES per segment scale.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array
from hooc_perception.core.classification.kernels.projective_field import (
    march,
    probe,
    ProjectiveField,
)
from hooc_perception.core.classification.kernels.segments import (
    AXIS_X,
    AXIS_Y,
    BREADTH,
    CENTRE_X,
    CENTRE_Y,
    HEIGHT,
    LENGTH,
    LOWEST,
)
from hooc_perception.core.classification.kernels.texture import TEXTURE_FEATURES
import numba as nb
import numpy as np

# Values of the field up to this one are not free, from minus this one on they are surface.
FREE = 12
# Rings around a point: radii, heights of the field rings relative to it, samples per ring.
RADII_M = np.array([0.01, 0.02, 0.04, 0.07, 0.11, 0.16])
RISES_M = np.array([-0.10, -0.05, -0.025, -0.01, 0.0, 0.01, 0.025, 0.05, 0.10])
ANGLES = 12
COS = np.cos(2 * np.pi * np.arange(ANGLES) / ANGLES)
SIN = np.sin(2 * np.pi * np.arange(ANGLES) / ANGLES)
# Horizontal axes along which the solid is measured, directions in which free space is.
AXES, DIRECTIONS = 6, 8
# Marches start this far inside and outside of the surface; their steps, metres.
INSIDE_M, OUTSIDE_M = 0.006, 0.015
SOLID_STEP_M, FREE_STEP_M = 0.004, 0.008
SOLID_STEPS, FREE_STEPS, AROUND_STEPS = 40, 30, 25
# A normal with a shorter horizontal part gives no direction; the segment's axis does.
LEAST_HORIZONTAL = 0.3

# The point itself.
POINT_HEIGHT, NORMAL_Z, RESIDUAL, BASIC = range(4)
# Extents of the solid and of the free space around.
THICKNESS, SOLID_ABOVE, FREE_AHEAD, FREE_BELOW, WIDTHS = range(5)
SHORT_SIDE = WIDTHS + AXES
LONG_SIDE = SHORT_SIDE + 1
NARROWEST, WIDEST, MEAN_WIDTH = LONG_SIDE + 1, LONG_SIDE + 2, LONG_SIDE + 3
GAPS, KEPT_GAPS = MEAN_WIDTH + 1, 5
SMALLEST_GAP = GAPS + KEPT_GAPS
LARGEST_GAP, MEAN_GAP, FREE_ABOVE = SMALLEST_GAP + 1, SMALLEST_GAP + 2, SMALLEST_GAP + 3
MARCHES = FREE_ABOVE + 1
# Of a ring of the height map, and of the field.
RING_MEAN, RING_HIGH, RING_LOW, RING_HARMONIC, RING_FEATURES = range(5)
HEIGHT_RINGS = RING_FEATURES * len(RADII_M)
FIELD_RINGS = 2 * len(RADII_M) * len(RISES_M)
FIXED_FEATURES = BASIC + MARCHES + HEIGHT_RINGS + FIELD_RINGS + TEXTURE_FEATURES
# Where in its segment a point lies.
RELATIVE_HEIGHT, ALONG, ACROSS, DISTANCE, PLACE_FEATURES = range(5)
# Columns of a probe: frame (0 the normal's yaw, 1 the segment's axis); 1 = the last coordinate
# is a height above the table, 0 = it is relative to the point; offset in metres.
PROBE_FRAME, PROBE_ABSOLUTE, PROBE_X, PROBE_Y, PROBE_Z = range(5)


class Queries(NamedTuple):
    """
    Points whose features are wanted.

    :ivar points: (n, 3) float64 world, metres; normal (n, 3) float64 and residual (n,) float32 of
        the local plane fit.
    :ivar voxel: (n,) int32 voxel of each point.
    """

    points: Float64Array
    normal: Float64Array
    residual: Float32Array
    voxel: Int32Array


class Segments(NamedTuple):
    """
    Segments of the voxels at several scales.

    :ivar ids: (levels, m) int32 segment of each voxel.
    :ivar frames: (levels, S, FRAME_COLUMNS) float64 and shapes (levels, S, SEGMENT_FEATURES)
        float32 from `describe`.
    :ivar orienting: level whose segments give the second frame of the probes.
    """

    ids: Int32Array
    frames: Float64Array
    shapes: Float32Array
    orienting: int


@nb.njit(cache=True)
def height_map(points: Float64Array, origin: Float64Array, cell: float, nx: int,
               ny: int) -> Float32Array:
    """Return (nx, ny) float32, the highest point over each cell (metres), 0 where none."""
    out = np.zeros((nx, ny), np.float32)
    for i in range(points.shape[0]):
        a = int(np.floor((points[i, 0] - origin[0]) / cell + 0.5))
        b = int(np.floor((points[i, 1] - origin[1]) / cell + 0.5))
        if 0 <= a < nx and 0 <= b < ny and points[i, 2] > out[a, b]:
            out[a, b] = points[i, 2]
    return out


@nb.njit(cache=True, inline='always')
def _through_solid(field: ProjectiveField, start: tuple[float, float, float],
                   direction: tuple[float, float, float]) -> float:
    """Return how far the solid extends from a point inside it, metres."""
    return march(field, start, direction, SOLID_STEP_M, SOLID_STEPS, False, FREE)


@nb.njit(cache=True, inline='always')
def _through_free(field: ProjectiveField, start: tuple[float, float, float],
                  direction: tuple[float, float, float], steps: int) -> float:
    """Return how far free space extends from a point in it, metres."""
    return march(field, start, direction, FREE_STEP_M, steps, True, FREE)


@nb.njit(cache=True)
def _marches(field: ProjectiveField, p: Float64Array, n: Float64Array, yaw: tuple[float, float],
             out: Float32Array) -> None:
    """
    Fill (MARCHES,) extents of what lies inside and of the free space around, metres.

    :param p, n: the point and its normal; yaw: (cos, sin) of the frame of the directions.
    """
    cy, sy = yaw
    inner = p[0] - INSIDE_M * n[0], p[1] - INSIDE_M * n[1], p[2] - INSIDE_M * n[2]
    outer = p[0] + OUTSIDE_M * n[0], p[1] + OUTSIDE_M * n[1], p[2] + OUTSIDE_M * n[2]
    out[THICKNESS] = _through_solid(field, inner, (-n[0], -n[1], -n[2]))
    out[SOLID_ABOVE] = _through_solid(field, inner, (0.0, 0.0, 1.0))
    out[FREE_AHEAD] = _through_free(field, outer, (n[0], n[1], n[2]), FREE_STEPS)
    out[FREE_BELOW] = _through_free(field, outer, (0.0, 0.0, -1.0), FREE_STEPS)
    # Widths of the solid through the point, in the yaw frame and as order statistics.
    small, large, total = 1e9, 0.0, 0.0
    for a in range(AXES):
        c, s = np.cos(np.pi * a / AXES), np.sin(np.pi * a / AXES)
        dx, dy = c * cy - s * sy, c * sy + s * cy
        fore = _through_solid(field, inner, (dx, dy, 0.0))
        back = _through_solid(field, inner, (-dx, -dy, 0.0))
        out[WIDTHS + a] = fore + back
        small, large = min(small, fore + back), max(large, fore + back)
        total += (fore + back) / AXES
        if a == AXES // 2:
            out[SHORT_SIDE], out[LONG_SIDE] = min(fore, back), max(fore, back)
    out[NARROWEST], out[WIDEST], out[MEAN_WIDTH] = small, large, total
    # Free distances around, at the point's own height just outside of the surface.
    small, large, total = 1e9, 0.0, 0.0
    for a in range(DIRECTIONS):
        c, s = np.cos(np.pi * a / 4), np.sin(np.pi * a / 4)
        d = _through_free(field, outer, (c * cy - s * sy, c * sy + s * cy, 0.0), AROUND_STEPS)
        if a < KEPT_GAPS:
            out[GAPS + a] = d
        small, large = min(small, d), max(large, d)
        total += d / DIRECTIONS
    out[SMALLEST_GAP], out[LARGEST_GAP], out[MEAN_GAP] = small, large, total
    out[FREE_ABOVE] = _through_free(field, outer, (0.0, 0.0, 1.0), AROUND_STEPS)


@nb.njit(cache=True)
def _height_rings(heights: Float32Array, field: ProjectiveField, p: Float64Array,
                  out: Float32Array) -> None:
    """Fill mean, greatest, least and second harmonic of the height map on rings, metres."""
    origin, cell = field.origin, field.cell
    o = 0
    for r in RADII_M:
        mean, high, low, c2, s2 = 0.0, -1e9, 1e9, 0.0, 0.0
        for a in range(ANGLES):
            i = int(np.floor((p[0] + r * COS[a] - origin[0]) / cell + 0.5))
            j = int(np.floor((p[1] + r * SIN[a] - origin[1]) / cell + 0.5))
            h = 0.0
            if 0 <= i < heights.shape[0] and 0 <= j < heights.shape[1]:
                h = heights[i, j]
            mean += h / ANGLES
            high, low = max(high, h), min(low, h)
            c2 += h * (2 * COS[a] * COS[a] - 1) / ANGLES
            s2 += h * 2 * SIN[a] * COS[a] / ANGLES
        out[o + RING_MEAN] = mean - p[2]
        out[o + RING_HIGH], out[o + RING_LOW] = high - p[2], low - p[2]
        out[o + RING_HARMONIC] = np.sqrt(c2 * c2 + s2 * s2)
        o += RING_FEATURES


@nb.njit(cache=True)
def _field_rings(field: ProjectiveField, p: Float64Array, out: Float32Array) -> None:
    """Fill the shares of each ring that are not free, and that are surface."""
    o = 0
    for r in RADII_M:
        for dz in RISES_M:
            solid, near = 0.0, 0.0
            for a in range(ANGLES):
                q = probe(field, p[0] + r * COS[a], p[1] + r * SIN[a], p[2] + dz)
                solid += q <= FREE
                near += -FREE <= q <= FREE
            out[o], out[o + 1] = solid / ANGLES, near / ANGLES
            o += 2


@nb.njit(cache=True)
def _probes(field: ProjectiveField, p: Float64Array, probes: Float64Array,
            yaw: tuple[float, float], axis: tuple[float, float], out: Float32Array) -> None:
    """Fill (P,) values of the field at the probes, in the frame of the yaw or of the axis."""
    for k in range(probes.shape[0]):
        c, s = yaw
        if probes[k, PROBE_FRAME] > 0:
            c, s = axis
        z = probes[k, PROBE_Z]
        if probes[k, PROBE_ABSOLUTE] == 0:
            z += p[2]
        out[k] = probe(field, p[0] + c * probes[k, PROBE_X] - s * probes[k, PROBE_Y],
                       p[1] + s * probes[k, PROBE_X] + c * probes[k, PROBE_Y], z)


@nb.njit(cache=True)
def _segment(p: Float64Array, frame: Float64Array, shape: Float32Array,
             out: Float32Array) -> None:
    """Fill the shape of the point's segment and, after it, where in it the point lies."""
    for k in range(shape.shape[0]):
        out[k] = shape[k]
    o = shape.shape[0]
    dx, dy = p[0] - frame[CENTRE_X], p[1] - frame[CENTRE_Y]
    out[o + RELATIVE_HEIGHT] = (p[2] - frame[LOWEST]) / max(shape[HEIGHT], 1e-3)
    out[o + ALONG] = (dx * frame[AXIS_X] + dy * frame[AXIS_Y]) / max(shape[LENGTH], 1e-3)
    out[o + ACROSS] = abs(-dx * frame[AXIS_Y] + dy * frame[AXIS_X]) / max(shape[BREADTH], 1e-3)
    out[o + DISTANCE] = np.sqrt(dx * dx + dy * dy)


@nb.njit(cache=True, parallel=True)
def point_features(queries: Queries, field: ProjectiveField, heights: Float32Array,
                   texture: Float32Array, segments: Segments, probes: Float64Array,
                   out: Float32Array) -> None:
    """
    Fill the feature rows of query points.

    :param heights: (nx, ny) float32 from `height_map`, on the cells of the field.
    :param texture: (m, TEXTURE_FEATURES) float32 of voxels.
    :param probes: (P, 5) float64, see PROBE_FRAME.
    :param out: (n, F) float32, F as the module's docstring adds it up.
    """
    for i in nb.prange(queries.points.shape[0]):
        p, n, f = queries.points[i], queries.normal[i], out[i]
        voxel = queries.voxel[i]
        own = segments.frames[segments.orienting, segments.ids[segments.orienting, voxel]]
        axis = own[AXIS_X], own[AXIS_Y]
        cy, sy = n[0], n[1]
        length = np.sqrt(cy * cy + sy * sy)
        if length < LEAST_HORIZONTAL:
            cy, sy = axis
            length = 1.0
        yaw = cy / length, sy / length
        f[POINT_HEIGHT], f[NORMAL_Z], f[RESIDUAL] = p[2], n[2], queries.residual[i]
        o = BASIC
        _marches(field, p, n, yaw, f[o:])
        o += MARCHES
        _height_rings(heights, field, p, f[o:])
        o += HEIGHT_RINGS
        _field_rings(field, p, f[o:])
        o += FIELD_RINGS
        for k in range(TEXTURE_FEATURES):
            f[o + k] = texture[voxel, k]
        o += TEXTURE_FEATURES
        _probes(field, p, probes, yaw, axis, f[o:])
        o += probes.shape[0]
        for level in range(segments.ids.shape[0]):
            g = segments.ids[level, voxel]
            _segment(p, segments.frames[level, g], segments.shapes[level, g], f[o:])
            o += segments.shapes.shape[2] + PLACE_FEATURES
