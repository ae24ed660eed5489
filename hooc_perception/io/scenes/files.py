# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Read files of unknown origin within size limits, and write files atomically.

Every reading function raises HoocError with one sentence: file, cause, fix.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import json
import os
from pathlib import Path
import re
import tempfile
from typing import Any

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.fields import mapping, sequence, short_repr
import yaml

MAX_YAML_BYTES = 8 << 20
MAX_YAML_DEPTH = 32
# BOP's scene_gt.json of a thousand images has some ten megabytes.
MAX_JSON_BYTES = 64 << 20
_LAST_MARK = re.compile(rb'\n---\s*\Z')
_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


def read_bytes(path: str | Path, limit: int) -> bytes:
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


def read_yaml(path: str | Path) -> dict[str, Any]:
    """
    Return the mapping in a YAML file.

    Tags that construct objects are rejected, and so are keys that stand twice in one mapping,
    of which YAML would silently keep the last.
    """
    return mapping(_yaml_content(path), f'{path}:')


def read_yaml_list(path: str | Path) -> list[Any]:
    """Return the list in a YAML file; HoocError as `read_yaml`."""
    return sequence(_yaml_content(path), f'{path}:')


def _yaml_content(path: str | Path) -> Any:
    """Return what a YAML file holds."""
    data = read_bytes(path, MAX_YAML_BYTES)
    try:
        # `ros2 topic echo --once` ends its only document with the mark of another.
        data = _LAST_MARK.sub(b'\n', data)
        _check_events(data, path)
        return yaml.load(data, Loader=_LOADER)
    except HoocError:
        raise
    # Besides YAMLError, PyYAML lets through whatever a malformed scalar causes.
    except Exception as error:
        mark = getattr(error, 'problem_mark', None)
        where = f' at line {mark.line + 1}' if mark else ''
        raise HoocError(f'{path}: not valid YAML{where}; correct the syntax there') from None


def read_json(path: str | Path) -> dict[str, Any]:
    """Return the mapping in a JSON file."""
    data = read_bytes(path, MAX_JSON_BYTES)
    try:
        content = json.loads(data)
    except (ValueError, RecursionError) as error:
        where = f' at line {error.lineno}' if isinstance(error, json.JSONDecodeError) else ''
        raise HoocError(f'{path}: not valid JSON{where}; correct the syntax there') from None
    return mapping(content, f'{path}:')


@contextmanager
def atomic_file(path: str | Path) -> Iterator[Path]:
    """
    Yield the path of an empty temporary file that replaces `path` when the block ends.

    A reader sees the old content or the new, never a part of it. If the block fails, the old
    content stays.

    :raises HoocError: if nothing can be written there.
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


def write_atomically(path: str | Path, content: str) -> None:
    """Write a text file by `atomic_file`."""
    with atomic_file(path) as part:
        part.write_text(content, encoding='utf-8')


def file_inside(root: str | Path, relative: object, where: str) -> Path:
    """Return root / relative, an existing file inside `root` after links are resolved."""
    if not isinstance(relative, str) or not relative or '\0' in relative:
        raise HoocError(f'{where} is {short_repr(relative)}; give a file name relative to {root}')
    path = Path(root) / relative
    if not path.resolve().is_relative_to(Path(root).resolve()):
        raise HoocError(f'{where} is {short_repr(relative)}, which leaves {root}; '
                        'move the file inside and name it relative to that folder')
    if not path.is_file():
        raise HoocError(f'{where} names {path}, which does not exist; '
                        'add the file or correct the name')
    return path


def _check_events(data: bytes, path: str | Path) -> None:
    """Reject doubled keys, and nesting so deep that libyaml's composer would crash."""
    # Of each open collection: the keys so far and whether a key comes next; None for a list.
    stack: list[tuple[set[str], list[bool]] | None] = []
    for event in yaml.parse(data, Loader=_LOADER):
        if isinstance(event, yaml.CollectionEndEvent):
            stack.pop()
            continue
        if not isinstance(event, yaml.NodeEvent):
            continue
        line = event.start_mark.line + 1
        if stack and stack[-1] is not None:
            keys, key_next = stack[-1]
            if key_next[0] and isinstance(event, yaml.ScalarEvent):
                # Any number of merges is allowed.
                if event.value in keys and event.value != '<<':
                    raise HoocError(f'{path}: the key {short_repr(event.value)} stands twice in '
                                    f'one entry, again at line {line}; keep one of the two')
                keys.add(event.value)
            key_next[0] = not key_next[0]
        if isinstance(event, yaml.CollectionStartEvent):
            stack.append((set(), [True]) if isinstance(event, yaml.MappingStartEvent) else None)
            if len(stack) > MAX_YAML_DEPTH:
                raise HoocError(f'{path}: nested more than {MAX_YAML_DEPTH} levels deep at line '
                                f'{line}; check that this is the right file')
