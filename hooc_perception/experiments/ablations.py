# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What each part of the profile `best` brings: parts that are switched off one at a time."""

from dataclasses import dataclass

from hooc_perception.evaluation.masks import EXPLAINED_IOU
from hooc_perception.evaluation.tables import Table
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
    parameters: tuple

    @property
    def row(self):
        """Return what its files and steps are called, below those of the row `ablations`."""
        return f'{ROW}/{self.name.replace(" ", "_")}'


SWITCHES = (
    Switch('flat table', ('observe.uneven_m=0',)),
    Switch('no smoothing of probabilities', ('classify.smoothing_steps=0',)),
    Switch('no refinement of hypotheses', ('propose.refine_steps=0', 'propose.polish_steps=0')),
    Switch('classifier not asked in parsing', ('parse.category_weight=0',)),
    Switch('normals not asked', ('parse.normal_weight=0',)),
    Switch('free space not asked', ('parse.free_weight=0',)),
    Switch('no size prior', ('parse.size_prior=0',)),
    Switch('no overlap cost', ('parse.overlap=0',)),
    Switch('no verifier', ('parse.verify_weight=0',)),
    Switch('no re-proposal', ('parse.rounds=0',)),
    Switch('no half turns', ('parse.turn_steps=0',)),
    Switch('no refinement in parsing', ('parse.polish_steps=0',)),
)


def tables_of(name, best, scores, records):
    """
    Return the tables of one set: by poses, by masks, or both; [] where nothing was run.

    :param best: content of the scores file of the row `best`, None where there is none.
    :param scores: {Switch.row: content of its scores file}.
    :param records: {step name: Record}, for the processor time and the code that ran.
    """
    shown = [(switch, scores[switch.row]['results'][0]) for switch in SWITCHES
             if switch.row in scores]
    if not shown:
        return []
    full = best and next(r for r in best['results'] if r['setting'] == 'A')
    out = []
    for key, header, figures, verdicts, note in (
            ('mean', ('found', 'localized', '< 2 cm', '< 15 deg', 'false'), _posed, _localized,
             'localized'),
            ('masks', ('recall', 'precision'), _masked, _explained, 'recall')):
        results = [(s, r) for s, r in shown if key in r]
        if not results:
            continue
        at, rows = header.index(note), []
        if full and key in full:
            rows.append(('`best`', None, *_texts(figures(full)), None, None, None,
                         _seconds(name, 'best', full, records)))
        for switch, result in results:
            cells, change = figures(result), (None, None, None)
            if full and key in full:
                lost, gained = _exchanged(verdicts(full), verdicts(result))
                change = (f'{cells[at] - figures(full)[at]:+.3f}', lost, gained)
            rows.append((switch.name, ' '.join(f'`{p}`' for p in switch.parameters),
                         *_texts(cells), *change, _seconds(name, switch.row, result, records)))
        out.append(Table(
            f'One part of `best` off: {name}',
            ('', 'changed', *header, f'{note}, change', 'lost', 'gained', 'CPU s'), tuple(rows),
            (f'The model is that of `best`, the parameters are for `hooc parse --set-parameter`. '
             f'lost, gained: objects that `best` has ({note}) and the row has not, and the other '
             'way round; one seed, so a few of both are noise. CPU s: processor seconds a '
             'scene.', *_other_code(name, [s.row for s, _ in results], records)),
            (0,) if full and key in full else ()))
    return out


def turned_right(result):
    """Return the share of the true objects that are localized and turned right, over scenes."""
    return float(np.mean([
        np.mean([o['localized'] and o['rotation_rad'] < RIGHT_RAD for o in s['objects']])
        for s in result['scenes'] if s['objects']]))


def _posed(result):
    mean = result['mean']
    return (*(mean[c] for c in ('found', 'localized', 'tight')), turned_right(result),
            mean['false_categories'])


def _masked(result):
    explained, labelled, estimated = (sum(m[k] for m in result['masks'])
                                      for k in ('explained', 'labelled', 'estimated'))
    return explained / max(labelled, 1), explained / max(estimated, 1)


def _localized(result):
    """Return [whether each true object is localized], scene by scene in the set's order."""
    return [o['localized'] for s in result['scenes'] for o in s['objects']]


def _explained(result):
    """Return [whether each labelled object is explained], scene by scene in the set's order."""
    return [iou >= EXPLAINED_IOU for m in result['masks'] for iou in m['iou']]


def _exchanged(full, less):
    """Return how many objects were lost and how many gained."""
    pairs = list(zip(full, less, strict=True))
    return sum(a and not b for a, b in pairs), sum(b and not a for a, b in pairs)


def _texts(values):
    return [f'{v:.1f}' if i == 4 else f'{v:.3f}' for i, v in enumerate(values)]


def _seconds(name, row, result, records):
    """Return the processor seconds of a scene as text, None where nobody measured."""
    record = records.get(f'{name}/{row}/A')
    n = len(result.get('scenes', ())) + len(result.get('masks', ()))
    return f'{record.cpu_s / n:.1f}' if record and n else None


def _other_code(name, rows, records):
    """Return [a sentence] where `best` was parsed by other code than some of the rows."""
    best = records.get(f'{name}/best/A')
    theirs = [r for row in rows if (r := records.get(f'{name}/{row}/A'))]
    if best is None or all(r.code == best.code for r in theirs):
        return []
    return ['Not all of this ran with the same code; `make results ROWS="best ablations"` makes '
            'it anew.']
