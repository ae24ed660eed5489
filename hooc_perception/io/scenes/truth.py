# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read ground truth objects, in the form that scene sets and bags share."""

from collections.abc import Collection

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import camera_files, fields
from hooc_perception.io.scenes.scene import TrueObject

MAX_METRES = 1000.0
# `tag` is what an annotator calls the object, such as the number of its fiducial; nobody reads it.
KEYS = ('category', 'translation', 'rotation_xyzw', 'size', 'surface_visibility', 'tag')


def true_object(item: object, where: str, known: Collection[str] | None = None) -> TrueObject:
    """
    Return one TrueObject.

    :param item: mapping with category, translation, rotation_xyzw, size, surface_visibility.
    :param where: names file and row in the error.
    :param known: names of the existing categories; unknown keys are errors then. None = any
        category, and further keys are left to newer readers.
    :raises HoocError: one sentence that names the field and the fix.
    """
    item = fields.mapping(item, where)
    if known is not None:
        fields.closed(item, KEYS, where)
    category = fields.required(item, 'category', f'{where}:')
    if known is None:
        fields.name(category, f'{where} category')
    elif not isinstance(category, str) or category not in known:
        near = fields.nearest(category, known)
        raise HoocError(f'{where} category is {fields.short_repr(category)}, which is not in '
                        'dataset.yaml; add it there or correct the name'
                        + (f' (is {near} meant?)' if near else ''))
    where = f'{where} ({category})'
    translation, rotation = camera_files.pose(item, where)
    if abs(translation).max() > MAX_METRES:
        raise HoocError(f'{where} translation is {translation.tolist()}; give metres')
    size = fields.numbers(fields.required(item, 'size', where), 3, f'{where} size')
    if size.min() <= 0 or size.max() > MAX_METRES:
        raise HoocError(f'{where} size is {size.tolist()}; give three positive lengths in metres')
    visibility = item.get('surface_visibility')
    if visibility is not None:
        visibility = fields.number(visibility, f'{where} surface_visibility')
        if not 0 <= visibility <= 1:
            raise HoocError(f'{where} surface_visibility is {visibility:g}; give a share 0 to 1')
    return TrueObject(category, translation, rotation, size, visibility)
