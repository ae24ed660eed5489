# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Tables over all rows of a set, from the JSON files of `hooc evaluate` and `hooc stages`."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from hooc_perception.evaluation import named_masks, paper, shape_table
from hooc_perception.evaluation.tables import Cell, Table
from hooc_perception.experiments import ablations
from hooc_perception.experiments.detail_tables import HOOC, of_setting, Scores
from hooc_perception.experiments.records import Record, seconds_per_scene
import numpy as np

# Settings in the order of the tables, and what these call them.
SETTINGS = {'A': 'A', 'B': 'B', ablations.UNVERIFIED: 'B, no verifier'}
# Sets in the order of the tables: objects unlike the generic models first, then real depth.
SETS = ('shapes', 'hots', 'glassware', 'osd', 'moves', 'dev', 'twin')


def summary_of(name: str, posed: dict[str, Scores], masked: dict[str, Scores],
               stages: dict[str, Any], records: Mapping[str, Record]) -> list[Table]:
    """
    Return the summary tables of one set.

    :param posed: {row: content of its scores file}, in the order of the tables, of the rows
        that are scored by poses; `masked` of those that are scored by masks.
    :param stages: {row: {scene: losses}} of the profiles whose stages were looked at.
    :param records: {step name: Record}, for the processor time.
    """
    seconds = {row: seconds_per_scene(f'{name}/{row}/A', s['results'][0], records)
               for row, s in (posed | masked).items()}
    out = []
    if posed:
        out = [score_table(posed, seconds), certain_table(posed),
               *([stage_table(stages)] if stages else []), category_table(posed, stages)]
    if masked:
        out += [mask_table(masked, seconds), *named_tables(masked)]
    return out


def _three(value: float | None) -> str | None:
    """Return a number with three decimals, None for None."""
    return None if value is None else f'{value:.3f}'


def _whole(value: float | None) -> str | None:
    """Return a number without decimals, None for None or 0."""
    return f'{value:.0f}' if value else None


def score_table(scores: dict[str, Scores], seconds: Mapping[str, float | None]) -> Table:
    """Return one row for every row and setting, the paper's own figures above them."""
    rows: list[tuple[Cell, ...]] = []
    bold = []
    for setting, called in SETTINGS.items():
        if setting in paper.SCORES:
            bold.append(len(rows))
            rows.append((HOOC, setting, *(_three(paper.mean(setting, c))
                                          for c in ('found', 'localized')), None, None,
                         f'{paper.mean(setting, "false_categories"):.1f}', *(None,) * 8))
        for row, content in scores.items():
            result = of_setting(content, setting)
            if result is not None:
                rows.append((f'`{row}`', called, *_score_cells(result),
                             _whole(seconds[row]) if setting == 'A' else None))
    return Table('Found and localized',
                 ('', 'setting', 'found', 'localized', '< 2 cm', '< 15 deg', 'turned', 'false',
                  'mm', 'deg', 'AR VSD', 'AR MSSD', 'AR MSPD', 'AR', 'CPU s'), tuple(rows),
                 ('Means over scenes. Setting A: the full chain; B: the true poses are among the '
                  'candidates; no verifier: with `parse.verify_weight=0`. < 15 deg: share of the '
                  'true objects that are localized with a rotation error below 15 degrees, up to '
                  'symmetry; turned: share of the localized that lie the wrong way round; false: '
                  "false categories per scene; mm, deg: median errors of the localized objects; "
                  "AR: BOP's average recalls; CPU s: processor seconds per scene, including "
                  'start-up and the loading of compiled code.',),
                 tuple(bold))


def _score_cells(result: dict[str, Any]) -> tuple[Cell, ...]:
    """Return the cells from `found` to `AR` of one result."""
    mean, bop = result['mean'], result.get('bop') or {}
    placed = [o for s in result['scenes'] for o in s['objects'] if o['localized']]
    degrees = np.degrees([o['rotation_rad'] for o in placed])
    return (*(_three(mean[c]) for c in ('found', 'localized', 'tight')),
            _three(ablations.turned_right(result)), _turned(placed),
            f'{mean["false_categories"]:.1f}',
            f'{1000 * np.median([o["centre_m"] for o in placed]):.0f}' if placed else None,
            f'{np.median(degrees):.0f}' if placed else None,
            *(bop.get(key) for key in ('vsd', 'mssd', 'mspd', 'average')))


