# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Check the fields of parsed YAML and JSON of unknown origin.

In every function, `where` names file and field at the beginning of the error sentence.
"""

from collections.abc import Collection, Iterable
import difflib
import math
import re
import reprlib
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.errors import HoocError
import numpy as np

# Largest width or height of an image, pixels.
MAX_SIDE = 8192
# Keys with this prefix are the user's own notes, in every file.
OWN_PREFIX = 'x_'
# What other formats call our keys.
_SYNONYMS = {
    'orientation': 'rotation_xyzw', 'quaternion': 'rotation_xyzw', 'rotation': 'rotation_xyzw',
    'position': 'translation', 'extents': 'size', 'dimensions': 'size',
    'pose': 'world_from_camera', 'extrinsics': 'world_from_camera', 'intrinsics': 'K',
    'camera_matrix': 'K', 'distortion': 'D', 'distortion_coefficients': 'D', 'unit': 'scale',
    'units': 'scale', 'mesh': 'model', 'meshes': 'models', 'label': 'category',
    'class': 'category', 'visibility': 'surface_visibility', 'depth_scale': 'depth_unit',
    'objects': 'categories', 'frame': 'world_frame'}
_NAME = re.compile(r'[A-Za-z0-9_][A-Za-z0-9_.\-]*\Z')
_ROS_TOKEN = re.compile(r'[A-Za-z][A-Za-z0-9_]*\Z')


def mapping(value: object, where: str) -> dict[str, Any]:
    """Return `value` if it is a mapping."""
    if not isinstance(value, dict):
        raise HoocError(f'{where} holds {_kind(value)}; give "key: value" entries')
    return value


def sequence(value: object, where: str) -> list[Any]:
    """Return `value` if it is a list."""
    if not isinstance(value, list):
        raise HoocError(f'{where} holds {_kind(value)}; give a list')
    return value


def closed(entry: dict[str, Any], known: Collection[str], where: str) -> dict[str, Any]:
    """
    Return `entry` if it has no other keys than the known ones and the user's own (`x_...`).

    A key that nobody reads is a spelling mistake more often than a note: `d` for `D` would drop
    the distortion of a lens.
    """
    for key in entry:
        if key in known or isinstance(key, str) and key.startswith(OWN_PREFIX):
            continue
        near = nearest(key, [name for name in known if name not in entry]) or nearest(key, known)
        fix = (f'is {near} meant?' if near else f'remove it (known: {", ".join(known)}), or name '
               f'it {OWN_PREFIX}{str(key)[:40]} if it is a note of your own')
        raise HoocError(f'{where} {short_repr(key)} is not a key of this entry; {fix}')
    return entry


def nearest(key: object, names: Collection[str]) -> str | None:
    """Return the name that a misspelt key most likely stands for, None if none is similar."""
    text = str(key).lower()
    if _SYNONYMS.get(text) in names:
        return _SYNONYMS[text]
    by_case = {name.lower(): name for name in names}
    if text in by_case:
        return by_case[text]
    near = difflib.get_close_matches(text, by_case, 1, 0.6)
    return by_case[near[0]] if near else None


def required(entry: dict[str, Any], key: str, where: str) -> Any:
    """Return entry[key]; the error names the missing field."""
    if key not in entry:
        raise HoocError(f'{where} {key} is missing; add it')
    return entry[key]


def numbers(value: object, count: int | None, where: str) -> Float64Array:
    """Return a float64 array of exactly `count` finite numbers (None: any count)."""
    values = sequence(value, where)
    if count is not None and len(values) != count:
        raise HoocError(f'{where} has {len(values)} numbers; give {count}')
    return np.array([number(v, where) for v in values], np.float64)


def number(value: Any, where: str) -> float:
    """Return a finite float; YAML reads 1e-3 (without a point) as text, so text is accepted."""
    try:
        if isinstance(value, bool):
            raise ValueError
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise HoocError(f'{where} contains {short_repr(value)}; give a number') from None
    if not math.isfinite(result):
        raise HoocError(f'{where} contains {value}; give a finite number')
    return result


def integer(value: object, low: int, high: int, where: str) -> int:
    """Return `value` if it is an integer from `low` to `high`."""
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise HoocError(f'{where} is {short_repr(value)}; give a whole number from {low} to '
                        f'{high}')
    return value


def text(value: object, where: str) -> str:
    """Return `value` if it is text."""
    if not isinstance(value, str):
        raise HoocError(f'{where} is {short_repr(value)}; give text, in quotes if it is a number')
    return value


def name(value: object, where: str) -> str:
    """Return text that is safe as a file name: letters, digits, _ - and ."""
    if not isinstance(value, str) or not _NAME.match(value) or len(value) > 100:
        raise HoocError(f'{where} is {short_repr(value)}; use letters, digits, _, - and . '
                        '(in quotes if it is a number)')
    return value


def ros_token(value: object, where: str) -> str:
    """Return text that is valid in a topic name."""
    if not isinstance(value, str) or not _ROS_TOKEN.match(value) or len(value) > 100:
        raise HoocError(f'{where} is {short_repr(value)}; topics are named after it, so begin '
                        'with a letter and use letters, digits and _')
    return value


def unique(names: Iterable[str], where: str) -> tuple[str, ...]:
    """Return `names` as a tuple if no two are equal."""
    names = tuple(names)
    seen = set()
    for item in names:
        if item in seen:
            raise HoocError(f'{where} names {item!r} twice; remove or rename one of them')
        seen.add(item)
    return names


def short_repr(value: object) -> str:
    """Return a short text for a value of unknown origin, however large it is."""
    return reprlib.repr(value)[:60]


def _kind(value: object) -> str:
    """Return what a parsed value is, in a user's words."""
    return {dict: 'entries', list: 'a list', str: 'text', type(None): 'nothing'}.get(
        type(value), short_repr(value))
