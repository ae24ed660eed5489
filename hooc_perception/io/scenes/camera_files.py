# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read and write cameras.yaml: intrinsics, lens distortion and pose of every camera."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import matrix_from_pose, pose_from_matrix
from hooc_perception.core.segment.checks import skew_trouble
from hooc_perception.core.segment.lens_checks import distortion_trouble, scale_trouble
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import fields, files
from hooc_perception.io.scenes.camera_info_file import from_camera_info, is_camera_info, OWN_KEYS
import numpy as np
import yaml

# Allowed numbers of coefficients per distortion model; shorter ones are padded with zeros.
COEFFICIENTS = {'plumb_bob': (4, 5), 'rational_polynomial': (8,)}
# `sensor` names the kind of the camera, such as kinect_v2; nobody reads it yet.
KEYS = ('width', 'height', 'distortion_model', 'K', 'D', *OWN_KEYS)
# Quaternions rounded to three decimals pass; quaternions that were never normalised do not.
QUATERNION_TOLERANCE = 1e-3


def load_cameras(path: str | Path, posed: bool = True) -> dict[str, Camera]:
    """
    Return {name: Camera} of a cameras.yaml, in the file's order.

    An entry may also have the form of a ROS calibration file or CameraInfo message, or name such
    a file under `camera_info`; a file that is one describes a single camera.

    :param posed: False accepts cameras without world_from_camera, at the origin of their world.
    :raises HoocError: one sentence that names file, camera and field.
    """
    path = Path(path)
    entries = files.read_yaml(path)
    if not entries:
        raise HoocError(f'{path}: no camera is described; add one entry per camera')
    if is_camera_info(entries):
        name = str(entries.get('camera_name') or 'camera').strip('/').replace('/', '_')
        entries = {name: entries}
    return {fields.ros_token(key, f'{path}: a camera name'):
            _camera(key, _entry(entry, path, f'{path}: {key}:'), f'{path}: {key}:', posed)
            for key, entry in entries.items()}


def _entry(entry: object, path: Path, where: str) -> dict[str, Any]:
    """Return an entry in our own form."""
    entry = fields.mapping(entry, where)
    if 'camera_info' in entry:
        fields.closed(entry, ('camera_info', *OWN_KEYS), where)
        file = files.file_inside(path.parent, entry['camera_info'], f'{where} camera_info')
        info = files.read_yaml(file)
        if not is_camera_info(info):
            raise HoocError(f'{file}: neither a calibration file (camera_matrix, image_width) nor '
                            'a CameraInfo message (k, d); correct camera_info')
        return {**from_camera_info(info, f'{file}:'),
                **{key: entry[key] for key in OWN_KEYS if key in entry}}
    return from_camera_info(entry, where) if is_camera_info(entry) else fields.closed(
        entry, KEYS, where)


def write_cameras(path: str | Path, cameras: Iterable[Camera]) -> None:
    """Write a cameras.yaml."""
    entries = {}
    for camera in cameras:
        translation, rotation = pose_from_matrix(camera.T_world_camera)
        entries[camera.name] = {
            'width': int(camera.width), 'height': int(camera.height),
            'distortion_model': camera.distortion_model,
            'K': np.ravel(camera.K).tolist(), 'D': np.ravel(camera.D).tolist(),
            'world_from_camera': {'translation': translation.tolist(),
                                  'rotation_xyzw': rotation.tolist()}}
    files.write_atomically(path, yaml.safe_dump(entries, sort_keys=False,
                                                default_flow_style=None, width=99))


def pose(entry: object, where: str) -> tuple[Float64Array, Float64Array]:
    """Return (translation (3,), unit rotation_xyzw (4,)) of a mapping with these two keys."""
    entry = fields.mapping(entry, where)
    translation = fields.numbers(fields.required(entry, 'translation', where), 3,
                                 f'{where} translation')
    return translation, rotation(fields.required(entry, 'rotation_xyzw', where),
                                 f'{where} rotation_xyzw')