def _turned(placed: Sequence[dict[str, Any]]) -> str | None:
    """Return the share of localized objects that lie the wrong way round, if it was counted."""
    if not placed or any('half_turned' not in o for o in placed):
        return None
    return _three(float(np.mean([o['half_turned'] for o in placed])))


def certain_table(scores: dict[str, Scores]) -> Table:
    """Return certain but wrong estimates and errors of size and surface, row by row."""
    empty: tuple[Cell, ...] = (None,) * len(shape_table.HEADER)
    rows = [(f'`{row}`', called, *(shape_table.shape_cells(result['certainty'], result['shape'])
                                   if 'shape' in result else empty))
            for setting, called in SETTINGS.items() for row, content in scores.items()
            if (result := of_setting(content, setting))]
    return Table(shape_table.TITLE, ('', 'setting', *shape_table.HEADER), tuple(rows),
                 (shape_table.NOTE,))


def stage_table(stages: dict[str, Any]) -> Table:
    """Return what each profile loses in which stage: means over scenes."""
    rows = []
    for row, losses in stages.items():
        pool = _mean_loss(losses, 'pool', 'pool_localized')
        local = _mean_loss(losses, 'answer', 'localized')
        rows.append((f'`{row}`', *(_mean_loss(losses, 'pixels', key) for key in (
            'accuracy', 'balanced_accuracy', 'true_probability')),
                     f'{_mean_loss(losses, "pool", "candidates"):.0f}', pool,
                     *(_mean_loss(losses, 'pool', key) for key in (
                         'pool_tight', 'first_localized')), local, 1 - pool, pool - local))
    return Table('What each stage loses',
                 ('', 'pixels right', 'by class', 'p(true)', 'candidates', 'in pool',
                  'in pool < 2 cm', 'ranked 1st', 'localized', 'lost before', 'lost in parsing'),
                 tuple(rows),
                 ('pixels right: share of the pixels on true objects whose most likely class is '
                  'correct; by class: the same averaged over classes; in pool: share of the true '
                  "objects with a candidate of their category within half the model's size; "
                  'ranked 1st: those whose best-scored candidate is one; lost before parsing: '
                  '1 - in pool; lost in parsing: in pool - localized.',))


def _mean_loss(losses: dict[str, Any], part: str, key: str) -> float:
    """Return the mean over scenes of one figure of their losses; NaN where there is none."""
    values = [loss[part][key] for loss in losses.values() if loss[part][key] is not None]
    return float(np.mean(values)) if values else float('nan')


def _by_category(losses: dict[str, Any]) -> dict[str, dict[str, int]]:
    """Return {category: {pixels, correct, near}} summed over the scenes of a stages file."""
    out: dict[str, dict[str, int]] = {}
    for loss in losses.values():
        for thing in loss['pool']['objects']:
            entry = out.setdefault(thing['category'], {'pixels': 0, 'correct': 0, 'near': 0})
            entry['near'] += thing['near']
        for category, count in loss['pixels']['categories'].items():
            entry = out.setdefault(category, {'pixels': 0, 'correct': 0, 'near': 0})
            entry['pixels'] += count['pixels']
            entry['correct'] += count['correct']
    return out


