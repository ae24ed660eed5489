# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Tables as plain records, printed on a terminal or in Markdown."""

from dataclasses import dataclass
import math


@dataclass(frozen=True)
class Table:
    """
    A titled table.

    :ivar header: column titles; the first column is a name, the rest align right.
    :ivar rows: cells: str, int, float (two decimals unless a string), None = nothing.
    :ivar notes: sentences below the table.
    :ivar bold: indices of the rows that sum up the others.
    """

    title: str
    header: tuple
    rows: tuple
    notes: tuple = ()
    bold: tuple = ()


def cell(value):
    """Return the text of one cell."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return '-'
    if isinstance(value, float):
        return f'{value:.2f}'
    return str(value)


def _texts(table):
    return [[cell(v) for v in row] for row in table.rows]


def to_text(table):
    """Return the table for a terminal of fixed-width letters."""
    rows = _texts(table)
    widths = [max(len(str(h)), *(len(r[i]) for r in rows)) if rows else len(str(h))
              for i, h in enumerate(table.header)]

    def line(cells):
        return '  '.join(c.ljust(w) if i == 0 else c.rjust(w)
                         for i, (c, w) in enumerate(zip(cells, widths))).rstrip()

    rule = '-' * (sum(widths) + 2 * (len(widths) - 1))
    out = [table.title, line([str(h) for h in table.header]), rule]
    for index, row in enumerate(rows):
        if index in table.bold and index - 1 not in table.bold and index:
            out.append(rule)
        out.append(line(row))
    return '\n'.join([*out, *table.notes])


def to_markdown(table):
    """Return the table as GitHub Markdown."""
    out = [f'### {table.title}', '',
           '| ' + ' | '.join(str(h) for h in table.header) + ' |',
           '|---|' + '---:|' * (len(table.header) - 1)]
    for index, row in enumerate(_texts(table)):
        cells = [f'**{c}**' for c in row] if index in table.bold else row
        out.append('| ' + ' | '.join(c.replace('|', '\\|') for c in cells) + ' |')
    return '\n'.join(out + ([''] + list(table.notes) if table.notes else [])) + '\n'
