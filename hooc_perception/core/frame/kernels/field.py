# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fuse the views into a voxel field: distance to the seen surface, its normal, free space."""

import numba as nb
import numpy as np

# Channels of a voxel: distance (0..255 = 0..truncation), free evidence, normal x y z + 128.
CHANNELS = 8


@nb.njit(cache=True)
def normals_of_view(points, valid, t_world_camera, radius_px, gate_m):
    """
    Return (H, W, 3) float32 unit normals towards the camera by a local plane fit; NaN = none.

    :param points: (H, W, 3) float64 world points, metres.
    :param valid: (H, W) bool, pixels that want a normal and may serve as neighbours.
    :param gate_m: neighbours farther away than this in space are left out.
    """
    h, w = valid.shape
    out = np.full((h, w, 3), np.nan, np.float32)
    for v in range(h):
        for u in range(w):
            if not valid[v, u]:
                continue
            px, py, pz = points[v, u, 0], points[v, u, 1], points[v, u, 2]
            n = 0
            sx = sy = sz = sxx = sxy = sxz = syy = syz = szz = 0.0
            for j in range(max(0, v - radius_px), min(h, v + radius_px + 1)):
                for i in range(max(0, u - radius_px), min(w, u + radius_px + 1)):
                    if not valid[j, i]:
                        continue
                    x = points[j, i, 0] - px
                    y = points[j, i, 1] - py
                    z = points[j, i, 2] - pz
                    if x * x + y * y + z * z > gate_m * gate_m:
                        continue
                    n += 1
                    sx += x
                    sy += y
                    sz += z
                    sxx += x * x
                    sxy += x * y
                    sxz += x * z
                    syy += y * y
                    syz += y * z
                    szz += z * z
            if n < 6:
                continue
            C = np.empty((3, 3))
            C[0, 0] = sxx / n - sx * sx / n / n
            C[0, 1] = C[1, 0] = sxy / n - sx * sy / n / n
            C[0, 2] = C[2, 0] = sxz / n - sx * sz / n / n
            C[1, 1] = syy / n - sy * sy / n / n
            C[1, 2] = C[2, 1] = syz / n - sy * sz / n / n
            C[2, 2] = szz / n - sz * sz / n / n
            normal = _smallest_eigenvector(C)
            d = (normal[0] * (t_world_camera[0] - px) + normal[1] * (t_world_camera[1] - py)
                 + normal[2] * (t_world_camera[2] - pz))
            s = 1.0 if d >= 0 else -1.0
            out[v, u, 0] = s * normal[0]
            out[v, u, 1] = s * normal[1]
            out[v, u, 2] = s * normal[2]
    return out


@nb.njit(cache=True)
def _smallest_eigenvector(C):
    """Return the unit eigenvector of the smallest eigenvalue of a symmetric 3 x 3 matrix."""
    q = (C[0, 0] + C[1, 1] + C[2, 2]) / 3
    p2 = ((C[0, 0] - q) ** 2 + (C[1, 1] - q) ** 2 + (C[2, 2] - q) ** 2
          + 2 * (C[0, 1] ** 2 + C[0, 2] ** 2 + C[1, 2] ** 2))
    p = np.sqrt(p2 / 6) + 1e-30
    b00, b11, b22 = (C[0, 0] - q) / p, (C[1, 1] - q) / p, (C[2, 2] - q) / p
    b01, b02, b12 = C[0, 1] / p, C[0, 2] / p, C[1, 2] / p
    det = (b00 * (b11 * b22 - b12 * b12) - b01 * (b01 * b22 - b12 * b02)
           + b02 * (b01 * b12 - b11 * b02)) / 2
    phi = np.arccos(min(1.0, max(-1.0, det))) / 3
    lam = q + 2 * p * np.cos(phi + 2 * np.pi / 3)
    a0, a1, a2 = C[0, 0] - lam, C[1, 1] - lam, C[2, 2] - lam
    best = np.zeros(3)
    norm = -1.0
    # The eigenvector is the cross product of two rows of C - lam; take the stablest pair.
    for k in range(3):
        if k == 0:
            x, y, z = (C[0, 1] * C[1, 2] - C[0, 2] * a1, C[0, 2] * C[0, 1] - a0 * C[1, 2],
                       a0 * a1 - C[0, 1] * C[0, 1])
        elif k == 1:
            x, y, z = (C[0, 1] * a2 - C[0, 2] * C[1, 2], C[0, 2] * C[0, 2] - a0 * a2,
                       a0 * C[1, 2] - C[0, 1] * C[0, 2])
        else:
            x, y, z = (a1 * a2 - C[1, 2] * C[1, 2], C[1, 2] * C[0, 2] - C[0, 1] * a2,
                       C[0, 1] * C[1, 2] - a1 * C[0, 2])
        m = x * x + y * y + z * z
        if m > norm:
            norm = m
            best[0], best[1], best[2] = x, y, z
    if norm < 1e-40:
        best[0], best[1], best[2] = 0.0, 0.0, 1.0
        return best
    return best / np.sqrt(norm)


