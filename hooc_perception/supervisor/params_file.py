# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A user's file of parameters: which of its sections reach no node."""

import difflib
import re

from hooc_perception.scenes import files


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
    for section in _sections(content if isinstance(content, dict) else {}):
        pattern = section if section.startswith('/') else f'/{section}'
        if any(_matches(pattern, node) for node in nodes):
            continue
        last = pattern.rpartition('/')[2]
        near = difflib.get_close_matches(last, names, 1, 0.5)
        sentences.append(
            f'{path}: the section {section!r} reaches no node'
            + (f'; write /**/{near[0]}' if near else f'; there are {", ".join(nodes)}'))
    return sentences


def _sections(content, prefix=''):
    """Yield the names of all nodes that a file sets parameters of; namespaces may be nested."""
    for key, value in content.items():
        name = f'{prefix}/{key}' if prefix else str(key)
        if not isinstance(value, dict):
            continue
        if 'ros__parameters' in value:
            yield name
        yield from _sections({k: v for k, v in value.items() if k != 'ros__parameters'}, name)


def _matches(pattern, node):
    """Return whether a node's full name is meant by a section: ** any tokens, * one of them."""
    expression = re.escape(pattern).replace(r'/\*\*', '(/.*)?').replace(r'\*', '[^/]+')
    return re.fullmatch(expression, node) is not None
