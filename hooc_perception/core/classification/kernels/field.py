# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Normals of depth pixels and the fused free-space field that the `best` features probe."""

import numba as nb
import numpy as np

FIELD_UNIT_M = 0.0005
FIELD_LIMIT = 120


@nb.njit(cache=True)
def normals(depth, rows, cols, K, R_world_camera, half, gate):
    """
    Return normals in the world that face the camera, and the plane residuals.

    On a plane 1 / z is affine in the normalised image coordinates: a 3 x 3 least squares fit
    over the (2 half + 1)^2 window gives the plane n . X = 1 in the camera frame.

    :param depth: (H, W) float32 metres, NaN = none.
    :param gate: neighbours whose depth differs by more (metres) belong to another surface.
    :return: (n, 3) float32 normals and (n,) float32 mean absolute residuals in metres; a
        normal along the ray where fewer than five neighbours support the fit.
    """
    h, w = depth.shape
    n = rows.shape[0]
    out = np.empty((n, 3), np.float32)
    residual = np.empty(n, np.float32)
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    for i in range(n):
        r, c = rows[i], cols[i]
        d0 = depth[r, c]
        x0, y0 = (c - cx) / fx, (r - cy) / fy
        sxx, sxy, syy, sx, sy, s = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        bx, by, b = 0.0, 0.0, 0.0
        for rr in range(max(0, r - half), min(h, r + half + 1)):
            for cc in range(max(0, c - half), min(w, c + half + 1)):
                d = depth[rr, cc]
                if abs(d - d0) < gate:
                    x, y, q = (cc - cx) / fx - x0, (rr - cy) / fy - y0, d0 / d
                    sxx += x * x
                    sxy += x * y
                    syy += y * y
                    sx += x
                    sy += y
                    s += 1.0
                    bx += x * q
                    by += y * q
                    b += q
        a0, a1, a2 = 0.0, 0.0, 1.0
        c00, c01, c11 = sxx - sx * sx / s, sxy - sx * sy / s, syy - sy * sy / s
        det = c00 * c11 - c01 * c01
        if s >= 5 and det > 1e-6 * (c00 + c11) ** 2:
            e0, e1 = bx - sx * b / s, by - sy * b / s
            a0 = (c11 * e0 - c01 * e1) / det
            a1 = (c00 * e1 - c01 * e0) / det
            a2 = (b - a0 * sx - a1 * sy) / s
        total = 0.0
        for rr in range(max(0, r - half), min(h, r + half + 1)):
            for cc in range(max(0, c - half), min(w, c + half + 1)):
                d = depth[rr, cc]
                if abs(d - d0) < gate:
                    x, y = (cc - cx) / fx - x0, (rr - cy) / fy - y0
                    total += abs(d0 / d - a0 * x - a1 * y - a2)
        residual[i] = d0 * total / s
        nx, ny = a0, a1
        nz = a2 - a0 * x0 - a1 * y0
        if s < 5:
            nx, ny, nz = x0, y0, 1.0
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        sign = -1.0 if nx * x0 + ny * y0 + nz > 0 else 1.0
        for k in range(3):
            out[i, k] = sign * (R_world_camera[k, 0] * nx + R_world_camera[k, 1] * ny
                                + R_world_camera[k, 2] * nz) / length
    return out, residual


@nb.njit(cache=True, parallel=True)
def fuse_field(depths, heights, widths, K, T_camera_world, origin, cell, shape):
    """
    Return the (nx, ny, nz) int8 projective distance field of all views.

    The value, in FIELD_UNIT_M, is the largest `measured depth - cell depth` over the views
    that have a reading there: positive = some view looks through it (free), about zero = on
    a surface, negative = hidden in every view. -FIELD_LIMIT - 1 = no view knows.

    :param depths: (V, H, W) float32, padded with NaN beyond (heights[v], widths[v]).
    :param T_camera_world: (V, 4, 4) float64.
    :param origin: (3,) float64 centre of cell (0, 0, 0), metres.
    """
    nx, ny, nz = shape
    out = np.empty((nx, ny, nz), np.int8)
    for i in nb.prange(nx):
        x = origin[0] + i * cell
        for j in range(ny):
            y = origin[1] + j * cell
            for k in range(nz):
                out[i, j, k] = -FIELD_LIMIT - 1
            for v in range(depths.shape[0]):
                T = T_camera_world[v]
                fx, fy, cx, cy = K[v, 0, 0], K[v, 1, 1], K[v, 0, 2], K[v, 1, 2]
                xc = T[0, 0] * x + T[0, 1] * y + T[0, 2] * origin[2] + T[0, 3]
                yc = T[1, 0] * x + T[1, 1] * y + T[1, 2] * origin[2] + T[1, 3]
                zc = T[2, 0] * x + T[2, 1] * y + T[2, 2] * origin[2] + T[2, 3]
                for k in range(nz):
                    z = zc + T[2, 2] * k * cell
                    if z < 0.05:
                        continue
                    u = int(fx * (xc + T[0, 2] * k * cell) / z + cx + 0.5)
                    w = int(fy * (yc + T[1, 2] * k * cell) / z + cy + 0.5)
                    if u < 0 or w < 0 or u >= widths[v] or w >= heights[v]:
                        continue
                    d = depths[v, w, u]
                    if d > 0:
                        q = (d - z) / FIELD_UNIT_M
                        q = min(max(q, -FIELD_LIMIT), FIELD_LIMIT)
                        if q > out[i, j, k]:
                            out[i, j, k] = int(np.round(q))
    return out


@nb.njit(cache=True, inline='always')
def probe(field, origin, cell, x, y, z):
    """Return the field (FIELD_UNIT_M) at a world point: free above and around, solid below."""
    k = int((z - origin[2]) / cell + 0.5)
    if z < origin[2]:
        return -FIELD_LIMIT
    i = int(np.floor((x - origin[0]) / cell + 0.5))
    j = int(np.floor((y - origin[1]) / cell + 0.5))
    if (i < 0 or j < 0 or i >= field.shape[0] or j >= field.shape[1] or k >= field.shape[2]):
        return FIELD_LIMIT
    return int(field[i, j, k])


@nb.njit(cache=True)
def march(field, origin, cell, x, y, z, dx, dy, dz, step, n, free, threshold):
    """
    Return how far (metres) one can walk from a point before the field changes sides.

    :param free: True walks through free space until it meets something at or below
        `threshold`; False walks through what is not free until it exceeds `threshold`.
    """
    for s in range(n):
        q = probe(field, origin, cell, x + dx * step * s, y + dy * step * s, z + dz * step * s)
        if (q <= threshold) == free:
            return s * step
    return n * step
