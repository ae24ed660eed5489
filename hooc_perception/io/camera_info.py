# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The camera that a CameraInfo message describes; one rule for bags and live nodes.

Binning, region of interest and rectification are as in sensor_msgs/CameraInfo and
image_geometry's PinholeCameraModel (fromCameraInfo).
"""

import re
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.segment.lens_checks import distortion_trouble
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import camera_files
import numpy as np

# Other names for plumb_bob: of drivers that leave it out, and of images without distortion.
_PLUMB_BOB = ('', 'none', 'pinhole', 'radtan', 'brown_conrady')
# Not image_rect_raw: what realsense2 calls so is described by its K and D as any raw image is.
_RECTIFIED = re.compile(r'(^|_)rect(ified)?($|_(?!raw))')


class SizeMismatch(HoocError):
    """Image and calibration are of different sizes."""


def is_rectified(image_topic: str) -> bool:
    """Return whether a topic carries rectified images, as its last name says: image_rect."""
    return bool(_RECTIFIED.search(image_topic.rpartition('/')[2]))


def camera_from_info(name: str, info: Any, size: tuple[int, int] | None, rectified: bool,
                     where: str) -> Camera:
    """
    Return the Camera, without a pose, of the images that a CameraInfo belongs to.

    :param info: CameraInfo message of ROS 2.
    :param size: (width, height) of the images; None takes that of the calibration.
    :param rectified: the images are free of distortion, so that P holds and not K and D.
    :param where: names the message in errors.
    :raises SizeMismatch: if the calibration is for another size.
    :raises HoocError: if it is no calibration of a pinhole camera; names the field.
    """
    if not info.width or not info.height:
        raise HoocError(f'{where} says {info.width} x {info.height} pixels; the driver must fill '
                        'in width and height')
    size = size or (info.width, info.height)
    K = np.reshape(np.asarray(info.k, np.float64), (3, 3))
    P = np.reshape(np.asarray(info.p, np.float64), (3, 4))[:, :3]
    if not K.any() and not (rectified and P.any()):
        raise HoocError(f'{where} holds no calibration (K is zero); calibrate the camera, or give '
                        'its driver the calibration file')
    used, matrix = ('P', P) if rectified and P.any() else ('K', K)
    matrix = camera_files.intrinsics(matrix.ravel().tolist(), info.width, info.height,
                                     f'{where} {used}')
    matrix = _of_image(matrix, info, size, where)
    if rectified:
        return Camera(name, *size, matrix, np.zeros(5), np.eye(4))
    model = info.distortion_model.lower() if info.distortion_model else ''
    model = 'plumb_bob' if model in _PLUMB_BOB else model
    if model not in camera_files.COEFFICIENTS:
        raise HoocError(f'{where} uses distortion model {model!r}; calibrate with '
                        f'{" or ".join(camera_files.COEFFICIENTS)}, or record rectified images '
                        '(image_rect)')
    D = camera_files.distortion(np.asarray(info.d, np.float64).tolist(), model, where)
    camera = Camera(name, *size, matrix, D, np.eye(4), model)
    if trouble := distortion_trouble(camera):
        raise HoocError(f'{where} has {trouble}')
    return camera


def _of_image(K: Float64Array, info: Any, size: tuple[int, int], where: str) -> Float64Array:
    """Return a camera matrix of the full resolution for images that are cut out or binned."""
    full, roi = (info.width, info.height), info.roi
    cut = ((roi.width, roi.height) if roi.width and roi.height
           else (info.width - roi.x_offset, info.height - roi.y_offset))
    binning = max(info.binning_x, 1), max(info.binning_y, 1)
    # Some drivers state a binning that they have put into K, or do not apply.
    for pixels, corner, bins in ((full, (0, 0), (1, 1)),
                                 (cut, (roi.x_offset, roi.y_offset), (1, 1)),
                                 (cut, (roi.x_offset, roi.y_offset), binning)):
        if all(abs(pixels[i] / bins[i] - size[i]) < 1 for i in (0, 1)):
            K = K.copy()
            K[0, 2] -= corner[0]
            K[1, 2] -= corner[1]
            K[0] /= bins[0]
            K[1] /= bins[1]
            return K
    stated = ''.join((
        f', cut to {cut[0]} x {cut[1]}' if cut != full else '',
        f', binned by {binning[0]} x {binning[1]}' if binning != (1, 1) else ''))
    alike = abs(size[0] / full[0] - size[1] / full[1]) < 0.01
    fix = ('publish the camera_info of the scaled images, or state binning_x and binning_y'
           if alike else 'publish both at the same resolution')
    raise SizeMismatch(f'{where} says width {full[0]} and height {full[1]}{stated}, but the '
                       f'images have {size[0]} x {size[1]} pixels; {fix}')
