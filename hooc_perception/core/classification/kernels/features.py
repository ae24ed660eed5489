# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Rig-independent features of foreground points, read from the fused field."""

from hooc_perception.core.classification.kernels.field import march, probe
from hooc_perception.core.classification.kernels.texture import TEXTURE_FEATURES
import numba as nb
import numpy as np

FREE = 12
RADII_M = np.array([0.01, 0.02, 0.04, 0.07, 0.11, 0.16])
RISES_M = np.array([-0.10, -0.05, -0.025, -0.01, 0.0, 0.01, 0.025, 0.05, 0.10])
ANGLES = 12
COS = np.cos(2 * np.pi * np.arange(ANGLES) / ANGLES)
SIN = np.sin(2 * np.pi * np.arange(ANGLES) / ANGLES)
AXES = 6
BASIC = 3
MARCHES = 24
HEIGHT_RINGS = 4 * len(RADII_M)
FIELD_RINGS = 2 * len(RADII_M) * len(RISES_M)
FIXED_FEATURES = BASIC + MARCHES + HEIGHT_RINGS + FIELD_RINGS + TEXTURE_FEATURES


@nb.njit(cache=True)
def height_map(points, origin, cell, nx, ny):
    """Return (nx, ny) float32, the highest point over each cell (metres), 0 where none."""
    out = np.zeros((nx, ny), np.float32)
    for i in range(points.shape[0]):
        a = int(np.floor((points[i, 0] - origin[0]) / cell + 0.5))
        b = int(np.floor((points[i, 1] - origin[1]) / cell + 0.5))
        if 0 <= a < nx and 0 <= b < ny and points[i, 2] > out[a, b]:
            out[a, b] = points[i, 2]
    return out


@nb.njit(cache=True)
def _marches(field, origin, cell, p, n, cy, sy, out):
    """Fill (MARCHES,) extents of what lies inside and of the free space around, metres."""
    step = 0.004
    ix, iy, iz = p[0] - 0.006 * n[0], p[1] - 0.006 * n[1], p[2] - 0.006 * n[2]
    ox, oy, oz = p[0] + 0.015 * n[0], p[1] + 0.015 * n[1], p[2] + 0.015 * n[2]
    out[0] = march(field, origin, cell, ix, iy, iz, -n[0], -n[1], -n[2], step, 40, False, FREE)
    out[1] = march(field, origin, cell, ix, iy, iz, 0, 0, 1, step, 40, False, FREE)
    out[2] = march(field, origin, cell, ox, oy, oz, n[0], n[1], n[2], 0.008, 30, True, FREE)
    out[3] = march(field, origin, cell, ox, oy, oz, 0, 0, -1, 0.008, 30, True, FREE)
    # Widths of the solid through the point, in the yaw frame and as order statistics.
    small, large, total = 1e9, 0.0, 0.0
    for a in range(AXES):
        c, s = np.cos(np.pi * a / AXES), np.sin(np.pi * a / AXES)
        dx, dy = c * cy - s * sy, c * sy + s * cy
        fore = march(field, origin, cell, ix, iy, iz, dx, dy, 0, step, 40, False, FREE)
        back = march(field, origin, cell, ix, iy, iz, -dx, -dy, 0, step, 40, False, FREE)
        out[4 + a] = fore + back
        small, large = min(small, fore + back), max(large, fore + back)
        total += (fore + back) / AXES
        if a == AXES // 2:
            out[10], out[11] = min(fore, back), max(fore, back)
    out[12], out[13], out[14] = small, large, total
    # Free distances around, at the point's own height just outside of the surface.
    small, large, total = 1e9, 0.0, 0.0
    for a in range(8):
        c, s = np.cos(np.pi * a / 4), np.sin(np.pi * a / 4)
        dx, dy = c * cy - s * sy, c * sy + s * cy
        d = march(field, origin, cell, ox, oy, oz, dx, dy, 0, 0.008, 25, True, FREE)
        if a < 5:
            out[15 + a] = d
        small, large = min(small, d), max(large, d)
        total += d / 8
    out[20], out[21], out[22] = small, large, total
    out[23] = march(field, origin, cell, ox, oy, oz, 0, 0, 1, 0.008, 25, True, FREE)


