# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's four tables and the stricter scores, as Table records."""

from collections.abc import Iterable, Mapping, Sequence

from hooc_perception.core.types import Energy
from hooc_perception.evaluation import paper
from hooc_perception.evaluation.evaluate import Evaluation
from hooc_perception.evaluation.scores import means, pose_errors
from hooc_perception.evaluation.tables import Cell, Table
from hooc_perception.evaluation.visibility import Visibility
import numpy as np

TERMS = ('total', 'depth', 'probability', 'overlap')


def _tag(k: int, evaluations: Sequence[Evaluation]) -> str:
    """Return the mark of the columns of result k, '' where there is one result only."""
    return f'[{k + 1}] ' if len(evaluations) > 1 else ''


def _legend(evaluations: Sequence[Evaluation]) -> list[str]:
    """Return the note that explains the marks, [] where there are none."""
    if len(evaluations) < 2:
        return []
    return [', '.join(f'[{k + 1}] {e.label}' for k, e in enumerate(evaluations))]


def score_table(evaluations: Sequence[Evaluation], setting: str) -> Table | None:
    """
    Return Table 2 (setting 'A') or Table 3 ('B') of the evaluations, None where there are none.

    A block of columns per results file; the last row is the paper's mean on HOOC, which is
    another set of scenes.
    """
    chosen = [e for e in evaluations if e.setting == setting and e.scores]
    if not chosen:
        return None
    columns = ('found', 'local', '< 2 cm', 'false', 'n', 's')
    header = ['scene', *(_tag(k, chosen) + c for k in range(len(chosen)) for c in columns)]
    rows: list[tuple[Cell, ...]] = []
    notes = _legend(chosen)
    for k, first in enumerate(chosen[0].scores):
        row: list[Cell] = [first.name]
        for e in chosen:
            s = e.scores[k]
            row += [s.found, s.localized, s.tight, s.false_categories, s.estimated, s.seconds]
            if s.missing:
                notes.append(f'{e.label or "results"}: scene {s.name} is missing and counts as '
                             'empty.')
        rows.append(tuple(row))
    total: list[Cell] = ['mean']
    for e in chosen:
        m = means(e.scores)
        total += [f'{m["found"]:.3f}', f'{m["localized"]:.3f}', f'{m["tight"]:.3f}',
                  m['false_categories'], f'{m["estimated"]:.1f}', m['seconds']]
    beside: list[Cell] = ['paper, HOOC mean', *(
        paper.mean(setting, 'found'), paper.mean(setting, 'localized'), None,
        paper.mean(setting, 'false_categories'), None, None) * len(chosen)]
    title = {'A': 'Table 2: the full chain',
             'B': 'Table 3: parsing with the true poses among the candidates'}[setting]
    return Table(title, tuple(header), (*rows, tuple(total), tuple(beside)),
                 tuple(notes), (len(rows), len(rows) + 1))


def paper_scores() -> Table:
    """Return the paper's own Tables 2 and 3, scene by scene."""
    rows: list[tuple[Cell, ...]] = []
    for setting, table in (('A', 2), ('B', 3)):
        for name, title in (('found', 'found'), ('localized', 'localized'),
                            ('false_categories', 'false categories')):
            values = paper.SCORES[setting][name]
            rows.append((f'Table {table} ({setting}) {title}', *values,
                         paper.mean(setting, name)))
    return Table("The paper's own figures on HOOC", ('', *paper.SCENES, 'mean'), tuple(rows))


def visibility_table(name: str, rows: Sequence[Visibility]) -> Table:
    """Return Table 1 of one scene from its [Visibility]."""
    n = len(rows[0].pixels)
    header = ('object', *(f'pixels {j + 1}' for j in range(n)),
              *(f'surface {j + 1}' for j in range(n)), 'surface, any')
    body = [(r.category, *map(float, r.pixels), *map(float, r.surface), r.total) for r in rows]
    values = np.array([row[1:] for row in body], np.float64)
    mean = ('mean', *(float(np.nanmean(c)) if np.isfinite(c).any() else None for c in values.T))
    return Table(f'Table 1: visibility in scene {name}', header, (*body, mean), (),
                 (len(body),))


def visibility_summary(visibility: Mapping[str, Sequence[Visibility]]) -> Table:
    """Return Table 1 in short: one row per scene, from {scene: [Visibility]}."""
    rows = []
    for name, objects in visibility.items():
        pixels = np.concatenate([v.pixels for v in objects])
        total = np.array([v.total for v in objects])
        rows.append((name, len(objects), float(np.nanmean(pixels)), float(np.nanmin(pixels)),
                     float(total.mean()), float(total.min()), float(total.max())))
    return Table('Table 1 in short: visibility of the true objects',
                 ('scene', 'objects', 'pixels, mean', 'least', 'surface, mean', 'least', 'most'),
                 tuple(rows), ("pixels: share of an object's own pixels that the others "
                               'leave visible, over objects and views; surface: share of its '
                               'surface that some camera sees. HOOC 20(1): pixels .32-1.00, '
                               'surface .39-.71. In full: hooc evaluate SET.',))


def paper_visibility() -> Table:
    """Return the paper's Table 1, scene 20(1) of HOOC."""
    return Table("The paper's Table 1: HOOC scene 20(1)",
                 ('object', *(f'pixels {j}' for j in (1, 2, 3)),
                  *(f'surface {j}' for j in (1, 2, 3)), 'surface, any'),
                 tuple((name, *values) for name, values in paper.VISIBILITY.items()))


