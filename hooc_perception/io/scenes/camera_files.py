# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read and write cameras.yaml: intrinsics, lens distortion and pose of every camera."""

from hooc_perception.core.geometry import matrix_from_pose, pose_from_matrix
from hooc_perception.core.segment.checks import skew_trouble
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import files
import numpy as np
import yaml

# Number of coefficients each model may have; shorter ones are padded with zeros.
COEFFICIENTS = {'plumb_bob': (4, 5), 'rational_polynomial': (8,)}
# A quaternion typed with three decimals is off by less; one that was never normalised is not.
QUATERNION_TOLERANCE = 1e-3


def load_cameras(path):
    """
    Return {name: Camera} of a cameras.yaml, in the file's order.

    :raises HoocError: one sentence that names file, camera and field.
    """
    entries = files.read_yaml(path)
    if not entries:
        raise HoocError(f'{path}: no camera is described; add one entry a camera')
    return {files.ros_token(key, f'{path}: a camera name'): _camera(key, entry, f'{path}: {key}:')
            for key, entry in entries.items()}


def write_cameras(path, cameras):
    """Write a cameras.yaml of a sequence of Camera."""
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


def pose(entry, where):
    """Return (translation (3,), unit rotation_xyzw (4,)) of a mapping with these two keys."""
    entry = files.mapping(entry, where)
    translation = files.numbers(files.required(entry, 'translation', where), 3,
                                f'{where} translation')
    return translation, rotation(files.required(entry, 'rotation_xyzw', where),
                                 f'{where} rotation_xyzw')


def rotation(value, where):
    """Return the exactly normalised quaternion (4,) xyzw; refuse one that is none."""
    quaternion = files.numbers(value, 4, where)
    norm = np.linalg.norm(quaternion)
    if abs(norm - 1) > QUATERNION_TOLERANCE:
        raise HoocError(f'{where} has length {norm:.6g}; give a unit quaternion [x, y, z, w]')
    return quaternion / norm


def intrinsics(value, width, height, where):
    """
    Return the (3, 3) camera matrix of nine row-major numbers, checked to be usable.

    A skew is kept: `core.segment.rectify.rectify` takes it out with the lens distortion.
    """
    K = files.numbers(value, 9, where).reshape(3, 3)
    if K[0, 0] <= 0 or K[1, 1] <= 0 or K[1, 0] or any(K[2] != (0, 0, 1)):
        raise HoocError(f'{where} is singular or no camera matrix; '
                        'give [fx, 0, cx, 0, fy, cy, 0, 0, 1] with fx, fy > 0')
    if trouble := skew_trouble(K):
        raise HoocError(f'{where} has {trouble}')
    if not (-width < K[0, 2] < 2 * width and -height < K[1, 2] < 2 * height):
        raise HoocError(f'{where} has its centre ({K[0, 2]:g}, {K[1, 2]:g}) far outside of the '
                        f'{width} x {height} image; give pixels, row by row')
    return K


def distortion(value, model, where):
    """Return the coefficients, padded or cut (of zeros) to the model's full length."""
    if model not in COEFFICIENTS:
        raise HoocError(f'{where} distortion_model is {files.shown(model)}; '
                        f'use one of {", ".join(COEFFICIENTS)}')
    D = files.numbers(value, None, f'{where} D')
    if len(D) > COEFFICIENTS[model][-1] and not D[COEFFICIENTS[model][-1]:].any():
        # OpenCV writes 8, 12 or 14 numbers for one and the same lens.
        D = D[:COEFFICIENTS[model][-1]]
    if len(D) not in (0, *COEFFICIENTS[model]):
        wanted = ' or '.join(map(str, COEFFICIENTS[model]))
        raise HoocError(f'{where} D has {len(D)} numbers; {model} takes {wanted}')
    return np.pad(D, (0, COEFFICIENTS[model][-1] - len(D)))


def _camera(name, entry, where):
    """Return the Camera of one entry of cameras.yaml."""
    entry = files.mapping(entry, where)
    width = files.whole(files.required(entry, 'width', where), 1, files.MAX_SIDE, f'{where} width')
    height = files.whole(files.required(entry, 'height', where), 1, files.MAX_SIDE,
                         f'{where} height')
    model = entry.get('distortion_model', 'plumb_bob')
    translation, quaternion = pose(files.required(entry, 'world_from_camera', where),
                                   f'{where} world_from_camera:')
    return Camera(name, width, height,
                  intrinsics(files.required(entry, 'K', where), width, height, f'{where} K'),
                  distortion(entry.get('D', []), model, where),
                  matrix_from_pose(translation, quaternion), model)
