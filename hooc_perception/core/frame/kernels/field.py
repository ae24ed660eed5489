# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fuse the views into a voxel field: distance to the seen surface, its normal, free space."""

from hooc_perception.core.arrays import BoolArray, Float32Array, Float64Array
from hooc_perception.core.frame.kernels.records import Field
from hooc_perception.core.kernels.linalg import smallest_eigenvector
from hooc_perception.core.kernels.raster import NEAR_M
import numba as nb
import numpy as np

# Channels of a voxel, see records.Field; a power of two, so that a voxel never straddles two
# cache lines.
CHANNELS = 8
DISTANCE, FREE, NORMAL, HEIGHT = 0, 1, 2, 5
# Fewest points that a plane is fitted to, the pixel's own among them.
FEWEST_NEIGHBOURS = 6


@nb.njit(cache=True, parallel=True)
def normals_of_view(points: Float64Array, valid: BoolArray, t_world_camera: Float64Array,
                    radius_px: int, gate_m: float) -> Float32Array:
    """
    Return (H, W, 3) float32 unit normals towards the camera by a local plane fit; NaN = none.

    :param points: (H, W, 3) float64 world points, metres.
    :param valid: (H, W) bool, pixels that want a normal and may serve as neighbours.
    :param gate_m: neighbours farther away than this in space are left out.
    """
    h, w = valid.shape
    out = np.full((h, w, 3), np.nan, np.float32)
    for v in nb.prange(h):
        C = np.empty((3, 3))
        for u in range(w):
            if not valid[v, u]:
                continue
            if _covariance(points, valid, v, u, radius_px, gate_m, C) < FEWEST_NEIGHBOURS:
                continue
            px, py, pz = points[v, u, 0], points[v, u, 1], points[v, u, 2]
            normal = smallest_eigenvector(C)
            d = (normal[0] * (t_world_camera[0] - px) + normal[1] * (t_world_camera[1] - py)
                 + normal[2] * (t_world_camera[2] - pz))
            s = 1.0 if d >= 0 else -1.0
            out[v, u, 0] = s * normal[0]
            out[v, u, 1] = s * normal[1]
            out[v, u, 2] = s * normal[2]
    return out


@nb.njit(cache=True)
def _covariance(points: Float64Array, valid: BoolArray, v: int, u: int, radius_px: int,
                gate_m: float, C: Float64Array) -> int:
    """
    Fill C (3, 3) with the covariance of the valid points around pixel (v, u).

    :return: the number of points; C is left alone where that is below FEWEST_NEIGHBOURS.
    """
    h, w = valid.shape
    px, py, pz = points[v, u, 0], points[v, u, 1], points[v, u, 2]
    n = 0
    sx = sy = sz = sxx = sxy = sxz = syy = syz = szz = 0.0
    for j in range(max(0, v - radius_px), min(h, v + radius_px + 1)):
        for i in range(max(0, u - radius_px), min(w, u + radius_px + 1)):
            if not valid[j, i]:
                continue
            # Relative to the pixel's own point: sums of world coordinates would lose digits.
            x, y, z = points[j, i, 0] - px, points[j, i, 1] - py, points[j, i, 2] - pz
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
    if n < FEWEST_NEIGHBOURS:
        return n
    C[0, 0] = sxx / n - sx * sx / n / n
    C[0, 1] = C[1, 0] = sxy / n - sx * sy / n / n
    C[0, 2] = C[2, 0] = sxz / n - sx * sz / n / n
    C[1, 1] = syy / n - sy * sy / n / n
    C[1, 2] = C[2, 1] = syz / n - sy * sz / n / n
    C[2, 2] = szz / n - sz * sz / n / n
    return n


@nb.njit(cache=True, parallel=True)
def fill_distance(field: Field, points: Float64Array, normals: Float64Array,
                  blocks: int) -> None:
    """
    Write what is known of the surface point nearest to each voxel's centre into the field.

    Distance: 255 = `truncation` or more. Normal: 128 + 127 times each component. Height of the
    centre over the tangent plane of that point: 128 + 127 = `truncation`.

    :param points: (n, 3) float64 surface points; `normals` (n, 3) float64 unit.
    :param blocks: number of threads; it does not change the result.
    """
    data, origin, voxel, truncation = field.data, field.origin, field.voxel, field.truncation
    nx, ny, nz = data.shape[:3]
    r = int(np.ceil(truncation / voxel))
    best = np.full((nx, ny, nz), truncation * truncation, np.float32)
    # Each slab of voxels is filled by one thread, which looks at all points in their order.
    for block in nb.prange(blocks):
        low, high = block * nx // blocks, (block + 1) * nx // blocks
        data[low:high, :, :, DISTANCE] = 255
        for i in range(points.shape[0]):
            gx = (points[i, 0] - origin[0]) / voxel
            gy = (points[i, 1] - origin[1]) / voxel
            gz = (points[i, 2] - origin[2]) / voxel
            cx, cy, cz = int(gx), int(gy), int(gz)
            for x in range(max(low, cx - r), min(high, cx + r + 1)):
                dx = (x + 0.5 - gx) * voxel
                for y in range(max(0, cy - r), min(ny, cy + r + 1)):
                    dy = (y + 0.5 - gy) * voxel
                    dxy = dx * dx + dy * dy
                    for z in range(max(0, cz - r), min(nz, cz + r + 1)):
                        dz = (z + 0.5 - gz) * voxel
                        d = dxy + dz * dz
                        if d < best[x, y, z]:
                            best[x, y, z] = d
                            data[x, y, z, DISTANCE] = np.uint8(255 * np.sqrt(d) / truncation)
                            data[x, y, z, NORMAL] = np.uint8(128.5 + 127 * normals[i, 0])
                            data[x, y, z, NORMAL + 1] = np.uint8(128.5 + 127 * normals[i, 1])
                            data[x, y, z, NORMAL + 2] = np.uint8(128.5 + 127 * normals[i, 2])
                            height = dx * normals[i, 0] + dy * normals[i, 1] + dz * normals[i, 2]
                            data[x, y, z, HEIGHT] = np.uint8(128.5 + 127 * height / truncation)


@nb.njit(cache=True, parallel=True)
def fill_free(field: Field, depth: Float32Array, R_camera_world: Float64Array,
              t_camera_world: Float64Array, K: Float64Array, margin: float, full: float) -> None:
    """
    Raise the free-space evidence of the voxels that one view sees through.

    :param depth: (H, W) float32 measured metres, NaN = none.
    :param margin: evidence starts this far in front of the reading, metres.
    :param full: and reaches 255 this much farther, metres.
    """
    data, origin, voxel = field.data, field.origin, field.voxel
    nx, ny, nz = data.shape[:3]
    h, w = depth.shape
    R, t = R_camera_world, t_camera_world
    for x in nb.prange(nx):
        for y in range(ny):
            for z in range(nz):
                px = origin[0] + (x + 0.5) * voxel
                py = origin[1] + (y + 0.5) * voxel
                pz = origin[2] + (z + 0.5) * voxel
                zc = R[2, 0] * px + R[2, 1] * py + R[2, 2] * pz + t[2]
                if zc < NEAR_M:
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
                    if value > data[x, y, z, FREE]:
                        data[x, y, z, FREE] = value