@nb.njit(cache=True)
def _height_rings(heights, origin, cell, p, out):
    """Fill mean, greatest, least and second harmonic of the height map on rings, metres."""
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
        out[o], out[o + 1], out[o + 2] = mean - p[2], high - p[2], low - p[2]
        out[o + 3] = np.sqrt(c2 * c2 + s2 * s2)
        o += 4


@nb.njit(cache=True)
def _field_rings(field, origin, cell, p, out):
    """Fill the shares of each ring that are not free, and that are surface."""
    o = 0
    for r in RADII_M:
        for dz in RISES_M:
            solid, near = 0.0, 0.0
            for a in range(ANGLES):
                q = probe(field, origin, cell, p[0] + r * COS[a], p[1] + r * SIN[a], p[2] + dz)
                solid += q <= FREE
                near += -FREE <= q <= FREE
            out[o], out[o + 1] = solid / ANGLES, near / ANGLES
            o += 2


@nb.njit(cache=True, parallel=True)
def point_features(points, normal, residual, field, origin, cell, heights, voxel, texture, ids,
                   frames, shapes, orienting, probes, out):
    """
    Fill the feature rows of query points.

    :param points: (n, 3) world; normal (n, 3), residual (n,) of the local plane fit.
    :param voxel: (n,) index into the rows of `ids`.
    :param texture: (m, TEXTURE_FEATURES) float32 of voxels.
    :param ids: (levels, m) int32 segment of each voxel at each level.
    :param frames: (levels, S, 5) and shapes (levels, S, SEGMENT_FEATURES) from `describe`.
    :param orienting: level whose segments give the second frame.
    :param probes: (P, 5) float64: frame (0 normal's yaw, 1 segment's axis), 1 where the last
        coordinate is a height above the table, and the offset (3,) in metres.
    :param out: (n, FIXED_FEATURES + P + levels * (SEGMENT_FEATURES + 4)) float32.
    """
    for i in nb.prange(points.shape[0]):
        p, n, f = points[i], normal[i], out[i]
        own = frames[orienting, ids[orienting, voxel[i]]]
        sx, sy = own[2], own[3]
        cy, syaw = n[0], n[1]
        length = np.sqrt(cy * cy + syaw * syaw)
        if length < 0.3:
            cy, syaw, length = sx, sy, 1.0
        cy, syaw = cy / length, syaw / length
        f[0], f[1], f[2] = p[2], n[2], residual[i]
        o = BASIC
        _marches(field, origin, cell, p, n, cy, syaw, f[o:])
        o += MARCHES
        _height_rings(heights, origin, cell, p, f[o:])
        o += HEIGHT_RINGS
        _field_rings(field, origin, cell, p, f[o:])
        o += FIELD_RINGS
        for k in range(TEXTURE_FEATURES):
            f[o + k] = texture[voxel[i], k]
        o += TEXTURE_FEATURES
        for k in range(probes.shape[0]):
            c, s = cy, syaw
            if probes[k, 0] > 0:
                c, s = sx, sy
            z = probes[k, 4]
            if probes[k, 1] == 0:
                z += p[2]
            f[o + k] = probe(field, origin, cell, p[0] + c * probes[k, 2] - s * probes[k, 3],
                             p[1] + s * probes[k, 2] + c * probes[k, 3], z)
        o += probes.shape[0]
        for level in range(ids.shape[0]):
            g = ids[level, voxel[i]]
            frame, shape = frames[level, g], shapes[level, g]
            for k in range(shape.shape[0]):
                f[o + k] = shape[k]
            o += shape.shape[0]
            dx, dy = p[0] - frame[0], p[1] - frame[1]
            f[o] = (p[2] - frame[4]) / max(shape[2], 1e-3)
            f[o + 1] = (dx * frame[2] + dy * frame[3]) / max(shape[0], 1e-3)
            f[o + 2] = abs(-dx * frame[3] + dy * frame[2]) / max(shape[1], 1e-3)
            f[o + 3] = np.sqrt(dx * dx + dy * dy)
            o += 4
