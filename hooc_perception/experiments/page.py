# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Put the tables into the pages of the documentation, between markers.

`<!-- results: NAME -->` and `<!-- end of results -->` enclose what is written here; everything
else on a page is prose. A set that was not run leaves its tables as they are.
"""

import json
from pathlib import Path
import re
import shutil

from hooc_perception.errors import HoocError
from hooc_perception.evaluation.tables import to_markdown
from hooc_perception.evaluation.worst import worst_table
from hooc_perception.experiments import ablations
from hooc_perception.experiments import experiment_tables as tables
from hooc_perception.experiments.plan import Layout, SCORED
from hooc_perception.io.scenes.files import write_atomically

END = '<!-- end of results -->'
SECTION = re.compile(r'(<!-- results: ([\w ]+) -->\n).*?(' + re.escape(END) + ')', re.S)
PICTURES = ('errors', 'categories', 'certainty')


def sections_of(root, sets, records):
    """
    Return {marker name: Markdown} of everything that has been computed.

    :param sets: names of sets.
    :param records: {step name: Record}.
    """
    out = {}
    for name in sets:
        layout = Layout(Path(root), name)
        scores = _scores(layout, SCORED)
        if scores:
            summary, details = tables.of_set(name, scores, records)
            out[name] = '\n'.join(map(to_markdown, summary))
            out[f'{name} details'] = '\n'.join(map(to_markdown, details))
        less = _scores(layout, [switch.row for switch in ablations.SWITCHES])
        if less:
            out[f'{name} {ablations.ROW}'] = '\n'.join(map(to_markdown, ablations.tables_of(
                name, scores.get('best'), less, records)))
        worst = layout.worst / 'worst.json'
        if worst.exists():
            out[f'{name} worst'] = to_markdown(worst_table(json.loads(worst.read_text())))
    if records:
        out['steps'] = to_markdown(tables.step_table(records))
    return out


def _scores(layout, rows):
    """Return {row: content of its scores file} of the rows that have one."""
    return {row: json.loads(layout.scores(row).read_text())
            for row in rows if layout.scores(row).exists()}


def inserted(text, sections, where='the page'):
    """
    Return a page's text with its sections replaced, and the set of the names that it has.

    :raises HoocError: a section without an end.
    """
    if text.count('<!-- results: ') != len(SECTION.findall(text)):
        raise HoocError(f'{where} has a marker <!-- results: ... --> without {END}; add that')
    names = {name for _, name, _ in SECTION.findall(text)}

    def put(match):
        head, name, end = match.groups()
        return f'{head}\n{sections[name].strip()}\n\n{end}' if name in sections else match[0]

    return SECTION.sub(put, text), names


def write_pages(pages, images, root, sets, records):
    """
    Write the sections into pages and copy pictures beside them.

    :param pages: Markdown files that hold markers.
    :param images: folder of pictures; results_SET_NAME.png of sets that the pages name.
    :return: [Path] of what was written.
    """
    sections, written, named = sections_of(root, sets, records), [], set()
    for page in pages:
        text, names = inserted(page.read_text(), sections, str(page))
        named |= names
        if names & set(sections):
            write_atomically(page, text)
            written.append(page)
    for name in sorted(named & set(sets)):
        layout = Layout(Path(root), name)
        for folder, picture in (*((layout.plots, p) for p in PICTURES), (layout.worst, 'worst')):
            source = folder / f'{picture}.png'
            if source.exists():
                written.append(Path(images) / f'results_{name}_{picture}.png')
                shutil.copyfile(source, written[-1])
    return written
