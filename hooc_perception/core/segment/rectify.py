# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Rectification of raw images: without lens distortion, without skew, without bad readings."""

from dataclasses import replace

from hooc_perception.core.arrays import AnyArray, Float32Array, Int64Array, UInt8Array
from hooc_perception.core.geometry import canonical_pose
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.kernels.undistort import rectify_nearest
from hooc_perception.core.types import Camera, DepthView, RectifiedView
from hooc_perception.errors import HoocError
import numpy as np


def rectify(view: DepthView, config: ObserveConfig = ObserveConfig()) -> RectifiedView:
    """
    Undistort one raw depth image to the same intrinsics.

    Each rectified pixel takes the nearest raw pixel: interpolation would invent surfaces at
    depth edges. Depth along the optical axis does not change under undistortion.

    :param view: `depth` (H, W) float32 metres, NaN = none; readings at its `hidden` pixels are
        discarded.
    :return: RectifiedView whose camera has neither distortion nor skew.
    :raises HoocError: if the image and its calibration disagree in size.
    """
    rectified = undistorted(view)
    rectified.depth[~(rectified.depth <= config.max_depth_m)] = np.nan
    return rectified


def undistorted(view: DepthView) -> RectifiedView:
    """Return the RectifiedView of a raw depth image with readings at any distance."""
    camera = view.camera
    if view.depth.shape != (camera.height, camera.width):
        raise HoocError(
            f'the depth image of camera {camera.name} is {view.depth.shape[1]} x '
            f'{view.depth.shape[0]} pixels, but its calibration is for {camera.width} x '
            f'{camera.height}; record both at the same resolution')
    depth = _undistorted(view.depth, camera)
    depth[~(depth > 0)] = np.nan
    hidden = None
    if view.hidden is not None and view.hidden.any():
        hidden = rectified_numbers(view.hidden, camera) > 0
        depth[hidden] = np.nan
    K = camera.K.copy()
    K[0, 1] = 0
    # The pose travels to other processes as a quaternion and must mean the same there.
    return RectifiedView(replace(camera, K=K, D=np.zeros(len(camera.D)),
                                 T_world_camera=canonical_pose(camera.T_world_camera)), depth,
                         hidden)


def rectified_numbers(image: AnyArray, camera: Camera) -> UInt8Array:
    """
    Undistort an image of small integers exactly as `rectify` undistorts depth.

    :param image: (H, W) raw numbers 0..255, for instance reading counts.
    :return: (H, W) uint8, 0 where the ray leaves the raw image.
    """
    return np.nan_to_num(_undistorted(image, camera)).astype(np.uint8)


def raw_pixels(camera: Camera) -> Int64Array:
    """Return (H, W) int64 flat indices: the raw pixel that each rectified one takes or -1."""
    size = camera.width * camera.height
    # float32 holds whole numbers up to 2^24 exactly: two halves are enough for any image.
    index = np.arange(size).reshape(camera.height, camera.width)
    high, low = (_undistorted(half, camera) for half in (index >> 12, index & 0xfff))
    known = np.isfinite(high)
    return np.where(known, (np.where(known, high, 0).astype(np.int64) << 12)
                    + np.where(known, low, 0).astype(np.int64), -1)


def _undistorted(image: AnyArray, camera: Camera) -> Float32Array:
    """Return a raw image (H, W) as float32 without the lens distortion and skew of its camera."""
    d = np.zeros(8)
    d[:len(camera.D)] = camera.D[:8]
    return rectify_nearest(np.ascontiguousarray(image, np.float32),
                           np.ascontiguousarray(camera.K, np.float64), d)
