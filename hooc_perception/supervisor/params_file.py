# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The parameter file of a user: sections that reach no node, and values that override it."""

from collections.abc import Iterator, Mapping, Sequence
import difflib
import json
from pathlib import Path
import re
import tempfile
from typing import Any, IO

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import files
from hooc_perception.ros.lifecycle.misaddressed import unknown_parameters


def unreached_sections(path: Path, names: Sequence[str], namespace: str) -> list[str]:
    """
    Return one sentence per section of a ROS parameter file that applies to no node.

    :param names: of the nodes that are started.
    :param namespace: of the nodes.
    :raises HoocError: if the file is not YAML.
    """
    content = files.read_yaml(path)
    nodes = [f'{namespace.rstrip("/")}/{name}' for name in names]
    sentences = []
    for section, _ in _sections(content):
        if any(_reaches(section, node) for node in nodes):
            continue
        last = section.rpartition('/')[2]
        near = difflib.get_close_matches(last, names, 1, 0.5)
        sentences.append(
            f'{path}: the section {section!r} applies to no node'
            + (f'; write /**/{near[0]}' if near else f'; the nodes are {", ".join(nodes)}'))
    return sentences


def check_parameters(path: Path, names: Sequence[str], namespace: str) -> None:
    """
    Raise HoocError where a ROS parameter file gives the nodes a parameter that none of them has.

    :param names, namespace: as `unreached_sections`.
    """
    nodes = [f'{namespace.rstrip("/")}/{name}' for name in names]
    for section, values in _sections(files.read_yaml(path)):
        if any(_reaches(section, node) for node in nodes):
            for sentence in unknown_parameters(_flat(values)):
                raise HoocError(f'{path}: section {section!r}: {sentence}')


def open_last_file(parameters: Mapping[str, Any], node: str, params_file: Path | None = None,
                   defaults: Mapping[str, Any] | None = None) -> IO[str]:
    """
    Return an open temporary file of parameters that override those of `params_file`.

    If several sections apply to a node, rcl prefers the one whose first mention comes last,
    regardless of the order of files and of `-p` (which is the section `/**`); within one
    section, the last file wins. Therefore the values stand in all sections of the user's file;
    only the process that gets this file reads it. It has no name and disappears when it is
    closed, however this process ends.

    :param parameters: {name: value}; None and empty lists, which ROS cannot express, are
        omitted.
    :param node: full name of the node.
    :param defaults: {name: value} for what neither `parameters` nor the user's file set.
    """
    try:
        content = files.read_yaml(params_file) if params_file else {}
    except HoocError:
        content = {}    # it changed since the start: the node itself reports the problem
    sections = dict(_sections(content))
    set_by_user = {name for section, values in sections.items() if _reaches(section, node)
                   for name in (values if isinstance(values, dict) else ())}
    values = {name: value for name, value in (defaults or {}).items() if name not in set_by_user}
    values.update((name, value) for name, value in parameters.items()
                  if value is not None and value not in ((), []))
    file = tempfile.TemporaryFile('w', encoding='utf-8')
    # JSON is YAML with unambiguous types.
    json.dump({section: {'ros__parameters': values} for section in (*sections, node)}, file,
              ensure_ascii=False)
    file.flush()
    return file


def _sections(content: Mapping[Any, Any], prefix: str = '') -> Iterator[tuple[str, Any]]:
    """Yield (name, parameters) of each section of a file; namespaces may be nested."""
    for key, value in content.items():
        name = f'{prefix}/{key}' if prefix else str(key)
        if not isinstance(value, dict):
            continue
        if 'ros__parameters' in value:
            yield name, value['ros__parameters']
        yield from _sections({k: v for k, v in value.items() if k != 'ros__parameters'}, name)


def _flat(values: object, prefix: str = '') -> Iterator[str]:
    """Yield the names of parameters, which may be nested."""
    for key, value in values.items() if isinstance(values, dict) else ():
        if isinstance(value, dict):
            yield from _flat(value, f'{prefix}{key}.')
        else:
            yield f'{prefix}{key}'


def _reaches(section: str, node: str) -> bool:
    """Return whether a section applies to the full name of a node: ** any tokens, * one token."""
    pattern = section if section.startswith('/') else f'/{section}'
    expression = re.escape(pattern).replace(r'/\*\*', '(/.*)?').replace(r'\*', '[^/]+')
    return re.fullmatch(expression, node) is not None
