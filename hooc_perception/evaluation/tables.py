# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Tables as plain records, printed on a terminal or in Markdown."""

from collections.abc import Iterable
from dataclasses import dataclass
import math
from typing import TypeAlias

Cell: TypeAlias = str | int | float | None


@dataclass(frozen=True)
class Table:
    """
    A titled table.

    :ivar header: column titles; the first column is a name, the rest align right.
    :ivar rows: cells: str, int, float (two decimals unless a string), None = empty.
    :ivar notes: sentences below the table.
    :ivar bold: indices of the rows that summarize the others.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    notes: tuple[str, ...] = ()
    bold: tuple[int, ...] = ()


def cell(value: Cell) -> str:
    """Return the text of one cell."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return '-'
    if isinstance(value, float):
        return f'{value:.2f}'
    return str(value)


def _texts(table: Table) -> list[list[str]]:
    """Return the text of every cell, row by row."""
    return [[cell(v) for v in row] for row in table.rows]


def to_text(table: Table) -> str:
    """Return the table for a terminal."""
    rows = _texts(table)
    widths = [max(len(str(h)), *(len(r[i]) for r in rows)) if rows else len(str(h))
              for i, h in enumerate(table.header)]

    def line(cells: Iterable[str]) -> str:
        return '  '.join(c.ljust(w) if i == 0 else c.rjust(w)
                         for i, (c, w) in enumerate(zip(cells, widths))).rstrip()

    rule = '-' * (sum(widths) + 2 * (len(widths) - 1))
    out = [table.title, line([str(h) for h in table.header]), rule]
    for index, row in enumerate(rows):
        if index in table.bold and index - 1 not in table.bold and index:
            out.append(rule)
        out.append(line(row))
    return '\n'.join([*out, *table.notes])


def to_markdown(table: Table) -> str:
    """Return the table as GitHub Markdown."""
    out = [f'### {table.title}', '',
           '| ' + ' | '.join(str(h) for h in table.header) + ' |',
           '|---|' + '---:|' * (len(table.header) - 1)]
    for index, row in enumerate(_texts(table)):
        cells = [f'**{c}**' for c in row] if index in table.bold else row
        out.append('| ' + ' | '.join(c.replace('|', '\\|') for c in cells) + ' |')
    return '\n'.join(out + ([''] + list(table.notes) if table.notes else [])) + '\n'
