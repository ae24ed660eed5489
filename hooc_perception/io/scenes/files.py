# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Reading files that somebody else wrote: bounded, checked, and with errors that name the field.

Every function raises HoocError with one sentence: file, field, mend.
"""

from contextlib import contextmanager
import json
import math
import os
from pathlib import Path
import re
import reprlib
import tempfile

from hooc_perception.errors import HoocError
import numpy as np
import yaml

MAX_YAML_BYTES = 8 << 20
MAX_YAML_DEPTH = 32
# BOP's scene_gt.json of a thousand images has some ten megabytes.
MAX_JSON_BYTES = 64 << 20
MAX_SIDE = 8192
_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
_NAME = re.compile(r'[A-Za-z0-9_][A-Za-z0-9_.\-]*\Z')
_ROS_TOKEN = re.compile(r'[A-Za-z][A-Za-z0-9_]*\Z')


def read_bytes(path, limit):
    """Return the content of a file of at most `limit` bytes."""
    try:
        size = os.stat(path).st_size
        if size > limit:
            raise HoocError(f'{path}: {size} bytes exceed the limit of {limit}; '
                            'check that this is the right file')
        return Path(path).read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        raise HoocError(f'{path}: the file is missing; add it or correct its name') from None
    except OSError as error:
        raise HoocError(f'{path}: cannot be read ({error.strerror}); '
                        'check the file and its permissions') from None


def read_yaml(path):
    """Return the mapping that a YAML file holds; tags that make objects are refused."""
    data = read_bytes(path, MAX_YAML_BYTES)
    try:
        _check_depth(data, path)
        content = yaml.load(data, Loader=_LOADER)
    except HoocError:
        raise
    # Besides YAMLError, PyYAML lets whatever a strange scalar causes through.
    except Exception as error:
        mark = getattr(error, 'problem_mark', None)
        where = f' at line {mark.line + 1}' if mark else ''
        raise HoocError(f'{path}: not valid YAML{where}; correct the syntax there') from None
    return mapping(content, f'{path}:')


def read_json(path):
    """Return the mapping that a JSON file holds."""
    data = read_bytes(path, MAX_JSON_BYTES)
    try:
        content = json.loads(data)
    except (ValueError, RecursionError) as error:
        where = f' at line {error.lineno}' if isinstance(error, json.JSONDecodeError) else ''
        raise HoocError(f'{path}: not valid JSON{where}; correct the syntax there') from None
    return mapping(content, f'{path}:')


@contextmanager
def written_whole(path):
    """
    Give the Path of an empty file to write to, which then takes the place of `path` at once.

    A reader sees the old content or the new, never a part; where writing fails, the old.

    :raises HoocError: where nothing can be written there.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f'.{path.name}.')
        os.close(handle)
        try:
            yield Path(temporary)
            os.chmod(temporary, 0o644)
            os.replace(temporary, path)
        except BaseException:
            os.unlink(temporary)
            raise
    except OSError as error:
        raise HoocError(f'{path}: cannot be written ({error.strerror}); '
                        'choose another place or free some space') from None


def write_atomically(path, content):
    """Write a text file as `written_whole`."""
    with written_whole(path) as part:
        part.write_text(content, encoding='utf-8')


def mapping(value, where):
    """Return `value` if it is a mapping; `where` names file and field in the error."""
    if not isinstance(value, dict):
        raise HoocError(f'{where} holds {_kind(value)}; give "key: value" entries')
    return value


def sequence(value, where):
    """Return `value` if it is a list."""
    if not isinstance(value, list):
        raise HoocError(f'{where} holds {_kind(value)}; give a list')
    return value


def required(entry, key, where):
    """Return entry[key], naming the missing field where there is none."""
    if key not in entry:
        raise HoocError(f'{where} {key} is missing; add it')
    return entry[key]


def numbers(value, count, where):
    """Return a float64 array of exactly `count` finite numbers (a count of None: any)."""
    values = sequence(value, where)
    if count is not None and len(values) != count:
        raise HoocError(f'{where} has {len(values)} numbers; give {count}')
    return np.array([number(v, where) for v in values], np.float64)


def number(value, where):
    """Return a finite float; YAML reads 1e-3 (without a point) as text, so text may do."""
    try:
        if isinstance(value, bool):
            raise ValueError
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise HoocError(f'{where} contains {shown(value)}; give a number') from None
    if not math.isfinite(result):
        raise HoocError(f'{where} contains {value}; give a finite number')
    return result


def whole(value, low, high, where):
    """Return an int in low..high."""
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise HoocError(f'{where} is {shown(value)}; give a whole number from {low} to {high}')
    return value


def text(value, where):
    """Return `value` if it is text."""
    if not isinstance(value, str):
        raise HoocError(f'{where} is {shown(value)}; give text, in quotes if it is a number')
    return value


def name(value, where):
    """Return text that may serve as a file name: letters, digits, _ - and ."""
    if not isinstance(value, str) or not _NAME.match(value) or len(value) > 100:
        raise HoocError(f'{where} is {shown(value)}; use letters, digits, _, - and . '
                        '(in quotes if it is a number)')
    return value


def ros_token(value, where):
    """Return text that may stand in a topic's name."""
    if not isinstance(value, str) or not _ROS_TOKEN.match(value) or len(value) > 100:
        raise HoocError(f'{where} is {shown(value)}; topics are named after it, so begin with '
                        'a letter and use letters, digits and _')
    return value


def unique(names, where):
    """Return `names` as a tuple if no two are equal."""
    seen = set()
    for item in names:
        if item in seen:
            raise HoocError(f'{where} names {item!r} twice; remove or rename one of them')
        seen.add(item)
    return tuple(names)


def inside(root, relative, where):
    """Return root / relative, an existing file that lies inside `root`, links resolved."""
    if not isinstance(relative, str) or not relative or '\0' in relative:
        raise HoocError(f'{where} is {shown(relative)}; give a file name relative to {root}')
    path = Path(root) / relative
    if not path.resolve().is_relative_to(Path(root).resolve()):
        raise HoocError(f'{where} is {shown(relative)}, which leaves {root}; '
                        'move the file inside and name it relative to that folder')
    if not path.is_file():
        raise HoocError(f'{where} names {path}, which does not exist; '
                        'add the file or correct the name')
    return path


def _check_depth(data, path):
    """Refuse deeply nested YAML: libyaml's composer would overflow the stack and crash."""
    depth = 0
    for event in yaml.parse(data, Loader=_LOADER):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_YAML_DEPTH:
            raise HoocError(f'{path}: nested more than {MAX_YAML_DEPTH} levels deep at line '
                            f'{event.start_mark.line + 1}; check that this is the right file')


def shown(value):
    """Return a short text of a value that a stranger wrote, however large it is."""
    return reprlib.repr(value)[:60]


def _kind(value):
    """Return what a parsed value is, in a user's words."""
    return {dict: 'entries', list: 'a list', str: 'text', type(None): 'nothing'}.get(
        type(value), shown(value))
