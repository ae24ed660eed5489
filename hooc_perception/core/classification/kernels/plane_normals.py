# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Normals of depth pixels by a plane fit in inverse depth, for the features of the classifier.

The other estimator, `core.frame.kernels.field.normals_of_view`, takes the principal components
of 3D neighbours within a radius and serves geometry: hypotheses and the fused cloud. This one
works on the image grid and also returns how well the plane fits, which is a feature. Trained
forests depend on its values to the last bit, so neither can replace the other.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import Float32Array, Float64Array, Int64Array
import numba as nb
import numpy as np

# A plane is fitted to at least this many pixels whose scatter is not on one line.
FEWEST_PIXELS, LEAST_SCATTER = 5, 1e-6


class Window(NamedTuple):
    """
    Which neighbours support a plane.

    :ivar half: the window is 2 half + 1 pixels wide and high.
    :ivar gate_m: neighbours whose depth differs by more belong to another surface.
    """

    half: int
    gate_m: float


@nb.njit(cache=True)
def _fitted_plane(depth: Float32Array, row: int, col: int, K: Float64Array,
                  window: Window) -> tuple[float, float, float, float]:
    """
    Fit d0 / d = a0 x + a1 y + a2 around a pixel of depth d0, x and y normalised and relative.

    :return: (a0, a1, a2, number of pixels in the window that pass the gate).
    """
    h, w = depth.shape
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    d0 = depth[row, col]
    x0, y0 = (col - cx) / fx, (row - cy) / fy
    sxx, sxy, syy, sx, sy, s = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    bx, by, b = 0.0, 0.0, 0.0
    for rr in range(max(0, row - window.half), min(h, row + window.half + 1)):
        for cc in range(max(0, col - window.half), min(w, col + window.half + 1)):
            d = depth[rr, cc]
            if abs(d - d0) < window.gate_m:
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
    if s >= FEWEST_PIXELS and det > LEAST_SCATTER * (c00 + c11) ** 2:
        e0, e1 = bx - sx * b / s, by - sy * b / s
        a0 = (c11 * e0 - c01 * e1) / det
        a1 = (c00 * e1 - c01 * e0) / det
        a2 = (b - a0 * sx - a1 * sy) / s
    return a0, a1, a2, s


@nb.njit(cache=True)
def _residual(depth: Float32Array, row: int, col: int, K: Float64Array, window: Window,
              plane: tuple[float, float, float]) -> float:
    """Return the sum over the window of the absolute residuals of a `_fitted_plane`."""
    h, w = depth.shape
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    d0 = depth[row, col]
    x0, y0 = (col - cx) / fx, (row - cy) / fy
    a0, a1, a2 = plane
    total = 0.0
    for rr in range(max(0, row - window.half), min(h, row + window.half + 1)):
        for cc in range(max(0, col - window.half), min(w, col + window.half + 1)):
            d = depth[rr, cc]
            if abs(d - d0) < window.gate_m:
                x, y = (cc - cx) / fx - x0, (rr - cy) / fy - y0
                total += abs(d0 / d - a0 * x - a1 * y - a2)
    return total


@nb.njit(cache=True)
def plane_normals(depth: Float32Array, rows: Int64Array, cols: Int64Array, K: Float64Array,
                  R_world_camera: Float64Array,
                  window: Window) -> tuple[Float32Array, Float32Array]:
    """
    Return normals in the world that face the camera, and the plane residuals.

    On a plane 1 / z is affine in the normalised image coordinates: a 3 x 3 least squares fit
    over the window gives the plane n . X = 1 in the camera frame.

    :param depth: (H, W) float32 metres, NaN = none; rows, cols (n,) the pixels, with a reading.
    :return: (n, 3) float32 normals and (n,) float32 mean absolute residuals in metres; a
        normal along the ray where fewer than five neighbours support the fit.
    """
    n = rows.shape[0]
    out = np.empty((n, 3), np.float32)
    residual = np.empty(n, np.float32)
    for i in range(n):
        r, c = rows[i], cols[i]
        x0, y0 = (c - K[0, 2]) / K[0, 0], (r - K[1, 2]) / K[1, 1]
        a0, a1, a2, s = _fitted_plane(depth, r, c, K, window)
        residual[i] = depth[r, c] * _residual(depth, r, c, K, window, (a0, a1, a2)) / s
        nx, ny = a0, a1
        nz = a2 - a0 * x0 - a1 * y0
        if s < FEWEST_PIXELS:
            nx, ny, nz = x0, y0, 1.0
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        sign = -1.0 if nx * x0 + ny * y0 + nz > 0 else 1.0
        for k in range(3):
            out[i, k] = sign * (R_world_camera[k, 0] * nx + R_world_camera[k, 1] * ny
                                + R_world_camera[k, 2] * nz) / length
    return out, residual
