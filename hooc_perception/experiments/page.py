# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Write the tables into the pages of the documentation, between markers.

`<!-- results: NAME -->` and `<!-- end of results -->` enclose what is written here; everything
else on a page is prose. The tables of a set that was not run stay as they are.
"""

from collections.abc import Iterable, Mapping, Sequence
import json
from pathlib import Path
import re
import shutil
from typing import Any

from hooc_perception.errors import HoocError
from hooc_perception.evaluation import sequences
from hooc_perception.evaluation.tables import to_markdown
from hooc_perception.evaluation.worst import worst_table
from hooc_perception.experiments import ablations
from hooc_perception.experiments.detail_tables import details_of
from hooc_perception.experiments.experiment_tables import step_table, summary_of
from hooc_perception.experiments.plan import INCREMENTAL, Layout, PROFILES, SCORED
from hooc_perception.experiments.records import Record
from hooc_perception.io.scenes.files import write_atomically

END = '<!-- end of results -->'
SECTION = re.compile(r'(<!-- results: ([\w ]+) -->\n).*?(' + re.escape(END) + ')', re.S)
PICTURES = {'errors': 'Share of the true objects of {} below an error of the centre and of the '
                      'rotation',
            'categories': 'Found and localized share of each category of {}',
            'certainty': 'Reliability diagram of the scores of {}'}
WORST = 'What best missed and got wrong in its worst scenes of {}'


def sections_of(root: str | Path, sets: Iterable[str],
                records: Mapping[str, Record]) -> dict[str, str]:
    """
    Return {marker name: Markdown} of everything that has been computed.

    :param sets: names of sets.
    :param records: {step name: Record}.
    """
    out = {}
    for name in sets:
        layout = Layout(Path(root), name)
        scores = _contents({row: layout.scores(row) for row in (*SCORED, INCREMENTAL)})
        moving = {row: s['results'][0]['sequences'] for row, s in scores.items()
                  if 'sequences' in s['results'][0]}
        if moving:
            out[name] = '\n'.join(map(to_markdown, sequences.tables_of(
                [(f'`{row}`', figures) for row, figures in moving.items()])))
        elif scores:
            posed, masked = ({row: s for row, s in scores.items() if key in s['results'][0]}
                             for key in ('mean', 'masks'))
            stages = _contents({row: layout.stages(row) for row in PROFILES if row in posed})
            out[name] = '\n'.join(map(to_markdown, summary_of(
                name, posed, masked, {row: s['stages'] for row, s in stages.items()}, records)))
            out[f'{name} details'] = '\n'.join(map(to_markdown, details_of(posed, masked)))
        less = _contents({s.row: layout.scores(s.row) for s in ablations.SWITCHES})
        if less:
            out[f'{name} {ablations.ROW}'] = '\n'.join(map(to_markdown, ablations.tables_of(
                name, scores.get('best'), less, records)))
        if pictures := _pictures(layout):
            out[f'{name} pictures'] = '\n\n'.join(
                f'![{text.format(name)}](images/results_{name}_{source.stem}.png)'
                for source, text in pictures.items())
        worst = layout.worst / 'worst.json'
        if worst.exists():
            out[f'{name} worst'] = to_markdown(worst_table(json.loads(worst.read_text())))
    if records:
        out['steps'] = to_markdown(step_table(records))
    return out


def _pictures(layout: Layout) -> dict[Path, str]:
    """Return {file: what it shows} of the pictures of a set that exist."""
    every = {layout.plots / f'{name}.png': text for name, text in PICTURES.items()}
    every[layout.worst / 'worst.png'] = WORST
    return {path: text for path, text in every.items() if path.exists()}


def _contents(files: Mapping[str, Path]) -> dict[str, Any]:
    """Return {row: content of its JSON file} of the rows whose file exists."""
    return {row: json.loads(path.read_text()) for row, path in files.items() if path.exists()}


def inserted(text: str, sections: Mapping[str, str],
             where: str = 'the page') -> tuple[str, set[str]]:
    """
    Return a page's text with its sections replaced, and the set of the names that it has.

    :raises HoocError: where a section has no end.
    """
    if text.count('<!-- results: ') != len(SECTION.findall(text)):
        raise HoocError(f'{where} has a marker <!-- results: ... --> without {END}; add it')
    names = {name for _, name, _ in SECTION.findall(text)}

    def put(match: re.Match[str]) -> str:
        head, name, end = match.groups()
        return f'{head}\n{sections[name].strip()}\n\n{end}' if name in sections else match[0]

    return SECTION.sub(put, text), names


def write_pages(pages: Sequence[Path], images: str | Path, root: str | Path,
                sets: Iterable[str], records: Mapping[str, Record]) -> list[Path]:
    """
    Write the sections into pages and copy pictures beside them.

    :param pages: Markdown files that hold markers.
    :param images: folder of pictures; results_SET_NAME.png of sets that the pages name.
    :return: [Path] of what was written.
    """
    sections, written = sections_of(root, sets, records), []
    named: set[str] = set()
    for page in pages:
        text, names = inserted(page.read_text(), sections, str(page))
        named |= names
        if names & set(sections):
            write_atomically(page, text)
            written.append(page)
    for name in sorted(named & set(sets)):
        for source in _pictures(Layout(Path(root), name)):
            written.append(Path(images) / f'results_{name}_{source.stem}.png')
            shutil.copyfile(source, written[-1])
    return written
