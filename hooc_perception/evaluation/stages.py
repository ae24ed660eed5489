# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What each stage loses: pixels of the classifier, poses of the pool, choice of the search."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from hooc_perception.core.arrays import Int32Array
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import (
    Candidates,
    GenericModel,
    Observation,
    ObservedView,
    PixelProbabilities,
)
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.matching import candidate_objects, PosedObject
from hooc_perception.evaluation.scores import SceneScore, TIGHT_M
import numpy as np

# A true object's generic model and the reading may differ this much: models are rough.
AGREE_M = 0.03
COUNTS = ('true', 'pixels', 'correct', 'near', 'tight', 'first', 'localized')
# {scene: {pixels, pool, answer}} as `pixel_scores`, StageLoss and SceneScore.
Losses: TypeAlias = Mapping[str, Mapping[str, Any]]


def class_ids(models: Iterable[GenericModel]) -> dict[str, int]:
    """Return {category name: class id}."""
    return {model.name: i + 1 for i, model in enumerate(models)}


def as_candidates(objects: Iterable[PosedObject], models: Sequence[GenericModel]) -> Candidates:
    """Return PosedObjects as Candidates; categories without a model are left out."""
    ids = class_ids(models)
    kept = [o for o in objects if o.category in ids]
    if not kept:
        return Candidates.empty()
    return Candidates(np.array([ids[o.category] for o in kept], np.uint16),
                      np.array([o.translation for o in kept], np.float64),
                      np.array([o.rotation_xyzw for o in kept], np.float64),
                      np.array([o.size for o in kept], np.float32),
                      np.array([o.score for o in kept], np.float32),
                      np.array([o.member for o in kept], np.uint16))


def as_objects(candidates: Candidates, models: Sequence[GenericModel]) -> list[PosedObject]:
    """Return Candidates as a list of PosedObject."""
    return candidate_objects(candidates, [model.name for model in models])


def true_classes(truths: Iterable[PosedObject], models: Sequence[GenericModel],
                 view: ObservedView) -> Int32Array:
    """
    Return (H, W) int32: the class of the true object seen at a pixel, 0 none, -1 uncertain.

    Certain are foreground pixels where the posed generic model agrees with the reading within
    AGREE_M, and background pixels that show no object.

    :param models: class id c is models[c - 1].
    """
    ids = class_ids(models)
    kept = [t for t in truths if t.category in ids]
    depth, shown = render_depth([world_mesh(t, models[ids[t.category] - 1]) for t in kept],
                                view.camera)
    lookup = np.array([ids[t.category] for t in kept] + [0], np.int32)
    classes = lookup[shown]
    with np.errstate(invalid='ignore'):
        agrees = np.abs(depth - view.depth) < AGREE_M
    classes[(shown >= 0) & ~(agrees & view.foreground)] = -1
    classes[(shown < 0) & view.foreground] = -1
    return classes


def pixel_scores(probabilities: PixelProbabilities, observation: Observation,
                 truths: Sequence[PosedObject],
                 models: Sequence[GenericModel]) -> dict[str, Any]:
    """
    Return the classifier's scores over all certain foreground pixels of a scene.

    :return: {pixels, accuracy, balanced_accuracy, true_probability, log_loss, categories}:
        share of pixels whose most likely class is the true one; the same averaged over classes;
        mean probability of the true class; mean -log of it; {category: {pixels, correct}}.
    """
    truth = np.stack([true_classes(truths, models, v) for v in observation.views])
    u, v = probabilities.uv[:, 0].astype(int), probabilities.uv[:, 1].astype(int)
    true = truth[probabilities.camera.astype(int), v, u]
    certain = true > 0
    if not certain.any():
        return {'pixels': 0, 'accuracy': float('nan'), 'balanced_accuracy': float('nan'),
                'true_probability': float('nan'), 'log_loss': float('nan'), 'categories': {}}
    from sklearn.metrics import log_loss  # of the extra `eval`; parse must do without
    true, p = true[certain], probabilities.p[certain].astype(np.float64)
    p = (p + 0.5) / (p + 0.5).sum(1, keepdims=True)
    likely = p.argmax(1)
    labels = np.arange(p.shape[1])
    correct = likely == true
    categories = {models[c - 1].name: {'pixels': int((true == c).sum()),
                                       'correct': int(correct[true == c].sum())}
                  for c in np.unique(true)}
    balanced = np.mean([c['correct'] / c['pixels'] for c in categories.values()])
    return {'pixels': int(certain.sum()), 'accuracy': float(correct.mean()),
            'balanced_accuracy': float(balanced),
            'true_probability': float(p[np.arange(len(true)), true].mean()),
            'log_loss': float(log_loss(true, p, labels=labels)), 'categories': categories}


@dataclass(frozen=True)
class StageLoss:
    """
    Where the true objects of a scene were lost, as shares of them.

    :ivar pool_localized: some candidate of the category lies within half the model's size.
    :ivar pool_tight: some candidate of the category lies within 2 cm.
    :ivar first_localized: the best-scored candidate of the category lies within half the size.
    :ivar kept: of the objects with a localized candidate, those localized in the result.
    :ivar candidates: number of candidates.
    :ivar objects: a dict (category, near, tight, first) of the same for every true object.
    """

    pool_localized: float
    pool_tight: float
    first_localized: float
    kept: float
    candidates: int
    objects: tuple[dict[str, Any], ...] = ()


def pool_recall(pool: Candidates, truths: Sequence[PosedObject],
                models: Sequence[GenericModel], score: SceneScore | None = None) -> StageLoss:
    """
    Return the StageLoss of a pool of candidates.

    :param score: of the result, for `kept`; NaN without one.
    """
    ids = class_ids(models)
    near, tight, first = (np.zeros(len(truths), bool) for _ in range(3))
    for i, truth in enumerate(truths):
        rows = np.flatnonzero(pool.category == ids.get(truth.category, 0))
        if not len(rows):
            continue
        distance = np.linalg.norm(pool.translation[rows] - truth.translation, axis=1)
        limit = 0.5 * models[ids[truth.category] - 1].longest_side
        near[i], tight[i] = (distance < limit).any(), (distance < TIGHT_M).any()
        first[i] = distance[np.argmax(pool.score[rows])] < limit
    kept = float('nan')
    if score is not None and near.any():
        localized = np.zeros(len(truths), bool)
        localized[[o.truth for o in score.objects if o.localized]] = True
        kept = float(localized[near].mean())
    n = max(len(truths), 1)
    objects = tuple({'category': t.category, 'near': bool(a), 'tight': bool(b), 'first': bool(c)}
                    for t, a, b, c in zip(truths, near, tight, first))
    return StageLoss(near.sum() / n, tight.sum() / n, first.sum() / n, kept, len(pool), objects)


def losses_by_category(losses: Losses, categories: Iterable[str]) -> dict[str, dict[str, int]]:
    """
    Return {category: dict} of what the stages lose of each, from `rerun`'s losses.

    The dict counts true objects, certain pixels and those classified correctly, objects with a
    candidate near, within 2 cm, or ranked first, and objects localized in the result.
    """
    out: dict[str, dict[str, int]] = {c: dict.fromkeys(COUNTS, 0) for c in categories}
    for loss in losses.values():
        for category, count in loss['pixels']['categories'].items():
            for key, n in count.items():
                out[category][key] += n
        for thing in loss['pool'].objects:
            out[thing['category']]['true'] += 1
            for key in ('near', 'tight', 'first'):
                out[thing['category']][key] += thing[key]
        for thing in loss['answer'].objects:
            out[thing.category]['localized'] += thing.localized
    return out
