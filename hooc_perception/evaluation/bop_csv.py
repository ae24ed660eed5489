# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Export results in the CSV format of the BOP challenge: scene_id,im_id,obj_id,score,R,t,time."""

from pathlib import Path
import re
from typing import Any

from hooc_perception.core.geometry import inverse, matrix_from_pose
from hooc_perception.evaluation.matching import in_frame_of, posed
from hooc_perception.io.scenes.files import write_atomically
from hooc_perception.io.scenes.scene_set import SceneSet
from hooc_perception.objects.mesh import mesh_box

_OBJECT = re.compile(r'obj_(\d+)\Z')
# The third part is the sensor of an image without pose.
_SCENE = re.compile(r'(\d{6})(?:_(\d{6})(?:_\w+)?)?\Z')
_VIEW = re.compile(r'view_(\d+)\Z')


def write_bop_csv(path: str | Path, results: dict[str, Any], scene_set: SceneSet) -> int:
    """
    Write one row per estimate and view, as BOP expects; return the number of rows.

    R (row major) and t (mm) map the model file's own coordinates to the camera; our poses are
    those of the bounding box's centre. BOP has no sizes, so they are left out. In sets that are
    not BOP's, scenes count from 1, images from 0 in camera order, and objects are numbered as
    the categories.

    :param results: content of a results file.
    """
    rows = ['scene_id,im_id,obj_id,score,R,t,time']
    numbers = _object_ids(scene_set)
    centres = {c.name: mesh_box(c.mesh_path, c.scale, c.up)[0] for c in scene_set.categories}
    entries = {entry['scene']: entry for entry in results['scenes']}
    for index, scene in enumerate(scene_set.scenes):
        entry = entries.get(scene.name)
        if not entry or not entry['objects']:
            continue
        entry = in_frame_of(scene, entry)
        known = _SCENE.match(scene.name)
        for j, camera in enumerate(scene.cameras):
            view = _VIEW.match(camera.name)
            image = int(known[2]) if known and known[2] else int(view[1]) if view else j
            T_camera_world = inverse(camera.T_world_camera)
            for thing in map(posed, entry['objects']):
                T = T_camera_world @ matrix_from_pose(thing.translation, thing.rotation_xyzw)
                t = T[:3, 3] - T[:3, :3] @ centres[thing.category]
                rows.append(','.join([
                    str(int(known[1]) if known else index + 1), str(image),
                    str(numbers[thing.category]), f'{thing.score:.6f}',
                    ' '.join(f'{x:.9f}' for x in T[:3, :3].ravel()),
                    ' '.join(f'{1000 * x:.6f}' for x in t), f'{entry["seconds"]:.6f}']))
    write_atomically(path, '\n'.join(rows) + '\n')
    return len(rows) - 1


def _object_ids(scene_set: SceneSet) -> dict[str, int]:
    """Return {category: obj_id of BOP}, from the name of the mesh file where it is BOP's."""
    out = {}
    for index, category in enumerate(scene_set.categories):
        match = _OBJECT.match(category.mesh_path.stem)
        out[category.name] = int(match[1]) if match else index + 1
    return out
