# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Check the files of a scene that only evaluation tools read: labels and strangers.

A mistake in them would surface as a wrong score, so they are checked with the rest of the set.
"""

from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import camera_files, fields, files
from hooc_perception.io.scenes.scene import TrueObject

UNKNOWN_KEYS = ('name', 'translation', 'rotation_xyzw', 'size', 'surface_visibility', 'tag')


def check_scene(folder: Path, cameras: Sequence[str], categories: Collection[str]) -> None:
    """
    Check labels.yaml and well_seen.yaml of a scene's folder, where they exist.

    :raises HoocError: one sentence that names file, field and fix.
    """
    checks: dict[str, Callable[[Path], None]] = {
        'labels.yaml': lambda file: _check_labels(file, categories),
        'well_seen.yaml': lambda file: _check_well_seen(file, cameras)}
    for name, check in checks.items():
        if (folder / name).is_file():
            check(folder / name)


def _check_labels(file: Path, categories: Collection[str]) -> None:
    """Check {label: category}; names that resemble no category may be of strangers."""
    for label, category in files.read_yaml(file).items():
        fields.integer(label, 1, 255, f'{file}: a label')
        near = fields.nearest(category, categories)
        if category not in categories and near:
            raise HoocError(f'{file}: label {label} is {fields.short_repr(category)}, which is '
                            f'not in dataset.yaml; is {near} meant?')


def _check_well_seen(file: Path, cameras: Sequence[str]) -> None:
    """Check {camera: [labels]}."""
    for camera, labels in fields.closed(files.read_yaml(file), cameras, f'{file}:').items():
        for label in fields.sequence(labels, f'{file}: {camera}'):
            fields.integer(label, 1, 255, f'{file}: {camera}: a label')


def strangers(folder: Path) -> tuple[TrueObject, ...] | None:
    """
    Return the things of unknown.yaml in a scene's folder, None where there is no such file.

    :raises HoocError: one sentence that names file, field and fix.
    """
    file = folder / 'unknown.yaml'
    if not file.is_file():
        return None
    things = []
    entry = fields.closed(files.read_yaml(file), ('objects',), f'{file}:')
    for i, item in enumerate(fields.sequence(fields.required(entry, 'objects', f'{file}:'),
                                             f'{file}: objects')):
        where = f'{file}: objects[{i}]'
        item = fields.closed(fields.mapping(item, where), UNKNOWN_KEYS, where)
        translation, rotation = camera_files.pose(item, where)
        size = fields.numbers(fields.required(item, 'size', where), 3, f'{where} size')
        if size.min() <= 0:
            raise HoocError(f'{where} size is {item["size"]}; give three positive lengths in '
                            'metres')
        things.append(TrueObject(str(item.get('name', 'unknown')), translation, rotation, size))
    return tuple(things)
