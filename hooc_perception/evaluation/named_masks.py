# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Scores of labelled objects whose categories are known.

A labelled object is *explained* by an estimate whose visible mask has an IoU of at least 0.5 with
it, of whatever category, and *named* by one of its own category with at least 0.3; both one to
one. An estimate that shows at least 60 pixels and has an IoU of at least 0.3 with no labelled
object is *false*.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hooc_perception.core.arrays import AnyArray, Float64Array
from hooc_perception.evaluation.tables import Cell, Table
import numpy as np
from scipy.optimize import linear_sum_assignment

NAMED_IOU = 0.3
MIN_SHOWN_PIXELS = 60


@dataclass(frozen=True)
class NamedLabel:
    """
    One labelled object.

    :ivar category: None where it is not noted.
    :ivar well_seen: whether it has enough depth, as noted.
    :ivar taken_for: category of the estimate that explains it, None where none does.
    """

    category: str | None
    well_seen: bool
    taken_for: str | None
    named: bool


@dataclass(frozen=True)
class NamedScore:
    """
    The labelled objects of a scene, over its labelled views.

    :ivar false: categories of the false estimates.
    :ivar shown: number of estimates that show at least 60 pixels.
    """

    labels: tuple[NamedLabel, ...] = ()
    false: tuple[str, ...] = ()
    shown: int = 0

    def __add__(self, other: 'NamedScore') -> 'NamedScore':
        return NamedScore(self.labels + other.labels, self.false + other.false,
                          self.shown + other.shown)


def named_score(iou: Float64Array, categories: Sequence[str | None], well_seen: Sequence[bool],
                taken_for: Sequence[str | None], found: Sequence[str],
                pixels: AnyArray) -> NamedScore:
    """
    Return the NamedScore of one view.

    :param iou: (labels, estimates), see `masks.overlaps`.
    :param categories: of the labels, as `well_seen` and `taken_for`, see NamedLabel.
    :param found: categories of the estimates; `pixels` how many each of them shows.
    """
    same = iou * np.array([[c == f for f in found] for c in categories]).reshape(iou.shape)
    named = {row for row, column in zip(*linear_sum_assignment(-same))
             if same[row, column] >= NAMED_IOU}
    best = iou.max(0, initial=0)
    shown = [k for k, n in enumerate(pixels) if n >= MIN_SHOWN_PIXELS]
    return NamedScore(
        tuple(NamedLabel(*row, i in named)
              for i, row in enumerate(zip(categories, well_seen, taken_for))),
        tuple(found[k] for k in shown if best[k] < NAMED_IOU), len(shown))


def summary(scores: Sequence[NamedScore]) -> dict[str, Any] | None:
    """
    Return all figures over scenes as plain data, None without any scene.

    Categories and what they were taken for are of the well seen objects, or of all where nobody
    noted which these are. Shares are None where there is nothing to count.
    """
    if not scores:
        return None
    labels = [label for score in scores for label in score.labels]
    well = [label for label in labels if label.well_seen]
    told = well or labels
    names = Counter(str(label.category) for label in told)
    mistaken = Counter((str(label.category), label.taken_for) for label in told
                       if label.taken_for and not label.named)
    return {
        'scenes': len(scores), 'well_seen': _shares(well), 'all': _shares(labels),
        'false': sum(len(score.false) for score in scores) / len(scores),
        'shown': sum(score.shown for score in scores) / len(scores),
        'categories': {name: {'labelled': count, 'named': sum(
            label.named for label in told if str(label.category) == name)}
            for name, count in sorted(names.items())},
        'taken_for': [{'category': true, 'taken_for': found, 'count': count}
                      for (true, found), count in mistaken.most_common()],
        'false_categories': dict(Counter(
            name for score in scores for name in score.false).most_common())}


def _shares(labels: Sequence[NamedLabel]) -> dict[str, Any]:
    """Return how many labelled objects there are, and which shares are explained and named."""
    n = len(labels)
    return {'labelled': n,
            'explained': sum(label.taken_for is not None for label in labels) / n if n else None,
            'named': sum(label.named for label in labels) / n if n else None}


def named_table(summaries: Mapping[str, dict[str, Any]]) -> Table | None:
    """Return one row for every {label: `summary`}, None without any."""
    rows: list[tuple[Cell, ...]] = []
    for label, s in summaries.items():
        shares = [s[group][key] for group in ('well_seen', 'all')
                  for key in ('labelled', 'explained', 'named')]
        rows.append((label, *(f'{v:.3f}' if isinstance(v, float) else v for v in shares),
                     s['false'], f'{s["shown"]:.1f}'))
    if not rows:
        return None
    return Table('Named objects', ('results', 'well seen', 'explained', 'named', 'all',
                                   'explained', 'named', 'false a scene', 'of'), tuple(rows),
                 ('explained: a mask of IoU >= 0.5, of any category; named: one of the same '
                  'category, IoU >= 0.3; false: estimates with IoU < 0.3 with every label, of '
                  'those that show 60 pixels.',))


def mistakes_table(label: str, s: Mapping[str, Any]) -> Table:
    """Return the categories of a `summary`, hardest first, with what they were taken for."""
    rows: list[tuple[Cell, ...]] = []
    for name, count in s['categories'].items():
        others = ', '.join(f'{m["taken_for"]} {m["count"]}' for m in s['taken_for']
                           if m['category'] == name)
        rows.append((name, count['labelled'], count['named'], count['named'] / count['labelled'],
                     s['false_categories'].get(name, 0), others or None))
    # What is nowhere labelled can still be a false object.
    rows += [(name, 0, 0, None, n, None) for name, n in s['false_categories'].items()
             if name not in s['categories']]
    rows.sort(key=lambda row: 2.0 if row[3] is None else float(row[3]))
    group = 'well seen' if s['well_seen']['labelled'] else 'labelled'
    return Table('Named by category' + (f': {label}' if label else ''),
                 ('category', group, 'named', 'share', 'false', 'taken for'), tuple(rows),
                 ('taken for: categories of the estimates that explain an object that is not '
                  'named; false: false objects of that category.',))
