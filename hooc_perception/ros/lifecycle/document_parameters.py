# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Write the parameter tables of docs/nodes.md from the declarations.

    python -m hooc_perception.ros.lifecycle.document_parameters docs/nodes.md

A table stands between `<!-- parameters: NAME -->` and `<!-- end -->`, where NAME is a class of
parameters, `module:Class`. Profiles that give a stage other defaults have one column each.
"""

from collections.abc import Iterable, Mapping
from dataclasses import fields
import importlib
import re
import sys
from typing import Any

from hooc_perception.chain import PROFILES
from hooc_perception.core.config import Config
from hooc_perception.ros.lifecycle.stage_config import StageConfig

_BLOCK = re.compile(r'(<!-- parameters: (\S+?):(\w+)(?: as (\w+))? -->\n).*?(<!-- end -->)',
                    re.DOTALL)


def table(config: Config, section: str = '',
          profiles: Mapping[str, Config] | None = None) -> str:
    """
    Return the Markdown table of a Config's fields.

    :param section: prefix of the names, such as `parse`.
    :param profiles: {profile: Config} whose values differ, or None.
    """
    columns = {name: c.values() for name, c in (profiles or {'default': config}).items()}
    lines = ['| parameter | ' + ' | '.join(columns) + ' | range | meaning |',
             '|---|' + '---|' * len(columns) + '---|---|']
    common = {f.name for f in fields(StageConfig)} if type(config) is not StageConfig else set()
    declared = config.parameters()
    for other in (profiles or {}).values():
        declared |= other.parameters()
    for f in declared.values():
        if f.name in common and not section:
            continue    # listed once, for all nodes
        m = f.metadata
        name = f'{section}.{f.name}' if section else f.name
        # A method that has no such parameter rejects it.
        values = ' | '.join(_value(c[f.name]) if f.name in c else '-' for c in columns.values())
        change = ' *Changes while running.*' if m['runtime'] else (
            ' *Read-only.*' if m.get('read_only') else '')
        lines.append(f'| `{name}` | {values} | {_range(m)} | {m["doc"]}{change} |')
    return '\n'.join(lines) + '\n'


def documented(text: str) -> str:
    """Return a Markdown text with every table of parameters rewritten."""
    def fill(match: re.Match[str]) -> str:
        start, module, name, stage, end = match.groups()
        config = getattr(importlib.import_module(module), name)()
        profiles = None
        if stage:
            from hooc_perception.core.profiles import profile
            profiles = {p: profile(p).stage(stage) for p in PROFILES}
        return f'{start}{table(config, stage or "", profiles)}{end}'
    return _BLOCK.sub(fill, text)


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return '`[' + ', '.join(map(str, value)) + ']`'
    if isinstance(value, str):
        return f'`{value}`' if value else 'empty'
    return str(value).lower() if isinstance(value, bool) else _number(value)


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f'{value:g}'


def _range(m: Mapping[str, Any]) -> str:
    if m['choices']:
        return ', '.join(f'`{choice}`' if choice else 'empty' for choice in m['choices'])
    if m['low'] is None and m['high'] is None:
        return ''
    low, high = ('' if bound is None else _number(bound) for bound in (m['low'], m['high']))
    return f'{low} .. {high} {m["unit"]}'.strip()


def main(paths: Iterable[str]) -> int:
    """Rewrite the tables of files; return the exit code."""
    for path in paths:
        with open(path, encoding='utf-8') as file:
            text = file.read()
        with open(path, 'w', encoding='utf-8') as file:
            file.write(documented(text))
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
