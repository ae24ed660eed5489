# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Read BOP datasets (Benchmark for 6D Object Pose Estimation) as scene sets.

BOP's millimetres become metres, and its poses become those of the models' bounding-box centres.
Images of one scene folder with poses in a common world become the views of one scene; an image
without extrinsics is a scene of its own. The table frame is estimated (table_frame.py).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
import re
from typing import Any

from hooc_perception.chain import check_categories
from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import inverse, pose_from_matrix
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import camera_files, fields, files, png
from hooc_perception.io.scenes.bop_layout import groups, Shot
from hooc_perception.io.scenes.nominal_table import nominal_cameras
from hooc_perception.io.scenes.scene import Category, RecordedScene, TrueObject
from hooc_perception.objects.mesh import mesh_box
import numpy as np

MM = 0.001
_MODEL_FOLDERS = ('models', 'models_cad', 'models_reconst', 'models_eval')
_SCENE = re.compile(r'\d{6}\Z')
_MODEL = re.compile(r'obj_(\d{6})\.ply\Z')


def is_bop(path: Path) -> bool:
    """Return whether a folder has the layout of a BOP dataset."""
    return bool(_splits(path)) and any((path / folder).is_dir() for folder in _MODEL_FOLDERS)


def load_bop(path: Path, with_scenes: bool = True) -> tuple[
        str, tuple[Category, ...], tuple[Camera, ...], tuple[RecordedScene, ...]]:
    """
    Return (name, categories, cameras, scenes) of a BOP dataset's test split.

    Category names come from models_info.json if it has any, else they are obj_000001 and so on.
    The cameras are those of the first scene.

    :param with_scenes: False opens only scene_camera.json of the scenes; the cameras are then
        placed above a nominal table, and there are no scenes.
    :raises HoocError: one sentence that names file, field and fix.
    """
    models = next(path / folder for folder in _MODEL_FOLDERS if (path / folder).is_dir())
    info_file = models / 'models_info.json'
    info = files.read_json(info_file) if info_file.is_file() else {}
    categories = _categories(models, info_file, info)
    name = fields.name(path.resolve().name, f'{path}: its name')
    boxes = _Boxes(categories, info_file, info)
    split = _splits(path)[0]
    scenes: list[RecordedScene] = []
    for folder in sorted(p for p in split.iterdir() if p.is_dir() and _SCENE.match(p.name)):
        if with_scenes:
            scenes += _scenes(folder, categories, boxes)
        elif found := groups(folder):
            cameras = nominal_cameras([_camera(path, shot) for shot in found[0][1]])
            return name, tuple(categories.values()), cameras, ()
    if not scenes:
        raise HoocError(f'{split}: there is no scene with images; add the folders 000001 and so '
                        'on, each with scene_camera.json and depth/ (or scene_camera_cam1.json '
                        'and depth_cam1/)')
    return name, tuple(categories.values()), scenes[0].cameras, tuple(scenes)


def _splits(path: Path) -> list[Path]:
    """Return the folders that may hold test scenes, the most common name first."""
    return sorted((p for p in path.iterdir() if p.is_dir() and
                   p.name.split('_')[0] in ('test', 'val')), key=lambda p: (len(p.name), p.name))


def _categories(models: Path, info_file: Path, info: dict[str, Any]) -> dict[int, Category]:
    """Return {obj_id: Category}, by ascending id."""
    ids = sorted(int(match[1]) for match in map(_MODEL.match, (p.name for p in models.iterdir()))
                 if match)
    if not 1 <= len(ids) <= 255:
        raise HoocError(f'{models}: holds {len(ids)} models obj_000001.ply and so on; '
                        'give 1 to 255')
    result = {}
    for obj_id in ids:
        entry = fields.mapping(info.get(str(obj_id), {}), f'{info_file}: {obj_id}')
        name = fields.name(entry.get('name', f'obj_{obj_id:06d}'), f'{info_file}: {obj_id} name')
        result[obj_id] = Category(name, models / f'obj_{obj_id:06d}.ply', MM)
    check_categories(fields.unique([category.name for category in result.values()],
                                  f'{info_file}: name'), str(info_file))
    return result


def _scenes(folder: Path, categories: Mapping[int, Category],
            boxes: '_Boxes') -> list[RecordedScene]:
    """Return the scenes of one BOP scene folder."""
    truths: dict[Path, dict[str, Any]] = {}
    scenes = []
    for name, shots in groups(folder):
        for file in {shot.sensor.truth_file for shot in shots} - set(truths):
            truths[file] = files.read_json(file) if file.is_file() else {}
        cameras, units = zip(*map(_shot, shots))
        truth = _truth(shots, truths, cameras, categories, boxes)
        scenes.append(RecordedScene(name, cameras, tuple(shot.depth_file for shot in shots),
                                    units, truth, table_known=False))
    return scenes


def _camera(path: Path, shot: Shot) -> Camera:
    """Return the Camera in the source world without reading its image."""
    file = shot.sensor.size_file(path)
    entry = files.read_json(file) if file.is_file() else {}
    K = fields.numbers(fields.required(shot.entry, 'cam_K', shot.where), 9,
                       f'{shot.where} cam_K')
    # Without a stated image size, the principal point is taken to be near the middle.
    width, height = (
        fields.integer(entry[side], 1, fields.MAX_SIDE, f'{file}: {side}') if side in entry
        else int(np.clip(2 * centre + 1, 1, fields.MAX_SIDE).round())
        for side, centre in (('width', K[2]), ('height', K[5])))
    return _posed_camera(shot.entry, shot.camera, width, height, shot.where)


