# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Load scene sets, format `hooc-scenes/1` (docs/scene_sets.md), and BOP datasets."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hooc_perception.chain import check_categories
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import annotations, camera_files, fields, files
from hooc_perception.io.scenes.bop import is_bop, load_bop
from hooc_perception.io.scenes.nominal_table import nominal_cameras
from hooc_perception.io.scenes.plausible import check_aim
from hooc_perception.io.scenes.scene import Category, RecordedScene, TrueObject
from hooc_perception.io.scenes.sequences import (
    load_sequences,
    RecordedSequence,
    scenes_named,
    whole_sequences,
)
from hooc_perception.io.scenes.truth import true_object
from hooc_perception.io.scenes.writer import FORMAT, NewScene, write_scene_set

# Class ids and instance labels travel as 8-bit images in which 0 is the background.
MAX_CATEGORIES = 255
KEYS = ('format', 'name', 'world_frame', 'depth_unit', 'cameras', 'max_instances_per_category',
        'categories')
CATEGORY_KEYS = ('name', 'model', 'models', 'scale', 'up')
# Meshes of one category.
MAX_MESHES = 100
# The world_frame of sets whose poses are not in a table's frame.
UNKNOWN_WORLD = 'unknown'

__all__ = ['Category', 'NewScene', 'RecordedScene', 'RecordedSequence', 'SceneSet', 'TrueObject',
           'load_scene_set', 'write_scene_set']


@dataclass(frozen=True, eq=False)
class SceneSet:
    """
    A folder of scenes, the categories that may occur in them, and the cameras.

    :ivar world_frame: name of the frame of all poses; z up, z = 0 is the table top.
    :ivar categories: class id c is categories[c - 1].
    :ivar cameras: the set's, or those of its first scene.
    :ivar max_instances: most objects of one category in a scene, 0 = no limit.
    :ivar scenes: sorted by name; their depth is read on demand.
    :ivar sequences: which of them are frame sets of one table over time.
    """

    path: Path
    name: str
    world_frame: str
    categories: tuple[Category, ...]
    cameras: tuple[Camera, ...]
    max_instances: int
    scenes: tuple[RecordedScene, ...]
    sequences: tuple[RecordedSequence, ...] = ()

    @property
    def category_names(self) -> tuple[str, ...]:
        """Return the names in the order of the class ids 1..N."""
        return tuple(category.name for category in self.categories)

    def scene(self, name: str) -> RecordedScene:
        """Return one scene by name; raise HoocError if there is none."""
        for scene in self.scenes:
            if scene.name == name:
                return scene
        known = ', '.join(scene.name for scene in self.scenes[:20])
        raise HoocError(f'{self.path}: there is no scene {name!r}; choose one of {known}')

    def selected(self, names: Iterable[str] | None) -> 'SceneSet':
        """
        Return a set with these scenes only, each once, in this order (no `names`: all).

        The name of a sequence stands for its scenes; sequences are kept if all of theirs are.
        """
        if not names:
            return self
        names = scenes_named(names, self.sequences)
        return replace(self, scenes=tuple(self.scene(name) for name in names),
                       sequences=whole_sequences(self.sequences, names))


def load_scene_set(path: str | Path, with_scenes: bool = True) -> SceneSet:
    """
    Return the SceneSet of a `hooc-scenes/1` folder or of a BOP dataset.

    :param with_scenes: False reads models and cameras only, as training must. The set's
        `scenes` are empty then, and if the table frame is unknown it is a nominal one
        (nominal_table.py), since only camera files are opened.
    :raises HoocError: one sentence that names file, field and fix. Depth images are not read
        before their scene's `depth()` is called.
    """
    path = Path(path)
    if not path.is_dir():
        raise HoocError(f'{path}: there is no such folder; give a scene set or a BOP dataset')
    if not (path / 'dataset.yaml').is_file() and is_bop(path):
        name, categories, cameras, scenes = load_bop(path, with_scenes)
        return SceneSet(path, name, 'table', categories, cameras, 0, scenes)
    return _load_hooc(path, with_scenes)


