# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What each part of the profile `best` contributes: parts switched off one at a time."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from hooc_perception.evaluation.masks import EXPLAINED_IOU
from hooc_perception.evaluation.tables import Cell, Table
from hooc_perception.experiments.records import Record, seconds_per_scene
import numpy as np

ROW = 'ablations'
RIGHT_RAD = np.radians(15)


@dataclass(frozen=True)
class Switch:
    """
    A part that is switched off.

    :ivar name: what the table calls it.
    :ivar parameters: STAGE.NAME=VALUE texts for `hooc parse --set-parameter`.
    """

    name: str
    parameters: tuple[str, ...]

    @property
    def row(self) -> str:
        """Return what its files and steps are called, below those of the row `ablations`."""
        return f'{ROW}/{self.name.replace(" ", "_")}'


NO_VERIFIER = Switch('no verifier', ('parse.verify_weight=0',))
# Setting B of a profile without its verifier; its answers lie in a folder of this name.
UNVERIFIED = 'B_no_verifier'

SWITCHES = (
    Switch('flat table', ('observe.uneven_m=0',)),
    Switch('no smoothing of probabilities', ('classify.smoothing_steps=0',)),
    Switch('no refinement of hypotheses', ('propose.refine_steps=0', 'propose.polish_steps=0')),
    Switch('no classifier in parsing', ('parse.category_weight=0',)),
    Switch('no normals', ('parse.normal_weight=0',)),
    Switch('no free-space term', ('parse.free_weight=0',)),
    Switch('no size prior', ('parse.size_prior=0',)),
    Switch('no overlap cost', ('parse.overlap=0',)),
    NO_VERIFIER,
    Switch('no re-proposal', ('parse.rounds=0',)),
    Switch('no half turns', ('parse.turn_steps=0',)),
    Switch('no refinement in parsing', ('parse.polish_steps=0',)),
)


@dataclass(frozen=True)
class _Measure:
    """
    One way to score: by poses or by masks.

    :ivar key: what a result holds where it was scored like this.
    :ivar header: columns of `figures`; `change` names the one whose change has a column.
    :ivar verdicts: result -> [whether each object counts there], in the set's order.
    """

    key: str
    header: tuple[str, ...]
    change: str
    figures: Callable[[dict[str, Any]], tuple[float, ...]]
    verdicts: Callable[[dict[str, Any]], list[bool]]


def tables_of(name: str, best: dict[str, Any] | None, scores: Mapping[str, Any],
              records: Mapping[str, Record]) -> list[Table]:
    """
    Return the tables of one set: by poses, by masks, or both; [] where nothing was run.

    :param best: content of the scores file of the row `best`, None where there is none.
    :param scores: {Switch.row: content of its scores file}.
    :param records: {step name: Record}, for the processor time and the code that ran.
    """
    shown = [(switch, scores[switch.row]['results'][0]) for switch in SWITCHES
             if switch.row in scores]
    full = next(r for r in best['results'] if r['setting'] == 'A') if best else {}
    out = []
    for measure in MEASURES:
        results = [(switch, result) for switch, result in shown if measure.key in result]
        if results:
            out.append(_table(name, measure, full if measure.key in full else None, results,
                              records))
    return out


def _table(name: str, measure: _Measure, full: dict[str, Any] | None,
           results: list[tuple[Switch, dict[str, Any]]], records: Mapping[str, Record]) -> Table:
    """Return the table of one measure; `full` is the result of `best` without a switch."""
    at = measure.header.index(measure.change)
    rows: list[tuple[Cell, ...]] = []
    if full:
        rows.append(('`best`', None, *_texts(measure.figures(full)), None, None, None,
                     _seconds(name, 'best', full, records)))
    for switch, result in results:
        cells, change = measure.figures(result), (None, None, None)
        if full:
            lost, gained = _exchanged(measure.verdicts(full), measure.verdicts(result))
            change = (f'{cells[at] - measure.figures(full)[at]:+.3f}', lost, gained)
        rows.append((switch.name, ' '.join(f'`{p}`' for p in switch.parameters), *_texts(cells),
                     *change, _seconds(name, switch.row, result, records)))
    return Table(
        f'One part of `best` off: {name}',
        ('', 'changed', *measure.header, f'{measure.change}, change', 'lost', 'gained', 'CPU s'),
        tuple(rows),
        ('All rows use the model of `best`; the parameters are for `hooc parse --set-parameter`. '
         f'lost, gained: objects that count ({measure.change}) in `best` and not in the row, and '
         'vice versa; with one seed, a few of both are noise. CPU s: processor seconds per '
         'scene.', *_other_code(name, [switch.row for switch, _ in results], records)),
        (0,) if full else ())


def turned_right(result: Mapping[str, Any]) -> float:
    """Return the share of objects localized within 15 degrees of rotation, over scenes."""
    return float(np.mean([
        np.mean([o['localized'] and o['rotation_rad'] < RIGHT_RAD for o in s['objects']])
        for s in result['scenes'] if s['objects']]))


def _posed(result: dict[str, Any]) -> tuple[float, ...]:
    """Return found, localized, < 2 cm, < 15 deg, false categories."""
    mean = result['mean']
    return (*(mean[c] for c in ('found', 'localized', 'tight')), turned_right(result),
            mean['false_categories'])


def _masked(result: dict[str, Any]) -> tuple[float, ...]:
    """Return recall and precision of masks."""
    explained, labelled, estimated = (sum(m[k] for m in result['masks'])
                                      for k in ('explained', 'labelled', 'estimated'))
    return explained / max(labelled, 1), explained / max(estimated, 1)


def _localized(result: dict[str, Any]) -> list[bool]:
    """Return [whether each true object is localized], scene by scene in the set's order."""
    return [o['localized'] for s in result['scenes'] for o in s['objects']]


def _explained(result: dict[str, Any]) -> list[bool]:
    """Return [whether each labelled object is explained], scene by scene in the set's order."""
    return [iou >= EXPLAINED_IOU for m in result['masks'] for iou in m['iou']]


def _exchanged(full: list[bool], less: list[bool]) -> tuple[int, int]:
    """Return how many objects were lost and how many gained."""
    pairs = list(zip(full, less, strict=True))
    return sum(a and not b for a, b in pairs), sum(b and not a for a, b in pairs)


def _texts(values: Iterable[float]) -> list[str]:
    """Return figures as text; the fifth is a number of categories, the others are shares."""
    return [f'{v:.1f}' if i == 4 else f'{v:.3f}' for i, v in enumerate(values)]


def _seconds(name: str, row: str, result: dict[str, Any],
             records: Mapping[str, Record]) -> str | None:
    """Return the processor seconds per scene as text, None where they were not measured."""
    seconds = seconds_per_scene(f'{name}/{row}/A', result, records)
    return None if seconds is None else f'{seconds:.1f}'


def _other_code(name: str, rows: Iterable[str], records: Mapping[str, Record]) -> list[str]:
    """Return [a sentence] where `best` was parsed by other code than some of the rows."""
    best = records.get(f'{name}/best/A')
    theirs = [r for row in rows if (r := records.get(f'{name}/{row}/A'))]
    if best is None or all(r.code == best.code for r in theirs):
        return []
    return ['Not all of this ran with the same code; `make results ROWS="best ablations"` '
            'recomputes it.']


MEASURES = (
    _Measure('mean', ('found', 'localized', '< 2 cm', '< 15 deg', 'false'), 'localized', _posed,
             _localized),
    _Measure('masks', ('recall', 'precision'), 'recall', _masked, _explained),
)
