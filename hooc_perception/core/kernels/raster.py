# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Z-buffer rasterization of triangle meshes: the nearest surface wins, both sides are drawn."""

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array, Int64Array
import numba as nb
import numpy as np

# Triangles with a vertex nearer to the camera's centre than this are left out.
NEAR_M = 0.05
# Rows wider than this many pixels are cut to the span of the triangle before they are walked.
NARROW_PX = 3
# Spans are this much too wide, so that rounding never cuts off a covered pixel.
SLACK_PX = 0.01

Triple = tuple[float, float, float]


@nb.njit(cache=True)
def project_vertices(vertices_world: Float64Array, R_camera_world: Float64Array,
                     t_camera_world: Float64Array, fx: float, fy: float, cx: float,
                     cy: float) -> Float64Array:
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
def _clip(low: float, high: float, at_zero: float, slope: float,
          inverse: float) -> tuple[float, float]:
    """Return the part of [low, high] where at_zero + slope * x >= 0, a little too wide."""
    if slope > 1e-6:
        return max(low, -at_zero * inverse - SLACK_PX), high
    if slope < -1e-6:
        return low, min(high, -at_zero * inverse + SLACK_PX)
    return low, high


@nb.njit(cache=True, inline='always')
def _span(x_lo: int, x_hi: int, at_zero: Triple, slope: Triple,
          inverse: Triple) -> tuple[float, float]:
    """Return the part of a row where all three edge functions at_zero + slope * x are >= 0."""
    left, right = _clip(float(x_lo), float(x_hi), at_zero[0], slope[0], inverse[0])
    left, right = _clip(left, right, at_zero[1], slope[1], inverse[1])
    return _clip(left, right, at_zero[2], slope[2], inverse[2])


@nb.njit(cache=True, inline='always')
def _range(a: float, b: float, c: float, n: int) -> tuple[int, int]:
    """Return the first and the last of n pixels whose centres three coordinates enclose."""
    return max(0, int(np.ceil(min(a, b, c)))), min(n - 1, int(np.floor(max(a, b, c))))


@nb.njit(cache=True, error_model='numpy')
def draw(uvz: Float64Array, faces: Int32Array, label: int, u0: int, v0: int, depth: Float32Array,
         labels: Int32Array, closed: bool = False) -> None:
    """
    Draw a projected mesh into a window whose first pixel is (u0, v0).

    Triangles with a vertex nearer than NEAR_M are left out. A pixel is covered when its centre
    lies inside or on the border, which the signs of the three edge functions wa, wb, wc tell;
    depth is interpolated linearly in 1 / z.

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
        x_lo, x_hi = _range(ax, bx, cx, w)
        y_lo, y_hi = _range(ay, by, cy, h)
        if x_lo > x_hi or y_lo > y_hi:
            continue
        ia, ib, ic = 1.0 / (za * area), 1.0 / (zb * area), 1.0 / (zc * area)
        sign = 1.0 if area > 0 else -1.0
        # What a step along x adds to wa, wb and wc, towards the inside.
        da, db = (by - cy) * sign, (cy - ay) * sign
        slope = da, db, -(da + db)
        # Long thin triangles fill little of their window: only the span of a row is walked.
        wide = x_hi - x_lo > NARROW_PX
        inverse = (1.0 / slope[0], 1.0 / slope[1], 1.0 / slope[2]) if wide else (0.0, 0.0, 0.0)
        for y in range(y_lo, y_hi + 1):
            low, high = x_lo, x_hi
            if wide:
                wa = (bx * (cy - y) - (by - y) * cx) * sign
                wb = (cx * (ay - y) - (cy - y) * ax) * sign
                left, right = _span(x_lo, x_hi, (wa, wb, area * sign - wa - wb), slope, inverse)
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
def in_view(vertices_world: Float64Array, R_camera_world: Float64Array,
            t_camera_world: Float64Array, K: Float64Array, size: Int64Array,
            ) -> tuple[Float64Array, tuple[int, int, int, int]]:
    """Return (projected vertices, their window) in a view of `size` (2,) width and height."""
    uvz = project_vertices(vertices_world, R_camera_world, t_camera_world, K[0, 0], K[1, 1],
                           K[0, 2], K[1, 2])
    return uvz, bounding_window(uvz, size[0], size[1])


@nb.njit(cache=True)
def bounding_window(uvz: Float64Array, width: int, height: int) -> tuple[int, int, int, int]:
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
