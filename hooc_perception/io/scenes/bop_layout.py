# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Find the files of a BOP scene folder, of one sensor or of several.

Until 2023 a scene has scene_camera.json, scene_gt.json and depth/. Since then a scene may be seen
by several sensors, each with files of its own: scene_camera_cam1.json, scene_gt_cam1.json,
depth_cam1/.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
import re
from typing import Any

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import fields, files
import numpy as np

# A recording by a moving camera has hundreds of images; this many, evenly spread, are used.
MAX_VIEWS = 16
_CAMERAS = re.compile(r'scene_camera(?:_(\w+))?\.json\Z')


@dataclass(frozen=True)
class Sensor:
    """
    One sensor of a scene folder.

    :ivar name: '' where the layout knows one sensor only.
    """

    folder: Path
    name: str

    @property
    def camera_file(self) -> Path:
        """Return the file of its intrinsics and poses."""
        return self.folder / f'scene_camera{self._tail}.json'

    @property
    def truth_file(self) -> Path:
        """Return the file of the true poses, which may be missing."""
        return self.folder / f'scene_gt{self._tail}.json'

    @property
    def depth_folder(self) -> Path:
        """Return the folder of its depth images."""
        return self.folder / f'depth{self._tail}'

    def size_file(self, dataset: Path) -> Path:
        """Return the dataset's file that may state the size of its images."""
        own = dataset / f'camera{self._tail}.json'
        return own if own.is_file() else dataset / 'camera.json'

    @property
    def _tail(self) -> str:
        return f'_{self.name}' if self.name else ''


@dataclass(frozen=True)
class Shot:
    """
    One image.

    :ivar key: its id in the files.
    :ivar entry: its entry of the camera file.
    :ivar camera: name of the camera in the scene that it becomes a view of.
    """

    sensor: Sensor
    key: str
    entry: dict[str, Any]
    camera: str

    @property
    def where(self) -> str:
        """Return file and entry, for errors."""
        return f'{self.sensor.camera_file}: {self.key}'

    @property
    def depth_file(self) -> Path:
        """Return the file of its depth image."""
        return self.sensor.depth_folder / f'{int(self.key):06d}.png'


def groups(folder: Path) -> list[tuple[str, list[Shot]]]:
    """
    Return [(scene name, its shots)] of a scene folder.

    Images of one sensor that share a world are views of one scene; of several sensors, the images
    with the same id are. An image without extrinsics is a scene of its own.

    :raises HoocError: one sentence that names file, field and fix.
    """
    sensors = _sensors(folder)
    if len(sensors) > 1:
        return list(_of_sensors(folder, sensors))
    shared: list[Shot] = []
    found: list[tuple[str, list[Shot]]] = []
    for key, entry in _entries(sensors[0]):
        if is_posed(entry):
            shared.append(Shot(sensors[0], key, entry, f'view_{int(key):06d}'))
        else:
            found.append((f'{folder.name}_{int(key):06d}', [Shot(sensors[0], key, entry,
                                                                 'camera')]))
    if shared:
        picks = np.unique(np.linspace(0, len(shared) - 1, min(len(shared), MAX_VIEWS)).round())
        found.insert(0, (folder.name, [shared[int(i)] for i in picks]))
    return found


def is_posed(entry: dict[str, Any]) -> bool:
    """Return whether an image has extrinsics."""
    return 'cam_R_w2c' in entry and 'cam_t_w2c' in entry


def _sensors(folder: Path) -> list[Sensor]:
    """Return the sensors of a scene folder that measure depth, by name."""
    names = sorted(match[1] or '' for match in map(_CAMERAS.match, (
        p.name for p in folder.iterdir())) if match)
    sensors = [Sensor(folder, name) for name in names]
    with_depth = [sensor for sensor in sensors if sensor.depth_folder.is_dir()]
    if sensors and not with_depth:
        raise HoocError(f'{folder}: no sensor has depth images (wanted: '
                        f'{", ".join(s.depth_folder.name for s in sensors[:5])}); add them or '
                        'remove the scene')
    # Without any, the error names the file that is missing.
    return with_depth or [Sensor(folder, '')]


def _entries(sensor: Sensor) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield (image id, entry) of a camera file, by ascending id."""
    content = files.read_json(sensor.camera_file)
    for key in content:
        if not key.isdecimal():
            raise HoocError(f'{sensor.camera_file}: the image id {fields.short_repr(key)} is not '
                            'a number; correct it')
    for key in sorted(content, key=int):
        yield key, fields.mapping(content[key], f'{sensor.camera_file}: {key}')


def _of_sensors(folder: Path, sensors: list[Sensor]) -> Iterator[tuple[str, list[Shot]]]:
    """Yield the groups of several sensors: what was taken at once, then images without poses."""
    shots: dict[int, list[Shot]] = {}
    for sensor in sensors:
        # Topics are named after cameras.
        name = sensor.name if sensor.name[:1].isalpha() else f'camera_{sensor.name}'.rstrip('_')
        for key, entry in _entries(sensor):
            shots.setdefault(int(key), []).append(
                Shot(sensor, key, entry, fields.ros_token(name, str(sensor.camera_file))))
    for key in sorted(shots):
        name = f'{folder.name}_{key:06d}'
        if posed := [shot for shot in shots[key] if is_posed(shot.entry)]:
            yield name, posed[:MAX_VIEWS]
        for shot in shots[key]:
            if not is_posed(shot.entry):
                yield f'{name}_{shot.camera}', [shot]
