# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Sanity checks of intrinsics and lens distortion against the size of the image.

Each check returns None, or one sentence that says what is wrong and how to fix it.
"""

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import rays
from hooc_perception.core.types import Camera
import numpy as np

# The principal point of a lens lies near the middle; one that lies as far from it as these factors
# say, in both directions alike, belongs to an image of another resolution.
LEAST_SCALE, MOST_SCALE, ALIKE = 0.72, 1.4, 0.12
# Of a grid of pixels, how many an acceptable lens maps into the image and without folding it.
LEAST_SHARE = 0.5
_GRID = 24


def scale_trouble(K: Float64Array, width: int, height: int) -> str | None:
    """Check that a camera matrix (3, 3) is for images of this size, not of another resolution."""
    x, y = 2 * K[0, 2] / (width - 1), 2 * K[1, 2] / (height - 1)
    scale = (x + y) / 2
    if LEAST_SCALE < scale < MOST_SCALE or abs(x - y) > ALIKE * abs(scale) or scale <= 0:
        return None
    return (f'its principal point at ({K[0, 2]:.0f}, {K[1, 2]:.0f}), as in images of about '
            f'{2 * K[0, 2]:.0f} x {2 * K[1, 2]:.0f} pixels, but these have {width} x {height}; '
            'give the calibration of this resolution, or scale fx, fy, cx and cy')


def distortion_trouble(camera: Camera) -> str | None:
    """Check that the distortion coefficients of a camera describe a lens."""
    if not np.any(camera.D):
        return None
    K = camera.K
    step = np.array([camera.width, camera.height]) / _GRID
    grid = rays(np.array([[K[0, 0] / step[0], 0, K[0, 2] / step[0]],
                          [0, K[1, 1] / step[1], K[1, 2] / step[1]], [0, 0, 1]]), _GRID, _GRID)
    xd, yd = distorted(grid[..., 0], grid[..., 1], camera.D)
    u, v = K[0, 0] * xd + K[0, 2], K[1, 1] * yd + K[1, 2]
    inside = (u > -0.5) & (u < camera.width) & (v > -0.5) & (v < camera.height)
    (dudv, dudu), (dvdv, dvdu) = np.gradient(u), np.gradient(v)
    with np.errstate(invalid='ignore', over='ignore'):
        upright = dudu * dvdv - dudv * dvdu > 0
    share = (inside & upright).mean()
    if share >= LEAST_SHARE:
        return None
    return (f'distortion coefficients {[float(f"{d:.4g}") for d in camera.D]} that no lens has '
            f'(they leave {share:.0%} of the image); give those of the camera_info of this '
            'resolution and distortion model, or calibrate again')


def distorted(x: Float64Array, y: Float64Array, D: Float64Array) -> tuple[
        Float64Array, Float64Array]:
    """
    Return normalized image coordinates as a lens distorts them.

    :param D: up to 8 coefficients k1 k2 p1 p2 k3 k4 k5 k6 as in CameraInfo (OpenCV, "Camera
        Calibration and 3D Reconstruction").
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = np.pad(np.asarray(D, float)[:8], (0, 8 - len(D[:8])))
    with np.errstate(all='ignore'):
        r2 = x * x + y * y
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        return (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y)