def energy_table(evaluations: Sequence[Evaluation],
                 truth: Mapping[str, Energy] | None = None) -> Table | None:
    """
    Return Table 4: Eq. 1 and its terms for settings A, B and the truth; None without energies.

    :param truth: {scene: Energy} of the true poses, None or empty where no model was given.
    """
    chosen = [e for e in evaluations if e.energy]
    sources = [((_tag(k, chosen) or 'answer ').strip(), e.energy)
               for k, e in enumerate(chosen)]
    if truth:
        sources.append(('truth', {name: {t: getattr(energy, t) for t in TERMS}
                                  for name, energy in truth.items()}))
    if not sources:
        return None
    names = list(dict.fromkeys(name for _, energies in sources for name in energies))
    header = ('scene', *(f'{label} {term}' for term in TERMS for label, _ in sources))

    def value(energies: Mapping[str, Mapping[str, float | None]], name: str, term: str) -> float:
        number = energies.get(name, {}).get(term)
        return np.nan if number is None else float(number)

    values = np.array([[value(energies, name, term) for term in TERMS for _, energies in sources]
                       for name in names])
    total = [float(np.nanmean(c)) if np.isfinite(c).any() else np.nan for c in values.T]
    notes = _legend(chosen) + ["The paper's means on HOOC: " + '; '.join(
        f'{label} ' + ' '.join(f'{v:.3f}' for v in np.mean(paper.ENERGY[label], axis=0))
        for label in ('A', 'B', 'truth')) + ' (total, depth, probability, overlap).']
    if not truth:
        notes.append('The energy of the true poses needs the classifier: name it with --model.')
    rows = [(name, *(None if np.isnan(v) else f'{v:.4f}' for v in row))
            for name, row in zip((*names, 'mean'), (*values, total))]
    return Table('Table 4: energy (Eq. 1) of the results', header, tuple(rows), tuple(notes),
                 (len(names),))


def strict_table(evaluations: Sequence[Evaluation]) -> Table | None:
    """Return the stricter scores, one row per results file; None where no scene has poses."""
    rows: list[tuple[Cell, ...]] = []
    for e in evaluations:
        if not e.scores:
            continue
        m, errors = means(e.scores), pose_errors(e.scores)
        objects = [o for s in e.scores for o in s.objects]
        placed = [o for o in objects if o.localized]
        degrees = np.degrees([o.rotation_rad for o in placed])
        bop = (e.bop.vsd, e.bop.mssd, e.bop.mspd, e.bop.average) if e.bop else (None,) * 4
        rows.append((
            e.label or 'results', m['localized'], m['tight'],
            f'{np.median([o.centre_m for o in placed]) * 1000:.0f}' if placed else None,
            f'{np.median(degrees):.0f}' if placed else None,
            float(sum(degrees < 15) / len(objects)) if objects else None,
            float(np.mean([o.half_turned for o in placed])) if placed else None,
            float(np.median(errors['size_ratio'])) if len(errors['size_ratio']) else None, *bop))
    if not rows:
        return None
    header = ('results', 'localized', '< 2 cm', 'mm', 'deg', '< 15 deg', 'turned', 'size',
              'AR VSD', 'AR MSSD', 'AR MSPD', 'AR')
    return Table('Stricter scores', header, tuple(rows),
                 ('mm, deg: median errors of the localized objects, rotation up to the '
                  "model's symmetry; < 15 deg: share of all true objects that are localized with "
                  'a rotation error below 15 degrees; turned: share of the localized objects '
                  'that lie the wrong way round, end for end or upside down; size: median ratio '
                  'of estimated to true size; AR: BOP average recall.',))


def category_table(evaluation: Evaluation, categories: Iterable[str]) -> Table:
    """Return the per-category breakdown of one results file."""
    rows: list[tuple[Cell, ...]] = []
    for name, c in evaluation.per_category(categories).items():
        if c['true'] or c['estimated']:
            rows.append((name, c['true'], c['estimated'], c['found'], c['localized'], c['tight'],
                         None if c['centre_m'] is None else f'{c["centre_m"] * 1000:.0f}',
                         None if c['rotation_rad'] is None
                         else f'{np.degrees(c["rotation_rad"]):.0f}', c['half_turned']))
    label = f': {evaluation.label}' if evaluation.label else ''
    return Table(f'Per category{label}', ('category', 'true', 'estimated', 'found', 'local',
                                          '< 2 cm', 'mm', 'deg', 'turned'), tuple(rows))


def mask_table(evaluation: Evaluation) -> Table | None:
    """Return the mask scores of one results file; None where no scene has labels alone."""
    masks = evaluation.masks
    if not masks:
        return None
    rows: list[tuple[Cell, ...]] = [
        (m.name, f'{m.explained}/{m.labelled}', m.estimated,
         float(np.mean(m.iou)) if m.iou else None, m.seconds) for m in masks]
    explained, labelled, estimated = (sum(getattr(m, k) for m in masks)
                                      for k in ('explained', 'labelled', 'estimated'))
    seconds = [m.seconds for m in masks if np.isfinite(m.seconds)]
    ious = [i for m in masks for i in m.iou]
    rows.append(('all', f'{explained}/{labelled}', estimated,
                 float(np.mean(ious)) if ious else None,
                 float(np.mean(seconds)) if seconds else None))
    notes = (f'recall {explained / max(labelled, 1):.3f}, '
             f'precision {explained / max(estimated, 1):.3f} '
             f'(a labelled object is explained by a mask of IoU >= 0.5).',
             *(f'Scene {m.name} is missing and counts as empty.' for m in masks if m.missing))
    label = f': {evaluation.label}' if evaluation.label else ''
    return Table(f'Explained masks{label}', ('scene', 'explained', 'n', 'IoU', 's'),
                 tuple(rows), notes, (len(rows) - 1,))
