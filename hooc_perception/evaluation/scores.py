# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's scores of a scene (section 6) and stricter ones."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.core.symmetry import is_half_turned, rotation_error
from hooc_perception.core.types import GenericModel
from hooc_perception.evaluation.matching import match_by_centre, PosedObject
import numpy as np

TIGHT_M = 0.02


@dataclass(frozen=True)
class ObjectScore:
    """
    One true object and the estimate that is matched to it.

    :ivar truth: index of the true object; `estimate` that of its estimate, None where there is
        none.
    :ivar centre_m: distance between the centres; NaN without an estimate, as the next.
    :ivar rotation_rad: least angle over the model's symmetries.
    :ivar size_ratio: estimated over true length of the bounding box's diagonal.
    :ivar half_turned: whether it lies the wrong way round, see `is_half_turned`.
    """

    category: str
    truth: int
    estimate: int | None
    localized: bool = False
    centre_m: float = float('nan')
    rotation_rad: float = float('nan')
    size_ratio: float = float('nan')
    half_turned: bool = False

    @property
    def tight(self) -> bool:
        """Return whether the centre is within 2 cm."""
        return self.centre_m < TIGHT_M


@dataclass(frozen=True)
class SceneScore:
    """
    The scores of one scene.

    :ivar found, localized, tight: shares of the true objects: of a found category; centre
        within half the generic model's longest side; centre within 2 cm. NaN without truth.
    :ivar false_categories: number of estimated categories that are not in the scene.
    :ivar estimated: number of estimated objects.
    :ivar seconds: as the results say; NaN where they do not.
    :ivar missing: True where the results do not hold this scene: it counts as empty.
    """

    name: str
    found: float
    localized: float
    tight: float
    false_categories: int
    estimated: int
    seconds: float
    objects: tuple[ObjectScore, ...]
    missing: bool = False


def score_objects(estimates: Sequence[PosedObject], truths: Sequence[PosedObject],
                  models: Mapping[str, GenericModel]) -> list[ObjectScore]:
    """
    Return [ObjectScore] in the order of `truths`.

    :param models: mapping category name -> GenericModel; its longest side is the size in
        the paper's criterion of localization (section 6).
    """
    matched = {true: (est, metres) for est, true, metres in match_by_centre(estimates, truths)}
    out = []
    for index, truth in enumerate(truths):
        if index not in matched:
            out.append(ObjectScore(truth.category, index, None))
            continue
        i_est, metres = matched[index]
        estimate, model = estimates[i_est], models[truth.category]
        R_est, R_true = (matrix_from_pose(p.translation, p.rotation_xyzw)[:3, :3]
                         for p in (estimate, truth))
        out.append(ObjectScore(
            truth.category, index, i_est, metres < 0.5 * model.longest_side, metres,
            rotation_error(R_est, R_true, model.symmetry),
            float(np.linalg.norm(estimate.size) / np.linalg.norm(truth.size)),
            is_half_turned(R_est, R_true, model.symmetry)))
    return out


def score_scene(name: str, estimates: Sequence[PosedObject], truths: Sequence[PosedObject],
                models: Mapping[str, GenericModel], seconds: float = float('nan'),
                missing: bool = False) -> SceneScore:
    """Return the SceneScore of estimates against truths."""
    objects = score_objects(estimates, truths, models)
    n = len(truths) or float('nan')
    return SceneScore(
        name, sum(o.estimate is not None for o in objects) / n,
        sum(o.localized for o in objects) / n, sum(o.tight for o in objects) / n,
        len({e.category for e in estimates} - {t.category for t in truths}),
        len(estimates), float(seconds), tuple(objects), missing)


def means(scores: Iterable[SceneScore]) -> dict[str, float]:
    """Return {field: mean over scenes} of the numeric fields; NaN entries are left out."""
    out, scores = {}, tuple(scores)
    for name in ('found', 'localized', 'tight', 'false_categories', 'estimated', 'seconds'):
        values = np.array([getattr(s, name) for s in scores], np.float64)
        values = values[np.isfinite(values)]
        out[name] = float(values.mean()) if len(values) else float('nan')
    return out


def pose_errors(scores: Iterable[SceneScore]) -> dict[str, Float64Array]:
    """
    Return {centre_m, rotation_rad, size_ratio}: float64 arrays over all matched objects.

    Objects whose category was not found have no error and are left out.
    """
    objects = [o for s in scores for o in s.objects if o.estimate is not None]
    return {name: np.array([getattr(o, name) for o in objects], np.float64)
            for name in ('centre_m', 'rotation_rad', 'size_ratio')}


def per_category(scores: Sequence[SceneScore],
                 estimates_by_scene: Sequence[Sequence[PosedObject]],
                 categories: Iterable[str]) -> dict[str, dict[str, Any]]:
    """
    Return {category: dict} of counts and median errors.

    The counts are true, estimated, found, localized, tight, and half_turned among the localized;
    centre_m and rotation_rad are medians over the localized objects, None where there are none.

    :param estimates_by_scene: in the order of `scores`.
    """
    out = {}
    for category in categories:
        objects = [o for s in scores for o in s.objects if o.category == category]
        placed = [o for o in objects if o.localized]
        out[category] = {
            'true': len(objects),
            'estimated': sum(e.category == category for es in estimates_by_scene for e in es),
            'found': sum(o.estimate is not None for o in objects),
            'localized': len(placed), 'tight': sum(o.tight for o in objects),
            'half_turned': sum(o.half_turned for o in placed),
            'centre_m': float(np.median([o.centre_m for o in placed])) if placed else None,
            'rotation_rad': (float(np.median([o.rotation_rad for o in placed]))
                             if placed else None)}
    return out
