# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Intrinsics in the forms that ROS writes them, as an entry of cameras.yaml.

Two forms are known: the calibration file of camera_calibration and camera_info_manager
(image_width, camera_matrix, ...), and a sensor_msgs/CameraInfo message as `ros2 topic echo --once`
(k, d, ...) or ROS 1 (K, D, R, P) prints it. Neither has a pose.
"""

from typing import Any

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import fields

OWN_KEYS = ('world_from_camera', 'sensor')
FILE_KEYS = ('image_width', 'image_height', 'camera_name', 'camera_matrix', 'distortion_model',
             'distortion_coefficients', 'rectification_matrix', 'projection_matrix')
_MESSAGE_KEYS = ('header', 'width', 'height', 'distortion_model', 'binning_x', 'binning_y', 'roi',
                 'camera_name')


def is_camera_info(entry: dict[str, Any]) -> bool:
    """Return whether a mapping has the form of a calibration file or of a CameraInfo message."""
    return ('camera_matrix' in entry or 'image_width' in entry or 'k' in entry
            or 'K' in entry and ('P' in entry or 'R' in entry))


def from_camera_info(entry: dict[str, Any], where: str) -> dict[str, Any]:
    """
    Return an entry of cameras.yaml; without world_from_camera if `entry` has none.

    :param where: names file and camera in the error.
    :raises HoocError: an unknown key, binning or a region of interest.
    """
    if 'camera_matrix' in entry or 'image_width' in entry:
        fields.closed(entry, (*FILE_KEYS, *OWN_KEYS), where)
        names = {'width': 'image_width', 'height': 'image_height', 'K': 'camera_matrix',
                 'D': 'distortion_coefficients'}
    else:
        letters = 'kdrp' if 'k' in entry else 'KDRP'
        fields.closed(entry, (*_MESSAGE_KEYS, *letters, *OWN_KEYS), where)
        names = {'width': 'width', 'height': 'height', 'K': letters[0], 'D': letters[1]}
        _check_whole(entry, where)
    found = {key: _numbers(fields.required(entry, name, where), f'{where} {name}')
             for key, name in names.items() if key != 'D' or name in entry}
    return {**found, **{key: entry[key] for key in ('distortion_model', *OWN_KEYS)
                        if key in entry}}


def _numbers(value: Any, where: str) -> Any:
    """Return the list of a matrix that is written as {rows, cols, data}; others as they are."""
    if not isinstance(value, dict):
        return value
    return fields.required(fields.closed(value, ('rows', 'cols', 'data', 'dt'), where), 'data',
                           where)


def _check_whole(entry: dict[str, Any], where: str) -> None:
    """Refuse the intrinsics of images that are binned or cut out."""
    for key in ('binning_x', 'binning_y'):
        if entry.get(key, 0) not in (0, 1):
            raise HoocError(f'{where} {key} is {fields.short_repr(entry[key])}; give the '
                            'calibration of the images as they are, without binning')
    roi = fields.mapping(entry.get('roi') or {}, f'{where} roi')
    if any(roi.get(key) for key in ('x_offset', 'y_offset')):
        raise HoocError(f'{where} roi begins at ({roi.get("x_offset")}, {roi.get("y_offset")}); '
                        'give the calibration of the images as they are, not of the full sensor')