def rotation(value: object, where: str) -> Float64Array:
    """Return the normalised quaternion (4,) xyzw; reject one whose length is not 1."""
    quaternion = fields.numbers(value, 4, where)
    norm = np.linalg.norm(quaternion)
    if abs(norm - 1) > QUATERNION_TOLERANCE:
        raise HoocError(f'{where} has length {norm:.6g}; give a unit quaternion [x, y, z, w]')
    return quaternion / norm


def intrinsics(value: object, width: int, height: int, where: str) -> Float64Array:
    """
    Return the (3, 3) camera matrix of nine row-major numbers after checking it.

    A skew is kept: `core.segment.rectify.rectify` removes it together with the distortion.
    """
    K = fields.numbers(value, 9, where).reshape(3, 3)
    if K[0, 0] <= 0 or K[1, 1] <= 0 or K[1, 0] or any(K[2] != (0, 0, 1)):
        raise HoocError(f'{where} is singular or not a camera matrix; '
                        'give [fx, 0, cx, 0, fy, cy, 0, 0, 1] with fx, fy > 0')
    if trouble := skew_trouble(K):
        raise HoocError(f'{where} has {trouble}')
    if not (-width < K[0, 2] < 2 * width and -height < K[1, 2] < 2 * height):
        raise HoocError(f'{where} has its centre ({K[0, 2]:g}, {K[1, 2]:g}) far outside the '
                        f'{width} x {height} image; give pixels, row by row')
    if trouble := scale_trouble(K, width, height):
        raise HoocError(f'{where} has {trouble}')
    return K


def distortion(value: object, model: Any, where: str) -> Float64Array:
    """Return the distortion coefficients, padded or cut (of zeros) to the model's full length."""
    if model not in COEFFICIENTS:
        raise HoocError(f'{where} distortion_model is {fields.short_repr(model)}; '
                        f'use one of {", ".join(COEFFICIENTS)}')
    D = fields.numbers(value, None, f'{where} D')
    if len(D) > COEFFICIENTS[model][-1] and not D[COEFFICIENTS[model][-1]:].any():
        # OpenCV writes 8, 12 or 14 numbers for the same lens.
        D = D[:COEFFICIENTS[model][-1]]
    if len(D) not in (0, *COEFFICIENTS[model]):
        wanted = ' or '.join(map(str, COEFFICIENTS[model]))
        raise HoocError(f'{where} D has {len(D)} numbers; {model} takes {wanted}')
    return np.pad(D, (0, COEFFICIENTS[model][-1] - len(D)))


def _camera(name: str, entry: dict[str, Any], where: str, posed: bool) -> Camera:
    """Return the Camera of one entry."""
    width, height = (fields.integer(fields.required(entry, side, where), 1, fields.MAX_SIDE,
                                    f'{where} {side}') for side in ('width', 'height'))
    model = entry.get('distortion_model', 'plumb_bob')
    K = intrinsics(fields.required(entry, 'K', where), width, height, f'{where} K')
    D = distortion(entry.get('D', []), model, where)
    T_world_camera = np.eye(4)
    if posed or 'world_from_camera' in entry:
        if 'world_from_camera' not in entry:
            raise HoocError(f'{where} world_from_camera is missing; add it ({{translation: [x, y, '
                            'z], rotation_xyzw: [x, y, z, w]}), for a calibration has no pose')
        placed = fields.mapping(entry['world_from_camera'], f'{where} world_from_camera:')
        fields.closed(placed, ('translation', 'rotation_xyzw'), f'{where} world_from_camera:')
        T_world_camera = matrix_from_pose(*pose(placed, f'{where} world_from_camera:'))
    camera = Camera(name, width, height, K, D, T_world_camera, model)
    if trouble := distortion_trouble(camera):
        raise HoocError(f'{where} has {trouble}')
    return camera