def category_table(scores: dict[str, Scores], stages: dict[str, Any]) -> Table:
    """Return pixels right, objects in the pool and objects localized, by category and row."""
    losses = {row: _by_category(content) for row, content in stages.items()}
    counts = {row: r['categories'] for row, content in scores.items()
              if (r := of_setting(content, 'A'))}
    first, last = next(iter(counts.values())), counts.get('best') or [*counts.values()][-1]
    names = [name for name, count in first.items() if count['true']]
    names.sort(key=lambda name: (last[name]['localized'] / first[name]['true'], name))
    rows = []
    for name in names:
        cells: list[Cell] = [name.replace('_', ' '), first[name]['true']]
        for row in losses:
            loss = losses[row].get(name, {'pixels': 0, 'correct': 0, 'near': 0})
            cells.append(loss['correct'] / loss['pixels'] if loss['pixels'] else None)
            cells.append(loss['near'])
        rows.append((*cells, *(counts[row][name]['localized'] for row in counts)))
    header = ('category', 'true', *(f'`{row}` {what}' for row in losses
                                    for what in ('pixels right', 'in pool')),
              *(f'`{row}` localized' for row in counts))
    return Table('By category', header, tuple(rows),
                 ('Hardest first. Objects in the pool and localized (setting A) are counts.',))


def _sums(result: dict[str, Any]) -> list[int]:
    """Return how many objects are explained, labelled and estimated."""
    return [sum(m[k] for m in result['masks']) for k in ('explained', 'labelled', 'estimated')]


def mask_table(scores: dict[str, Scores], seconds: Mapping[str, float | None]) -> Table:
    """Return recall and precision of masks, one row each."""
    rows = []
    for row, content in scores.items():
        result = content['results'][0]
        explained, labelled, estimated = _sums(result)
        ious = [i for m in result['masks'] for i in m['iou']]
        rows.append((f'`{row}`', f'{explained}/{labelled}', _three(explained / labelled),
                     estimated, _three(explained / max(estimated, 1)), float(np.mean(ious)),
                     _whole(seconds[row])))
    return Table('Explained masks', ('', 'explained', 'recall', 'estimated', 'precision', 'IoU',
                                     'CPU s'), tuple(rows),
                 ('A labelled object is explained by a mask of IoU >= .5, one to one. CPU s: '
                  'processor seconds per scene.',))


def named_tables(scores: dict[str, Scores]) -> list[Table]:
    """Return the scores by category of labelled objects; [] where categories are not known."""
    known = {f'`{row}`': content['results'][0]['named'] for row, content in scores.items()
             if 'named' in content['results'][0]}
    table = named_masks.named_table(known)
    return [table, *(named_masks.mistakes_table(*item) for item in known.items())] if table else []


def step_table(records: Mapping[str, Record]) -> Table:
    """Return what every step took, the switches of a set as one, and the code that ran."""
    groups: dict[str, list[Record]] = {}
    for name, record in sorted(records.items(), key=lambda item: (_rank(item[0]), item[0])):
        head, row, *rest = name.split('/')
        if row == ablations.ROW:
            name = f'{head}/{row}'
        groups.setdefault(name, []).append(record)
    rows: list[tuple[Cell, ...]] = [
        (name if len(rs) == 1 else f'{name} ({len(rs)})', f'{sum(r.cpu_s for r in rs):.0f}',
         f'{sum(r.wall_s for r in rs):.0f}', f'{max(r.peak_mb for r in rs):.0f}',
         _joined(r.commit for r in rs))
        for name, rs in groups.items()]
    total = sum(r.cpu_s for r in records.values())
    rows.append(('all', f'{total:.0f}', None, None, None))
    return Table('What it took', ('step', 'CPU s', 's', 'MB', 'code'), tuple(rows),
                 ('CPU s: processor seconds of the process and its workers; s: wall time, on a '
                  'machine that may have been busy; MB: peak memory; code: the commit, + where '
                  'files had uncommitted changes. (n): number of steps in that row.',),
                 (len(rows) - 1,))


def _rank(step: str) -> int:
    """Return where the set of a step comes in the tables."""
    name = step.partition('/')[0]
    return SETS.index(name) if name in SETS else len(SETS)


def _joined(commits: Iterable[str]) -> str | None:
    """Return the distinct commits in their order, None where no step knows its own."""
    return ' '.join(dict.fromkeys(c for c in commits if c)) or None