def _shot(shot: Shot) -> tuple[Camera, float]:
    """Return (Camera in the source world, metres per count) of one image."""
    scale = fields.number(shot.entry.get('depth_scale', 1.0), f'{shot.where} depth_scale')
    if not 1e-3 <= scale <= 100:
        raise HoocError(f'{shot.where} depth_scale is {scale:g}; give the millimetres of one '
                        'count')
    width, height = png.png_size(shot.depth_file)
    return _posed_camera(shot.entry, shot.camera, width, height, shot.where), scale * MM


def _posed_camera(shot: dict[str, Any], name: str, width: int, height: int,
                  where: str) -> Camera:
    """Return the Camera of an entry of scene_camera.json."""
    K = camera_files.intrinsics(fields.required(shot, 'cam_K', where), width, height,
                                f'{where} cam_K')
    T_camera_world = np.eye(4)
    if 'cam_R_w2c' in shot:
        T_camera_world = _pose(shot, 'cam_R_w2c', 'cam_t_w2c', where)
    return Camera(name, width, height, K, np.zeros(5), inverse(T_camera_world))


def _truth(shots: Sequence[Shot], truths: Mapping[Path, dict[str, Any]],
           cameras: Sequence[Camera], categories: Mapping[int, Category],
           boxes: '_Boxes') -> tuple[TrueObject, ...] | None:
    """
    Return the ground truth objects in the source world, None without annotation.

    Objects that models_info.json lists but whose meshes are missing belong to no category.
    """
    rows = {i: truths[shot.sensor.truth_file][shot.key] for i, shot in enumerate(shots)
            if shot.key in truths[shot.sensor.truth_file]}
    if not rows:
        return None
    # All images of a scene describe the same objects; some datasets leave out the hidden ones.
    best = max(rows, key=lambda i: len(rows[i]))
    file = f'{shots[best].sensor.truth_file}: {shots[best].key}'
    result = []
    for i, item in enumerate(fields.sequence(rows[best], file)):
        where = f'{file}[{i}]'
        item = fields.mapping(item, where)
        obj_id = fields.required(item, 'obj_id', where)
        if boxes.lacks_mesh(obj_id):
            continue
        if not isinstance(obj_id, int) or obj_id not in categories:
            raise HoocError(f'{where} obj_id is {fields.short_repr(obj_id)}, but no file '
                            'models/obj_<6 digits>.ply has this id; add the model or correct the '
                            'id')
        T_camera_model = _pose(item, 'cam_R_m2c', 'cam_t_m2c', where)
        centre, size = boxes.of(obj_id)
        T_model_centre = np.eye(4)
        T_model_centre[:3, 3] = centre
        translation, rotation = pose_from_matrix(
            cameras[best].T_world_camera @ T_camera_model @ T_model_centre)
        result.append(TrueObject(categories[obj_id].name, translation, rotation, size))
    return tuple(result)


def _pose(entry: dict[str, Any], rotation_key: str, translation_key: str,
          where: str) -> Float64Array:
    """Return a (4, 4) transform in metres from BOP's row-major rotation and millimetres."""
    R = fields.numbers(fields.required(entry, rotation_key, where), 9,
                      f'{where} {rotation_key}').reshape(3, 3)
    if abs(R @ R.T - np.eye(3)).max() > 1e-3 or np.linalg.det(R) < 0:
        raise HoocError(f'{where} {rotation_key} is not a rotation; '
                        'give nine numbers of a rotation matrix, row by row')
    T = np.eye(4)
    u, _, vt = np.linalg.svd(R)
    T[:3, :3] = u @ vt
    T[:3, 3] = MM * fields.numbers(fields.required(entry, translation_key, where), 3,
                                  f'{where} {translation_key}')
    return T


class _Boxes:
    """Bounding boxes of the models: from models_info.json, or from the meshes without it."""

    def __init__(self, categories: Mapping[int, Category], info_file: Path,
                 info: dict[str, Any]) -> None:
        self._categories, self._file, self._info = categories, info_file, info
        self._known: dict[int, tuple[Float64Array, Float64Array]] = {}

    def lacks_mesh(self, obj_id: object) -> bool:
        """Return whether models_info.json lists an object that has no mesh."""
        return (isinstance(obj_id, int) and obj_id not in self._categories
                and str(obj_id) in self._info)

    def of(self, obj_id: int) -> tuple[Float64Array, Float64Array]:
        """Return (centre (3,), size (3,)) in metres."""
        if obj_id not in self._known:
            self._known[obj_id] = (_box(self._info, obj_id, self._file) if self._info else
                                   mesh_box(self._categories[obj_id].mesh_path, MM))
        return self._known[obj_id]


def _box(info: dict[str, Any], obj_id: int,
         info_file: Path) -> tuple[Float64Array, Float64Array]:
    """Return (centre (3,), size (3,)) in metres of a model's bounding box."""
    where = f'{info_file}: {obj_id}'
    entry = fields.mapping(fields.required(info, str(obj_id), f'{info_file}:'), where)
    low = np.array([fields.number(fields.required(entry, f'min_{a}', where), f'{where} min_{a}')
                    for a in 'xyz'])
    size = np.array([fields.number(fields.required(entry, f'size_{a}', where), f'{where} size_{a}')
                     for a in 'xyz'])
    if size.min() <= 0:
        raise HoocError(f'{where} size is {size.tolist()}; give three positive millimetres')
    return MM * (low + size / 2), MM * size
