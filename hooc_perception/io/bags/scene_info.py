# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read the description of a bag's scene, on /hooc/scene_info."""

from collections.abc import Callable
import json
from typing import Any

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import fields, sequences
from hooc_perception.io.scenes.scene import TrueObject
from hooc_perception.io.scenes.truth import true_object

SUFFIX = '/scene_info'
# The value by which the nodes mean the limit of the model.
MODELS_LIMIT = -1


def default_info(name: str) -> dict[str, Any]:
    """Return the description of a bag without one; `name` is the bag's."""
    return {'dataset': name, 'scene': name, 'categories': [], 'cameras': [],
            'max_instances': MODELS_LIMIT, 'truth': None, 'world_frame': None, 'sequence': None}


def parsed_info(text: str, where: str) -> dict[str, Any]:
    """
    Return the checked mapping of a scene_info message; truth as a tuple of TrueObject.

    A `sequence` becomes {period_s, events: {index: text}, frame_sets: {scene: truth or None}}.

    Unknown keys are kept; null means that a key is absent.

    :param where: names bag and topic in the error.
    :raises HoocError: one sentence that names the key and the fix.
    """
    try:
        info = fields.mapping(json.loads(text), where)
    except (ValueError, RecursionError):
        raise HoocError(f'{where} is not valid JSON; convert the scene again') from None
    info = {key: value for key, value in info.items() if value is not None}
    for key, check in _CHECKS.items():
        if key in info:
            info[key] = check(info[key], f'{where} {key}')
    return info


def _names(value: object, where: str) -> list[str]:
    """Return a list of distinct names."""
    names = [fields.name(item, where) for item in fields.sequence(value, where)]
    return list(fields.unique(names, where))


def _truth(value: object, where: str) -> tuple[TrueObject, ...]:
    """Return the ground truth objects."""
    return tuple(true_object(entry, f'{where}[{i}]')
                 for i, entry in enumerate(fields.sequence(value, where)))


def _max_instances(value: object, where: str) -> int:
    """Return the most objects of one category."""
    return fields.integer(value, MODELS_LIMIT, 1000, where)


def _sequence(value: object, where: str) -> dict[str, Any]:
    """Return what a bag of several frame sets says of them, in their order."""
    entry = fields.mapping(value, where)
    items = [fields.mapping(item, f'{where} frame_sets[{i}]') for i, item in enumerate(
        fields.sequence(fields.required(entry, 'frame_sets', where), f'{where} frame_sets'))]
    names = _names([item.get('scene') for item in items], f'{where} frame_sets')
    truths = [None if item.get('truth') is None else _truth(item['truth'], f'{where} {name} truth')
              for name, item in zip(names, items)]
    events = {}
    for key, text in fields.mapping(entry.get('events') or {}, f'{where} events').items():
        # Keys of JSON are text.
        index = sequences.event_index(int(key) if key.isdecimal() else key, len(items), where)
        events[index] = sequences.event(text, f'{where} events: {index}')
    return {'period_s': sequences.period(fields.required(entry, 'period_s', where),
                                         f'{where} period_s'),
            'events': events, 'frame_sets': dict(zip(names, truths))}


# The scene's name is checked as a file name because its recording is named after it.
_CHECKS: dict[str, Callable[[object, str], Any]] = {
    'dataset': fields.name, 'scene': fields.name, 'world_frame': fields.text, 'cameras': _names,
    'categories': _names, 'truth': _truth, 'max_instances': _max_instances,
    'sequence': _sequence}
