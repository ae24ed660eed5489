# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read what really stands in a scene, as scene sets and bags both hold it."""

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import camera_files, files
from hooc_perception.io.scenes.scene import TrueObject

MAX_METRES = 1000.0


def true_object(item, where, known=None):
    """
    Return one TrueObject.

    :param item: mapping with category, translation, rotation_xyzw, size, surface_visibility.
    :param where: names file and row in the error.
    :param known: names of the categories that there are, None = any.
    :raises HoocError: one sentence that names the field and the mend.
    """
    item = files.mapping(item, where)
    category = files.required(item, 'category', f'{where}:')
    if known is None:
        files.name(category, f'{where} category')
    elif not isinstance(category, str) or category not in known:
        raise HoocError(f'{where} category is {files.shown(category)}, which is not in '
                        'dataset.yaml; add it there or correct the name')
    where = f'{where} ({category})'
    translation, rotation = camera_files.pose(item, where)
    if abs(translation).max() > MAX_METRES:
        raise HoocError(f'{where} translation is {translation.tolist()}; give metres')
    size = files.numbers(files.required(item, 'size', where), 3, f'{where} size')
    if size.min() <= 0 or size.max() > MAX_METRES:
        raise HoocError(f'{where} size is {size.tolist()}; give three positive lengths in metres')
    visibility = item.get('surface_visibility')
    if visibility is not None:
        visibility = files.number(visibility, f'{where} surface_visibility')
        if not 0 <= visibility <= 1:
            raise HoocError(f'{where} surface_visibility is {visibility:g}; give a share 0 to 1')
    return TrueObject(category, translation, rotation, size, visibility)
