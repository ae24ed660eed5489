# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Detailed tables of a set, scene by scene, beside the paper's own figures."""

from typing import Any

from hooc_perception.evaluation import paper
from hooc_perception.evaluation.tables import Cell, Table
from hooc_perception.experiments.ablations import UNVERIFIED
import numpy as np

HOOC = 'the paper, on HOOC'
TERMS = ('total', 'depth', 'probability', 'overlap')
# The content of a scores file, and that of each row of the tables.
Scores = dict[str, Any]


def of_setting(scores: Scores, setting: str) -> dict[str, Any] | None:
    """Return the result of a setting in a scores file, None where there is none."""
    return next((r for r in scores['results'] if _setting(r) == setting), None)


def _setting(result: dict[str, Any]) -> str:
    """Return 'A', 'B' or UNVERIFIED, which only the folder of its answer tells from 'B'."""
    folder = result.get('label', '').partition('/')[0]
    return UNVERIFIED if folder == UNVERIFIED else result['setting']


def details_of(posed: dict[str, Scores], masked: dict[str, Scores]) -> list[Table]:
    """Return the detailed tables of one set, from {row: content of its scores file}."""
    out = []
    if posed:
        out += [*visibility_tables(posed), *scene_tables(posed), *energy_tables(posed)]
    if masked:
        out.append(mask_scene_table(masked))
    return out


def visibility_tables(scores: dict[str, Scores]) -> list[Table]:
    """Return Table 1, in short for every scene and in full for one; [] without true poses."""
    visibility = next(iter(scores.values()))['visibility']
    return [_short(visibility), *_full(visibility)] if visibility else []


def _short(visibility: dict[str, Any]) -> Table:
    """Return Table 1 in short: pixel and surface visibility of every scene."""
    rows: list[tuple[Cell, ...]] = []
    every = []
    for name, things in visibility.items():
        pixels = np.array([p for t in things for p in t['pixels'] if p is not None])
        total = np.array([t['total'] for t in things])
        every.append(total)
        inside = np.mean((total >= .39) & (total <= .71))
        rows.append((name, len(things), float(pixels.mean()), float(pixels.min()),
                     *map(float, (total.mean(), total.min(), total.max(), inside))))
    total = np.concatenate(every)
    rows.append(('all', len(total), None, None, float(total.mean()), float(total.min()),
                 float(total.max()), float(np.mean((total >= .39) & (total <= .71)))))
    hooc = np.array(list(paper.VISIBILITY.values()))
    rows.append((f'{HOOC} 20(1)', len(hooc), float(hooc[:, :3].mean()),
                 float(hooc[:, :3].min()), *map(float, (hooc[:, 6].mean(), hooc[:, 6].min(),
                                                        hooc[:, 6].max(), 1.0))))
    return Table('Table 1: visibility', ('scene', 'objects', 'pixels, mean', 'least',
                                         'surface, mean', 'least', 'most', 'in .39-.71'),
                 tuple(rows),
                 ("pixels: share of an object's pixels that the others leave visible, over "
                  'objects and views; surface: share of its surface that some camera sees.',),
                 (len(rows) - 2, len(rows) - 1))


def _full(visibility: dict[str, Any]) -> list[Table]:
    """Return Table 1 object by object: of the last scene, which holds most, and the paper's."""
    name, things = list(visibility.items())[-1]

    def columns(what: str) -> list[str]:
        return [f'{what} {j + 1}' for j in range(len(things[0]['pixels']))]

    return [Table(f'Table 1 in full: scene {name}',
                  ('object', *columns('pixels'), *columns('surface'), 'surface, any'),
                  tuple((t['category'].replace('_', ' '), *t['pixels'], *t['surface'], t['total'])
                        for t in things)),
            Table("Table 1: the paper's own, HOOC 20(1)",
                  ('object', *(f'{what} {j}' for what in ('pixels', 'surface')
                               for j in (1, 2, 3)), 'surface, any'),
                  tuple((thing.replace('_', ' '), *values)
                        for thing, values in paper.VISIBILITY.items()))]


def scene_tables(scores: dict[str, Scores]) -> list[Table]:
    """Return Tables 2 and 3: every scene, HOOC's nine scenes beside it where there are nine."""
    out = []
    columns = (('found', 'found'), ('localized', 'local'), ('false_categories', 'false'))
    for setting, title in (('A', 'Table 2: the full chain'),
                           ('B', 'Table 3: with the true poses among the candidates')):
        results = {row: r for row, s in scores.items() if (r := of_setting(s, setting))}
        if not results:
            continue
        names = [s['name'] for s in next(iter(results.values()))['scenes']]
        rows = [[name, *(r['scenes'][k][c] for r in results.values() for c, _ in columns)]
                for k, name in enumerate(names)]
        rows.append(['mean', *(r['mean'][c] for r in results.values() for c, _ in columns)])
        header = ['scene', *(f'`{row}` {short}' for row in results for _, short in columns)]
        if len(names) == len(paper.SCENES):
            header += ['HOOC', *(f'HOOC {short}' for _, short in columns)]
            for k, (row, name) in enumerate(zip(rows, (*paper.SCENES, 'mean'))):
                row += [name, *(paper.SCORES[setting][c][k] if k < len(names)
                                else paper.mean(setting, c) for c, _ in columns)]
        out.append(Table(title, tuple(header), tuple(map(tuple, rows)), (), (len(rows) - 1,)))
    return out


def energy_tables(scores: dict[str, Scores]) -> list[Table]:
    """Return Table 4: means of Eq. 1's terms for A, B and the truth; [] without energies."""
    rows = []
    for row, content in scores.items():
        sources = {f'`{row}` {s}': r['energy'] for s in 'AB'
                   if (r := of_setting(content, s)) and r['energy']}
        if sources:
            sources[f'`{row}` truth'] = content['truth_energy']
        for label, energies in sources.items():
            means = [[e[t] for e in energies.values() if e[t] is not None] for t in TERMS]
            if all(means):
                rows.append((label, *(f'{np.mean(values):.4f}' for values in means)))
    if not rows:
        return []
    rows += [(f'{HOOC} {label}', *(f'{v:.4f}' for v in np.mean(paper.ENERGY[label], axis=0)))
             for label in ('A', 'B', 'truth')]
    return [Table('Table 4: energy (Eq. 1), means over scenes', ('', *TERMS), tuple(rows),
                  ("Each profile's classifier gives other probabilities, so compare within a "
                   'profile. HOOC has other images and another share of background.',))]


def mask_scene_table(scores: dict[str, Scores]) -> Table:
    """Return explained masks and the number of estimates of every scene."""
    results = {row: r for row, content in scores.items() if (r := of_setting(content, 'A'))}
    rows = [(m['name'], m['labelled'], *(r['masks'][k][c] for r in results.values()
                                         for c in ('explained', 'estimated')))
            for k, m in enumerate(next(iter(results.values()))['masks'])]
    return Table('Explained masks by scene', ('scene', 'labelled', *(
        f'`{row}` {c}' for row in results for c in ('explained', 'n'))), tuple(rows))
