# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The files of a scene that only evaluation reads: categories of labels, strangers.

A mistake in them would surface as a wrong score, so they are checked with the rest of the set.
"""

from collections.abc import Collection, Sequence
from pathlib import Path

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import camera_files, fields, files
from hooc_perception.io.scenes.scene import TrueObject

UNKNOWN_KEYS = ('name', 'translation', 'rotation_xyzw', 'size', 'surface_visibility', 'tag')


def label_categories(folder: Path, categories: Collection[str]) -> dict[int, str] | None:
    """
    Return {label: category} of labels.yaml in a scene's folder, None where there is no such file.

    :param categories: of the set. Names that resemble none of them may be of strangers.
    :raises HoocError: one sentence that names file, field and fix.
    """
    file = folder / 'labels.yaml'
    if not file.is_file():
        return None
    out = {}
    for label, category in files.read_yaml(file).items():
        near = fields.nearest(category, categories)
        if category not in categories and near:
            raise HoocError(f'{file}: label {label} is {fields.short_repr(category)}, which is '
                            f'not in dataset.yaml; is {near} meant?')
        out[fields.integer(label, 1, 255, f'{file}: a label')] = str(category)
    return out


def well_seen(folder: Path, cameras: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """
    Return {camera: labels with enough depth} of well_seen.yaml in a scene's folder, {} without.

    :raises HoocError: one sentence that names file, field and fix.
    """
    file = folder / 'well_seen.yaml'
    if not file.is_file():
        return {}
    return {camera: tuple(fields.integer(label, 1, 255, f'{file}: {camera}: a label')
                          for label in fields.sequence(labels, f'{file}: {camera}'))
            for camera, labels in fields.closed(files.read_yaml(file), cameras,
                                                f'{file}:').items()}


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
