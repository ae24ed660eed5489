# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Tables of what the stages lose, by scene and by category."""

from collections.abc import Iterable

from hooc_perception.evaluation.stages import Losses, losses_by_category
from hooc_perception.evaluation.tables import Table
import numpy as np


def stage_table(losses: Losses) -> Table:
    """Return what each stage loses, one row per scene, from `rerun`."""
    rows = []
    for name, loss in losses.items():
        pixels, pool, answer = loss['pixels'], loss['pool'], loss['answer']
        rows.append((name, pixels['accuracy'], pixels['balanced_accuracy'],
                     pixels['true_probability'], pool.candidates, pool.pool_localized,
                     pool.pool_tight, pool.first_localized, pool.kept, answer.localized,
                     answer.tight))
    columns = np.array([row[1:] for row in rows], np.float64)
    mean = ('mean', *(float(np.nanmean(c)) if np.isfinite(c).any() else None
                      for c in columns.T))
    return Table('What the stages lose',
                 ('scene', 'pixels', 'by class', 'p(true)', 'candidates', 'in pool', '< 2 cm',
                  'ranked 1st', 'kept', 'local', '< 2 cm'),
                 (*rows, mean),
                 ('pixels: share of the pixels on true objects whose most likely class is '
                  'correct; by class: the same averaged over the classes; in pool: share of the '
                  "true objects with a candidate of their category within half the model's "
                  'size; ranked 1st: those whose best-scored candidate is one; kept: of those in '
                  'the pool, the share that the result localizes.',), (len(rows),))


def stage_category_table(losses: Losses, categories: Iterable[str]) -> Table:
    """Return what the stages lose of each category, the worst first, from `rerun`."""
    rows = []
    for name, c in losses_by_category(losses, categories).items():
        if c['true']:
            accuracy = c['correct'] / c['pixels'] if c['pixels'] else None
            rows.append((name, c['true'], c['pixels'], accuracy, c['near'], c['tight'],
                         c['first'], c['localized']))
    rows.sort(key=lambda row: (row[-1] / row[1], row[0]))
    return Table('What the stages lose, by category',
                 ('category', 'true', 'pixels', 'right', 'in pool', '< 2 cm', 'ranked 1st',
                  'local'), tuple(rows),
                 ('pixels: pixels of all views whose true class is certain; right: share of them '
                  'whose most likely class is correct; the other columns count objects.',))