@nb.njit(cache=True)
def fill_distance(field, origin, voxel, points, normals, truncation):
    """
    Write what is known of the nearest point of the surface.

    Channel 0: distance to it, 255 = `truncation`; 2-4: its normal; 5: height of the voxel's
    centre over its tangent plane, 128 + 127 = `truncation`.
    """
    nx, ny, nz = field.shape[:3]
    r = int(np.ceil(truncation / voxel))
    best = np.full((nx, ny, nz), truncation * truncation, np.float32)
    for i in range(points.shape[0]):
        gx = (points[i, 0] - origin[0]) / voxel
        gy = (points[i, 1] - origin[1]) / voxel
        gz = (points[i, 2] - origin[2]) / voxel
        cx, cy, cz = int(gx), int(gy), int(gz)
        for x in range(max(0, cx - r), min(nx, cx + r + 1)):
            dx = (x + 0.5 - gx) * voxel
            for y in range(max(0, cy - r), min(ny, cy + r + 1)):
                dy = (y + 0.5 - gy) * voxel
                dxy = dx * dx + dy * dy
                for z in range(max(0, cz - r), min(nz, cz + r + 1)):
                    dz = (z + 0.5 - gz) * voxel
                    d = dxy + dz * dz
                    if d < best[x, y, z]:
                        best[x, y, z] = d
                        field[x, y, z, 0] = np.uint8(255 * np.sqrt(d) / truncation)
                        field[x, y, z, 2] = np.uint8(128.5 + 127 * normals[i, 0])
                        field[x, y, z, 3] = np.uint8(128.5 + 127 * normals[i, 1])
                        field[x, y, z, 4] = np.uint8(128.5 + 127 * normals[i, 2])
                        height = dx * normals[i, 0] + dy * normals[i, 1] + dz * normals[i, 2]
                        field[x, y, z, 5] = np.uint8(128.5 + 127 * height / truncation)


@nb.njit(cache=True)
def fill_free(field, origin, voxel, depth, R_camera_world, t_camera_world, K, margin, full):
    """
    Raise channel 1 where this view sees through a voxel: 0 none, 255 = `full` beyond `margin`.

    :param depth: (H, W) float32 measured metres, NaN = none.
    """
    nx, ny, nz = field.shape[:3]
    h, w = depth.shape
    R, t = R_camera_world, t_camera_world
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                px = origin[0] + (x + 0.5) * voxel
                py = origin[1] + (y + 0.5) * voxel
                pz = origin[2] + (z + 0.5) * voxel
                zc = R[2, 0] * px + R[2, 1] * py + R[2, 2] * pz + t[2]
                if zc < 0.05:
                    continue
                xc = R[0, 0] * px + R[0, 1] * py + R[0, 2] * pz + t[0]
                yc = R[1, 0] * px + R[1, 1] * py + R[1, 2] * pz + t[1]
                u = int(np.floor(K[0, 0] * xc / zc + K[0, 2] + 0.5))
                v = int(np.floor(K[1, 1] * yc / zc + K[1, 2] + 0.5))
                if u < 0 or v < 0 or u >= w or v >= h:
                    continue
                d = depth[v, u]
                if not d > 0:
                    continue
                e = (d - zc - margin) / full
                if e > 0:
                    value = np.uint8(255 * min(1.0, e))
                    if value > field[x, y, z, 1]:
                        field[x, y, z, 1] = value
