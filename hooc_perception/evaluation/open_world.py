# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Scores where things of no category stand among the known objects.

A known object is localized as in the paper. Another estimate of a category is *forced* where its
centre lies in a stranger's box and in no known object's, and *spurious* where it is not forced
and its category is not in the scene. Boxes are axis-aligned in the world. A stranger is found by
an unknown object whose box overlaps with its own by an IoU of at least 0.25, one to one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.core.geometry import matrix_from_pose, transform
from hooc_perception.core.types import GenericModel
from hooc_perception.evaluation.errors import Pose
from hooc_perception.evaluation.matching import PosedObject
from hooc_perception.evaluation.tables import Table
import numpy as np
from scipy.optimize import linear_sum_assignment

FOUND_IOU = 0.25
# Localized within this share of the generic model's longest side (section 6 of the paper).
LOCALIZED_SHARE = 0.5
# A centre lies in a box that is so much larger on every side.
MARGIN_M = 0.01
_CORNERS = np.array(np.meshgrid([-.5, .5], [-.5, .5], [-.5, .5])).reshape(3, -1).T


@dataclass(frozen=True)
class OpenScore:
    """
    Counts of one scene.

    :ivar known: true objects of known categories, of which `localized` were.
    :ivar forced, spurious: estimates of known categories, see the module.
    :ivar strangers: true things of no category, of which `found` were.
    :ivar unknown: things of no category that were reported.
    """

    name: str
    known: int
    localized: int
    forced: int
    spurious: int
    strangers: int
    found: int
    unknown: int


def bounds(pose: Pose) -> tuple[Float64Array, Float64Array]:
    """Return (low (3,), high (3,)) of a posed box in the world, metres."""
    corners = transform(matrix_from_pose(pose.translation, pose.rotation_xyzw),
                        _CORNERS * np.asarray(pose.size, np.float64))
    return corners.min(0), corners.max(0)


def box_iou(a: Pose, b: Pose) -> float:
    """Return the IoU of the axis-aligned boxes around two posed boxes."""
    (low_a, high_a), (low_b, high_b) = bounds(a), bounds(b)
    both = np.clip(np.minimum(high_a, high_b) - np.maximum(low_a, low_b), 0, None).prod()
    return float(both / ((high_a - low_a).prod() + (high_b - low_b).prod() - both))


def open_score(name: str, found: Sequence[PosedObject], unknown: Sequence[Pose],
               truths: Sequence[PosedObject], strangers: Sequence[Pose],
               models: Mapping[str, GenericModel]) -> OpenScore:
    """
    Return the OpenScore of one scene.

    :param found: estimates of known categories; `unknown`: reported things of no category.
    :param truths: true objects of known categories; `strangers`: true things of no category.
    """
    right = _localized(found, truths, models)
    here = {true.category for true in truths}
    forced = spurious = 0
    for k, estimate in enumerate(found):
        if right[k]:
            continue
        if _inside(estimate, strangers) and not _inside(estimate, truths):
            forced += 1
        elif estimate.category not in here:
            spurious += 1
    hits = 0
    if strangers and unknown:
        overlap = np.array([[box_iou(a, b) for b in unknown] for a in strangers])
        rows, columns = linear_sum_assignment(-overlap)
        hits = int((overlap[rows, columns] >= FOUND_IOU).sum())
    return OpenScore(name, len(truths), int(right.sum()), forced, spurious, len(strangers), hits,
                     len(unknown))


def summary(scores: Sequence[OpenScore]) -> dict[str, Any]:
    """Return shares over all scenes and means per scene; None where there is nothing to count."""
    total = {key: sum(getattr(s, key) for s in scores)
             for key in ('known', 'localized', 'forced', 'spurious', 'strangers', 'found',
                         'unknown')}

    def share(part: str, whole: str) -> float | None:
        return total[part] / total[whole] if total[whole] else None

    return {'localized': share('localized', 'known'),
            'forced': total['forced'] / len(scores), 'spurious': total['spurious'] / len(scores),
            'recall': share('found', 'strangers'), 'precision': share('found', 'unknown'),
            'scenes': [asdict(s) for s in scores]}


def open_table(evaluations: Sequence[tuple[str, Sequence[OpenScore]]]) -> Table | None:
    """Return the table of (label, scores) of several results, None without any score."""
    rows = []
    for label, scores in evaluations:
        if scores:
            s = summary(scores)
            rows.append((label, s['localized'], s['forced'], s['spurious'], s['recall'],
                         s['precision']))
    if not rows:
        return None
    return Table('Among things of no category',
                 ('results', 'localized', 'forced a scene', 'spurious a scene',
                  'strangers found', 'of those reported'), tuple(rows),
                 ('forced: a known category on a stranger; spurious: another false category.',))


def _localized(found: Sequence[PosedObject], truths: Sequence[PosedObject],
               models: Mapping[str, GenericModel]) -> BoolArray:
    """Return (len(found),) bool: which estimates are matched with a true object nearby."""
    right = np.zeros(len(found), bool)
    for category in {true.category for true in truths}:
        mine = [k for k, estimate in enumerate(found) if estimate.category == category]
        those = [true for true in truths if true.category == category]
        if not mine:
            continue
        away = np.array([[np.linalg.norm(np.subtract(true.translation, found[k].translation))
                          for k in mine] for true in those])
        for i, j in zip(*linear_sum_assignment(away)):
            if away[i, j] < LOCALIZED_SHARE * models[category].longest_side:
                right[mine[j]] = True
    return right


def _inside(estimate: Pose, boxes: Sequence[Pose]) -> bool:
    """Return whether the centre of an estimate lies in one of the boxes."""
    for box in boxes:
        low, high = bounds(box)
        if ((estimate.translation >= low - MARGIN_M)
                & (estimate.translation <= high + MARGIN_M)).all():
            return True
    return False
