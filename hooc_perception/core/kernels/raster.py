# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Z-buffer rasterisation of triangle meshes: nearest surface wins, both sides are drawn."""

import numba as nb
import numpy as np

NEAR_M = 0.05


@nb.njit(cache=True)
def project_vertices(vertices_world, R_camera_world, t_camera_world, fx, fy, cx, cy):
    """Return (V, 3) float64 rows (u, v, z): pixel coordinates and depth in metres."""
    out = np.empty((vertices_world.shape[0], 3))
    for i in range(vertices_world.shape[0]):
        x, y, z = vertices_world[i, 0], vertices_world[i, 1], vertices_world[i, 2]
        R, t = R_camera_world, t_camera_world
        xc = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + t[0]
        yc = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + t[1]
        zc = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + t[2]
        out[i, 2] = zc
        if zc > NEAR_M:
            out[i, 0] = fx * xc / zc + cx
            out[i, 1] = fy * yc / zc + cy
    return out


@nb.njit(cache=True, inline='always')
def _clip(low, high, at_zero, slope, inverse):
    """Return the part of [low, high] where at_zero + slope * x >= 0, a little too wide."""
    if slope > 1e-6:
        return max(low, -at_zero * inverse - 0.01), high
    if slope < -1e-6:
        return low, min(high, -at_zero * inverse + 0.01)
    return low, high


@nb.njit(cache=True, error_model='numpy')
def draw(uvz, faces, label, u0, v0, depth, labels, closed=False):
    """
    Draw a projected mesh into a window whose first pixel is (u0, v0).

    Triangles with a vertex nearer than NEAR_M are left out. A pixel is covered when its centre
    lies inside or on the border; depth is interpolated linearly in 1 / z.

    :param uvz: (V, 3) float64 from project_vertices.
    :param depth: (h, w) float32, read and written; start with inf.
    :param labels: (h, w) int32, set to `label` where this mesh is nearest; a negative label
        stands for the index of the face.
    :param closed: the mesh is a closed surface wound outwards: faces turned away from the camera
        lie behind others and are not drawn.
    """
    h, w = depth.shape
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        za, zb, zc = uvz[a, 2], uvz[b, 2], uvz[c, 2]
        if za <= NEAR_M or zb <= NEAR_M or zc <= NEAR_M:
            continue
        ax, ay = uvz[a, 0] - u0, uvz[a, 1] - v0
        bx, by = uvz[b, 0] - u0, uvz[b, 1] - v0
        cx, cy = uvz[c, 0] - u0, uvz[c, 1] - v0
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0 or (closed and area > 0.0):
            continue
        x_lo = max(0, int(np.ceil(min(ax, bx, cx))))
        x_hi = min(w - 1, int(np.floor(max(ax, bx, cx))))
        y_lo = max(0, int(np.ceil(min(ay, by, cy))))
        y_hi = min(h - 1, int(np.floor(max(ay, by, cy))))
        if x_lo > x_hi or y_lo > y_hi:
            continue
        ia, ib, ic = 1.0 / (za * area), 1.0 / (zb * area), 1.0 / (zc * area)
        sign = 1.0 if area > 0 else -1.0
        # What a step along x adds to wa, wb and wc below, towards the inside.
        da, db = (by - cy) * sign, (cy - ay) * sign
        dc = -(da + db)
        # Long thin triangles fill little of their window: only the span of a row is walked.
        wide = x_hi - x_lo > 3
        ra, rb, rc = 0.0, 0.0, 0.0
        if wide:
            ra, rb, rc = 1.0 / da, 1.0 / db, 1.0 / dc
        for y in range(y_lo, y_hi + 1):
            low, high = x_lo, x_hi
            if wide:
                wa = (bx * (cy - y) - (by - y) * cx) * sign
                wb = (cx * (ay - y) - (cy - y) * ax) * sign
                left, right = _clip(float(x_lo), float(x_hi), wa, da, ra)
                left, right = _clip(left, right, wb, db, rb)
                left, right = _clip(left, right, area * sign - wa - wb, dc, rc)
                if left > right:
                    continue
                low, high = int(np.ceil(left)), int(np.floor(right))
            for x in range(low, high + 1):
                wa = (bx - x) * (cy - y) - (by - y) * (cx - x)
                wb = (cx - x) * (ay - y) - (cy - y) * (ax - x)
                wc = area - wa - wb
                if wa * sign < 0 or wb * sign < 0 or wc * sign < 0:
                    continue
                z = np.float32(1.0 / (wa * ia + wb * ib + wc * ic))
                if z < depth[y, x]:
                    depth[y, x] = z
                    labels[y, x] = label if label >= 0 else f


@nb.njit(cache=True)
def in_view(vertices_world, R_camera_world, t_camera_world, K, size):
    """Return (projected vertices, their window) in a view of `size` (2,) width and height."""
    uvz = project_vertices(vertices_world, R_camera_world, t_camera_world, K[0, 0], K[1, 1],
                           K[0, 2], K[1, 2])
    return uvz, bounding_window(uvz, size[0], size[1])


@nb.njit(cache=True)
def bounding_window(uvz, width, height):
    """Return (u0, v0, u1, v1), the half-open pixel window of a projected mesh, clipped."""
    u_lo, v_lo, u_hi, v_hi = 1e9, 1e9, -1e9, -1e9
    for i in range(uvz.shape[0]):
        if uvz[i, 2] > NEAR_M:
            u_lo, u_hi = min(u_lo, uvz[i, 0]), max(u_hi, uvz[i, 0])
            v_lo, v_hi = min(v_lo, uvz[i, 1]), max(v_hi, uvz[i, 1])
    if u_lo > u_hi:
        return 0, 0, 0, 0
    u0 = int(min(max(np.ceil(u_lo), 0), width))
    v0 = int(min(max(np.ceil(v_lo), 0), height))
    u1 = int(max(min(np.floor(u_hi) + 1, width), u0))
    v1 = int(max(min(np.floor(v_hi) + 1, height), v0))
    return u0, v0, u1, v1
