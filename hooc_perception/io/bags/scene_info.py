# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read what a bag says of its scene, on /hooc/scene_info."""

import json

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import files
from hooc_perception.io.scenes.truth import true_object

SUFFIX = '/scene_info'
# As the nodes have it: what the model says.
MODELS_LIMIT = -1


def default_info(name):
    """Return what holds for a bag that says nothing; `name` is the bag's."""
    return {'dataset': name, 'scene': name, 'categories': [], 'cameras': [],
            'max_instances': MODELS_LIMIT, 'truth': None, 'world_frame': None}


def parsed_info(text, where):
    """
    Return the checked mapping of a scene_info message; truth as a tuple of TrueObject.

    Keys that we do not know are kept; null stands for a key that is absent.

    :param where: names bag and topic in the error.
    :raises HoocError: one sentence that names the key and the mend.
    """
    try:
        info = files.mapping(json.loads(text), where)
    except (ValueError, RecursionError):
        raise HoocError(f'{where} is not valid JSON; convert the scene again') from None
    info = {key: value for key, value in info.items() if value is not None}
    for key, check in _CHECKS.items():
        if key in info:
            info[key] = check(info[key], f'{where} {key}')
    return info


def _names(value, where):
    """Return a list of names, none of them twice."""
    return list(files.unique([files.name(item, where) for item in files.sequence(value, where)],
                             where))


def _truth(value, where):
    """Return the tuple of TrueObject."""
    return tuple(true_object(entry, f'{where}[{i}]')
                 for i, entry in enumerate(files.sequence(value, where)))


# A scene's name becomes that of its recording, in a folder of the user's.
_CHECKS = {'dataset': files.name, 'scene': files.name, 'world_frame': files.text,
           'cameras': _names, 'categories': _names, 'truth': _truth,
           'max_instances': lambda value, where: files.whole(value, MODELS_LIMIT, 1000, where)}
