# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Read calibrations of Bouguet's Camera Calibration Toolbox for Matlab.

Both forms are read: Calib_Results.mat and the text file Calib_Results.m. The toolbox's pixel
coordinates (0, 0 = centre of the first pixel) and its kc = [k1, k2, p1, p2, k3] follow the same
conventions as this package. Its extrinsics map points of the calibration board into the camera:
X_camera = R X_board + T.
"""

from collections.abc import Sequence
import io
from pathlib import Path
import re
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import inverse
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import camera_files, fields, files
import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

# A .mat may contain the calibration images, too.
MAX_MAT_BYTES = 512 << 20
_ASSIGNMENT = re.compile(r'^[ \t]*([A-Za-z]\w*)[ \t]*=[ \t]*(\[[^\]]*\]|[-+.\w]+)', re.MULTILINE)
_COMMENT = re.compile(r'%[^\n]*|\.\.\.[^\n]*\n')


def load_bouguet(path: str | Path, name: str, view: int | str | None = None,
                 unit: float = 0.001) -> Camera:
    """
    Return the Camera of a calibration; its world is the calibration board's frame.

    :param path: Calib_Results.mat or .m; that of a stereo pair if it has fc_left and so on.
    :param name: of the resulting camera.
    :param view: number of the calibration image whose board is the world (omc_<view>,
        Tc_<view>); None takes R, T or om, T if the file has them, else image 1. 'left' and
        'right' are the cameras of a stereo pair; the world is then the left camera.
    :param unit: metres per unit in which the board was measured.
    :raises HoocError: one sentence that names file, field and fix.
    """
    values = _Values(path)
    side = f'_{view}' if view in ('left', 'right') else ''
    width, height = (int(values.get(key, 1)[0]) for key in ('nx', 'ny'))
    for key, length in (('nx', width), ('ny', height)):
        fields.integer(length, 1, fields.MAX_SIDE, f'{path}: {key}')
    fc, cc = values.get(f'fc{side}', 2), values.get(f'cc{side}', 2)
    skew = values.get(f'alpha_c{side}', 1)[0] if f'alpha_c{side}' in values else 0.0
    K = camera_files.intrinsics(
        [fc[0], skew * fc[0], cc[0], 0.0, fc[1], cc[1], 0.0, 0.0, 1.0], width, height,
        f'{path}: fc{side}, cc{side}, alpha_c{side}')
    D = values.get(f'kc{side}') if f'kc{side}' in values else np.zeros(5)
    D = camera_files.distortion(D.tolist(), 'plumb_bob', f'{path}: kc{side}')
    T_camera_world = np.eye(4) if view == 'left' else _extrinsics(values, view, unit)
    return Camera(fields.ros_token(name, f'{path}: the name of its camera'), width, height, K, D,
                  inverse(T_camera_world))


def upright(cameras: Sequence[Camera]) -> tuple[Camera, ...]:
    """
    Return the cameras in a world whose z axis points to their side of the board, as a table's.

    Whether the board's own z axis does depends on the order in which its corners were clicked.
    """
    if np.mean([camera.T_world_camera[2, 3] for camera in cameras]) >= 0:
        return tuple(cameras)
    half_turn = np.diag([1.0, -1.0, -1.0, 1.0])
    return tuple(Camera(c.name, c.width, c.height, c.K, c.D, half_turn @ c.T_world_camera)
                 for c in cameras)


def _extrinsics(values: '_Values', view: int | str | None, unit: float) -> Float64Array:
    """Return T_camera_world (4, 4) in metres."""
    if view in (None, 'right') and 'T' in values and ('R' in values or 'om' in values):
        rotation, turn, translation = 'R', 'om', 'T'
    elif view == 'right':
        raise HoocError(f'{values.path}: R and T of the stereo pair are missing; '
                        'give Calib_Results_stereo')
    else:
        number = view or 1
        rotation, turn, translation = f'Rc_{number}', f'omc_{number}', f'Tc_{number}'
    T = np.eye(4)
    if rotation in values:
        R = values.get(rotation, 9).reshape(3, 3)
        if abs(R @ R.T - np.eye(3)).max() > 1e-3 or np.linalg.det(R) < 0:
            raise HoocError(f'{values.path}: {rotation} is not a rotation; calibrate again')
        T[:3, :3] = Rotation.from_matrix(R).as_matrix()
    else:
        T[:3, :3] = Rotation.from_rotvec(values.get(turn, 3)).as_matrix()
    T[:3, 3] = unit * values.get(translation, 3)
    return T


class _Values:
    """The numeric variables of a calibration file, by name, in row-major order."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._values: dict[str, list[Any]]
        if self.path.suffix == '.mat':
            self._values = _read_mat(self.path)
        elif self.path.suffix == '.m':
            self._values = _read_m(self.path)
        else:
            raise HoocError(f"{path}: not a calibration of Bouguet's toolbox; "
                            'give Calib_Results.mat or Calib_Results.m')

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def get(self, key: str, count: int | None = None) -> Float64Array:
        """Return the numbers (n,) of a variable after checking that they are `count` finite."""
        where = f'{self.path}: {key}'
        if key not in self._values:
            raise HoocError(f'{where} is missing; save the calibration with all results')
        return fields.numbers(self._values[key], count, where)


def _read_mat(path: Path) -> dict[str, list[Any]]:
    """Return {name: list of numbers} of a .mat file up to version 7."""
    data = files.read_bytes(path, MAX_MAT_BYTES)
    wanted = re.compile(r'(fc|cc|kc|alpha_c)(_left|_right)?|nx|ny|R|T|om|(Rc|Tc|omc)_\d+')
    try:
        content = loadmat(io.BytesIO(data))
        return {key: np.asarray(value, np.float64).ravel().tolist()
                for key, value in content.items() if wanted.fullmatch(key)}
    except NotImplementedError:
        raise HoocError(f'{path}: a .mat of version 7.3; save it again with -v7') from None
    # On a damaged file scipy raises almost anything.
    except Exception:
        raise HoocError(f'{path}: not a readable .mat; save the calibration again') from None


def _read_m(path: Path) -> dict[str, list[Any]]:
    """Return {name: list of numbers as text} of a .m file's assignments; nothing is executed."""
    text = files.read_bytes(path, files.MAX_YAML_BYTES).decode('utf-8', 'replace')
    values = {}
    for name, value in _ASSIGNMENT.findall(_COMMENT.sub('\n', text)):
        values[name] = re.split(r'[\s,;]+', value.strip('[] \t\r\n,;'))
    return values