def _load_hooc(path: Path, with_scenes: bool) -> SceneSet:
    """Return the SceneSet of a `hooc-scenes/1` folder."""
    file = path / 'dataset.yaml'
    entry = files.read_yaml(file)
    if fields.required(entry, 'format', f'{file}:') != FORMAT:
        raise HoocError(f'{file}: format is {fields.short_repr(entry["format"])}; this version '
                        f'reads {FORMAT!r}, so convert the set or correct the field')
    fields.closed(entry, KEYS, f'{file}:')
    categories = _categories(path, file, entry)
    camera_names = _camera_names(file, entry)
    unit = fields.number(entry.get('depth_unit', 0.001), f'{file}: depth_unit')
    if not 1e-6 <= unit <= 0.1:
        raise HoocError(f'{file}: depth_unit is {unit:g}; give the metres of one count, '
                        '0.001 for millimetres')
    limit = fields.integer(entry.get('max_instances_per_category', 0), 0, 1000,
                           f'{file}: max_instances_per_category')
    known = path / 'cameras.yaml'
    world = fields.name(entry.get('world_frame', 'table'), f'{file}: world_frame')
    # Of a single camera, the unknown world may be its own frame.
    posed = world != UNKNOWN_WORLD or len(camera_names) > 1
    set_cameras = camera_files.load_cameras(known, posed) if known.is_file() else {}
    own = bool(set_cameras) and world != UNKNOWN_WORLD
    folders = _scene_folders(path, needed=with_scenes or not set_cameras)
    scenes = tuple(_scene(folder, camera_names, set_cameras, unit, categories, world, path)
                   for folder in (folders if with_scenes else ()))
    sequences = load_sequences(path, scenes, [category.name for category in categories]
                               ) if with_scenes else ()
    if own:
        cameras = _chosen(camera_names, set_cameras, known, file)
        check_aim(cameras, known)
    elif with_scenes:
        cameras = scenes[0].cameras
    elif set_cameras:
        cameras = nominal_cameras(_chosen(camera_names, set_cameras, known, file))
    else:
        cameras = _scene_cameras(folders[0], camera_names, {}, path)
        if world == UNKNOWN_WORLD:
            cameras = nominal_cameras(cameras)
        else:
            check_aim(cameras, folders[0] / 'cameras.yaml')
    return SceneSet(path, fields.name(entry.get('name', path.resolve().name), f'{file}: name'),
                    'table' if world == UNKNOWN_WORLD else world, categories, cameras, limit,
                    scenes, sequences)


def _camera_names(file: Path, entry: dict[str, Any]) -> tuple[str, ...]:
    """Return the camera names in dataset.yaml, in their order."""
    where = f'{file}: cameras'
    names = fields.sequence(fields.required(entry, 'cameras', f'{file}:'), where)
    names = fields.unique([fields.ros_token(name, where) for name in names], where)
    if not names:
        raise HoocError(f'{where} is empty; name at least one camera')
    return names


def _categories(path: Path, file: Path, entry: dict[str, Any]) -> tuple[Category, ...]:
    """Return the categories of dataset.yaml, in the order of their class ids."""
    entries = fields.sequence(fields.required(entry, 'categories', f'{file}:'),
                              f'{file}: categories')
    if not 1 <= len(entries) <= MAX_CATEGORIES:
        raise HoocError(f'{file}: categories has {len(entries)} entries; '
                        f'give 1 to {MAX_CATEGORIES}')
    result = []
    for i, item in enumerate(entries):
        where = f'{file}: categories[{i}]'
        item = fields.closed(fields.mapping(item, where), CATEGORY_KEYS, where)
        name = fields.name(fields.required(item, 'name', f'{where}:'), f'{where} name')
        where = f'{file}: category {name}:'
        mesh, *more = _meshes(path, item, where)
        scale = fields.number(item['scale'], f'{where} scale') if 'scale' in item else None
        if scale is not None and scale <= 0:
            raise HoocError(f'{where} scale is {scale:g}; give the metres of one model unit')
        up = item.get('up')
        if up not in (None, 'x', 'y', 'z'):
            raise HoocError(f'{where} up is {fields.short_repr(up)}; give the axis of the mesh '
                            'that points up: x, y or z')
        result.append(Category(name, mesh, scale, tuple(more), up))
    check_categories(fields.unique([category.name for category in result], f'{file}: categories'),
                     str(file))
    return tuple(result)


