# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Write scene sets, format `hooc-scenes/1` (docs/scene_sets.md)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hooc_perception.chain import check_categories
from hooc_perception.core.arrays import Float32Array, UInt8Array
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.depth_encodings import counts_from_depth
from hooc_perception.io.scenes import camera_files, fields, files, png
from hooc_perception.io.scenes.scene import TrueObject
import numpy as np
import trimesh
import yaml

FORMAT = 'hooc-scenes/1'


@dataclass(frozen=True, eq=False)
class NewScene:
    """
    A scene to be written.

    :ivar depth: one (H, W) array per camera, in camera order; metres, NaN = none, distorted.
    :ivar truth: None without annotation.
    :ivar labels: {camera name: (H, W) uint8 instance labels}, None for none.
    :ivar cameras: only if this scene's cameras differ from the set's.
    """

    name: str
    depth: tuple[Float32Array, ...]
    truth: tuple[TrueObject, ...] | None = None
    labels: dict[str, UInt8Array] | None = None
    cameras: tuple[Camera, ...] | None = None


def write_scene_set(path: str | Path, name: str, meshes: Mapping[str, trimesh.Trimesh],
                    cameras: Sequence[Camera], scenes: Iterable[NewScene],
                    max_instances: int = 0, depth_unit: float = 0.001,
                    world_frame: str = 'table') -> Path:
    """
    Write a scene set that `load_scene_set` reads back.

    :param path: a folder that does not exist yet or is empty.
    :param meshes: {category: mesh in metres}, in the order of the class ids.
    :param cameras: shared by all scenes that have no cameras of their own.
    :param scenes: consumed one by one, so a generator is fine.
    :param max_instances: most objects of one category in a scene, 0 = no limit.
    :param depth_unit: metres per PNG count.
    :return: the folder.
    :raises HoocError: if the folder is in use or a scene does not fit its cameras.
    """
    path = Path(path)
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise HoocError(f'{path}: the folder is in use; choose a new one or empty it')
    for category in meshes:
        fields.name(category, f'{path}: the name of a category')
    check_categories(meshes, str(path))
    (path / 'models').mkdir(parents=True, exist_ok=True)
    for category, mesh in meshes.items():
        mesh.export(path / 'models' / f'{category}.ply')
    camera_files.write_cameras(path / 'cameras.yaml', cameras)
    for scene in scenes:
        write_scene(path / 'scenes' / fields.name(scene.name, f'{path}: the name of a scene'),
                    scene, cameras, depth_unit)
    # Last, so that a set whose writing was interrupted does not look complete.
    content = {'format': FORMAT, 'name': fields.name(name, f'{path}: the name of the set'),
               'world_frame': world_frame, 'depth_unit': float(depth_unit),
               'cameras': [camera.name for camera in cameras]}
    if max_instances:
        content['max_instances_per_category'] = int(max_instances)
    content['categories'] = [{'name': category, 'model': f'models/{category}.ply'}
                             for category in meshes]
    files.write_atomically(path / 'dataset.yaml', _yaml(content))
    return path


def write_scene(folder: Path, scene: NewScene, set_cameras: Sequence[Camera],
                depth_unit: float = 0.001) -> None:
    """Write the files of one scene into `folder`."""
    cameras = scene.cameras or set_cameras
    if len(scene.depth) != len(cameras):
        raise HoocError(f'{folder}: {len(scene.depth)} depth images for {len(cameras)} cameras; '
                        'give one each')
    folder.mkdir(parents=True, exist_ok=True)
    for camera, depth in zip(cameras, scene.depth):
        if np.shape(depth) != (camera.height, camera.width):
            raise HoocError(f'{folder}: the depth of {camera.name} has shape {np.shape(depth)}, '
                            f'its camera ({camera.height}, {camera.width}); make them agree')
        png.write_png(folder / f'{camera.name}.png', counts_from_depth(depth, depth_unit))
    for camera_name, labels in (scene.labels or {}).items():
        png.write_png(folder / f'{camera_name}_labels.png', np.asarray(labels, np.uint8))
    if scene.cameras:
        camera_files.write_cameras(folder / 'cameras.yaml', scene.cameras)
    if scene.truth is not None:
        files.write_atomically(folder / 'ground_truth.yaml',
                               _yaml({'objects': [true_object_entry(t) for t in scene.truth]}))


def true_object_entry(true: TrueObject) -> dict[str, Any]:
    """Return a TrueObject as the plain mapping in ground_truth.yaml and bags."""
    entry: dict[str, Any] = {
        'category': true.category,
        'translation': np.asarray(true.translation, np.float64).tolist(),
        'rotation_xyzw': np.asarray(true.rotation_xyzw, np.float64).tolist(),
        'size': np.asarray(true.size, np.float64).tolist()}
    if true.surface_visibility is not None:
        entry['surface_visibility'] = float(true.surface_visibility)
    return entry


def _yaml(content: dict[str, Any]) -> str:
    """Return YAML text with the keys in their order and each number list on one line."""
    return yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=99)
