# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Brown-Conrady undistortion of depth images, nearest raw pixel."""

from hooc_perception.core.arrays import Float32Array, Float64Array
import numba as nb
import numpy as np


@nb.njit(cache=True)
def rectify_nearest(depth: Float32Array, K: Float64Array, d: Float64Array) -> Float32Array:
    """
    Return the undistorted image: each pixel takes the raw pixel that its ray hits.

    The distortion model is that of sensor_msgs/CameraInfo (plumb_bob, rational_polynomial).

    :param depth: (H, W) float32, raw.
    :param K: (3, 3) float64 of both the raw and the rectified image, which has no skew.
    :param d: (8,) float64: k1 k2 p1 p2 k3 k4 k5 k6 as in CameraInfo (plumb_bob: k4..k6 = 0).
    :return: (H, W) float32, NaN where the ray leaves the raw image.
    """
    h, w = depth.shape
    out = np.full((h, w), np.nan, np.float32)
    for v in range(h):
        for u in range(w):
            x = (u - K[0, 2]) / K[0, 0]
            y = (v - K[1, 2]) / K[1, 1]
            r2 = x * x + y * y
            top = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]))
            bottom = 1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]))
            f = top / bottom
            xd = x * f + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x)
            yd = y * f + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y
            ud = int(np.floor(xd * K[0, 0] + K[0, 1] * yd + K[0, 2] + 0.5))
            vd = int(np.floor(yd * K[1, 1] + K[1, 2] + 0.5))
            if 0 <= ud < w and 0 <= vd < h:
                out[v, u] = depth[vd, ud]
    return out