def _meshes(path: Path, item: dict[str, Any], where: str) -> list[Path]:
    """Return the mesh files of a category, the generic one first."""
    if 'models' not in item:
        if 'model' not in item:
            raise HoocError(f'{where} model is missing; add it, or models for several meshes')
        return [files.file_inside(path, item['model'], f'{where} model')]
    if 'model' in item:
        raise HoocError(f'{where} has both model and models; keep one of them')
    names = fields.sequence(item['models'], f'{where} models')
    if not 1 <= len(names) <= MAX_MESHES:
        raise HoocError(f'{where} models has {len(names)} entries; give 1 to {MAX_MESHES} meshes')
    meshes = [files.file_inside(path, name, f'{where} models') for name in names]
    fields.unique(names, f'{where} models')
    if len({mesh.resolve() for mesh in meshes}) < len(meshes):
        raise HoocError(f'{where} models names the same file twice '
                        f'({fields.short_repr(names)}); remove one of them')
    return meshes


def _scene_folders(path: Path, needed: bool) -> list[Path]:
    """Return the sorted folders below scenes/."""
    root = path / 'scenes'
    folders = sorted(p for p in root.iterdir() if p.is_dir() and not p.name.startswith('.')) \
        if root.is_dir() else []
    if not folders and needed:
        raise HoocError(f'{root}: there is no scene; add one folder per scene, '
                        'with one <camera>.png each')
    return folders


def _chosen(names: Sequence[str], cameras: Mapping[str, Camera], cameras_file: Path,
            dataset_file: Path) -> tuple[Camera, ...]:
    """Return the named cameras as a tuple."""
    for name in names:
        if name not in cameras:
            raise HoocError(f'{cameras_file}: camera {name} is missing, which {dataset_file} '
                            'lists under cameras; add its calibration or take it off the list')
    return tuple(cameras[name] for name in names)


def _scene_cameras(folder: Path, names: Sequence[str], set_cameras: Mapping[str, Camera],
                   path: Path) -> tuple[Camera, ...]:
    """Return a scene's cameras: its own if it has any, otherwise the set's."""
    own = folder / 'cameras.yaml'
    if not own.is_file():
        if not set_cameras:
            raise HoocError(f'{own}: the file is missing and {path / "cameras.yaml"} too; '
                            'add one of them')
        return _chosen(names, set_cameras, path / 'cameras.yaml', path / 'dataset.yaml')
    return _chosen(names, {**set_cameras, **camera_files.load_cameras(own)}, own,
                   path / 'dataset.yaml')


def _scene(folder: Path, camera_names: Sequence[str], set_cameras: Mapping[str, Camera],
           unit: float, categories: Sequence[Category], world: str, path: Path) -> RecordedScene:
    """Return the RecordedScene of one folder below scenes/."""
    name = fields.name(folder.name, f"{folder}: the name of a scene's folder")
    depth_files = tuple(folder / f'{camera}.png' for camera in camera_names)
    for camera, file in zip(camera_names, depth_files):
        if not file.is_file():
            raise HoocError(f'{file}: the depth image of camera {camera} is missing; '
                            'record it or remove the scene')
    labels = {camera: folder / f'{camera}_labels.png' for camera in camera_names
              if (folder / f'{camera}_labels.png').is_file()}
    masks = {camera: folder / f'{camera}_mask.png' for camera in camera_names
             if (folder / f'{camera}_mask.png').is_file()}
    truth_file = folder / 'ground_truth.yaml'
    truth = _truth(truth_file, categories) if truth_file.is_file() else None
    cameras = _scene_cameras(folder, camera_names, set_cameras, path)
    return RecordedScene(name, cameras, depth_files, (unit,) * len(depth_files), truth, labels,
                         table_known=world != UNKNOWN_WORLD,
                         source_strangers=annotations.strangers(folder), mask_files=masks,
                         label_categories=annotations.label_categories(
                             folder, [category.name for category in categories]),
                         well_seen=annotations.well_seen(folder, camera_names))


def _truth(file: Path, categories: Sequence[Category]) -> tuple[TrueObject, ...]:
    """Return the objects of a ground_truth.yaml."""
    known = {category.name for category in categories}
    entry = fields.closed(files.read_yaml(file), ('objects',), f'{file}:')
    objects = fields.sequence(fields.required(entry, 'objects', f'{file}:'), f'{file}: objects')
    return tuple(true_object(item, f'{file}: objects[{i}]', known)
                 for i, item in enumerate(objects))
