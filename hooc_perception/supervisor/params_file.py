# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A user's file of parameters: which of its sections reach no node, and what wins over it."""

import difflib
import json
import re
import tempfile

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import files


def unreached_sections(path, names, namespace):
    """
    Return one sentence for each section of a ROS parameter file that no node takes.

    :param names: of the nodes that are started.
    :param namespace: that they are in.
    :raises HoocError: where the file is no YAML.
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
            f'{path}: the section {section!r} reaches no node'
            + (f'; write /**/{near[0]}' if near else f'; there are {", ".join(nodes)}'))
    return sentences


def open_last_file(parameters, node, params_file=None, defaults=None):
    """
    Return an open temporary file of parameters that win over those of `params_file`.

    Where several sections are meant for a node, rcl lets the one win that was first named last,
    whatever the order of files and `-p` (which is the section `/**`); within one section, the
    latest file wins. So the values stand in all sections of the user's file: only the process
    that is given this file reads it. It has no name and is gone when it is closed, however this
    process ends.

    :param parameters: {name: value}; empty lists, which ROS cannot write, and None are left out.
    :param node: full name of the node.
    :param defaults: {name: value} of what holds unless the user's file or `parameters` says
        otherwise.
    """
    try:
        content = files.read_yaml(params_file) if params_file else {}
    except HoocError:
        content = {}    # changed since the start: the node itself will say what is wrong
    sections = dict(_sections(content))
    set_by_user = {name for section, values in sections.items() if _reaches(section, node)
                   for name in (values if isinstance(values, dict) else ())}
    values = {name: value for name, value in (defaults or {}).items() if name not in set_by_user}
    values.update((name, value) for name, value in parameters.items()
                  if value is not None and value not in ((), []))
    file = tempfile.TemporaryFile('w', encoding='utf-8')
    # JSON is YAML that leaves no doubt about types.
    json.dump({section: {'ros__parameters': values} for section in (*sections, node)}, file,
              ensure_ascii=False)
    file.flush()
    return file


def _sections(content, prefix=''):
    """Yield (name, parameters) of all nodes that a file is for; namespaces may be nested."""
    for key, value in content.items():
        name = f'{prefix}/{key}' if prefix else str(key)
        if not isinstance(value, dict):
            continue
        if 'ros__parameters' in value:
            yield name, value['ros__parameters']
        yield from _sections({k: v for k, v in value.items() if k != 'ros__parameters'}, name)


def _reaches(section, node):
    """Return whether a node's full name is meant by a section: ** any tokens, * one of them."""
    pattern = section if section.startswith('/') else f'/{section}'
    expression = re.escape(pattern).replace(r'/\*\*', '(/.*)?').replace(r'\*', '[^/]+')
    return re.fullmatch(expression, node) is not None
