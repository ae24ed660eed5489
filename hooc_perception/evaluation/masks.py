# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scores by masks, for recordings with instance labels but without poses."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from hooc_perception.core.arrays import AnyArray, BoolArray, Float64Array, Int64Array, UInt8Array
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import GenericModel, RectifiedView
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.matching import PosedObject, shape_of
from hooc_perception.evaluation.named_masks import named_score, NamedScore
import numpy as np
from scipy.optimize import linear_sum_assignment

MIN_LABEL_PIXELS = 150
EXPLAINED_IOU = 0.5


@dataclass(frozen=True, eq=False)
class Labels:
    """
    What somebody noted of a scene.

    :ivar images: {camera name: (H, W) uint8 instance labels, 0 = none}, rectified.
    :ivar categories: {label: category}, None where nobody noted them.
    :ivar well_seen: {camera name: labels with enough depth}.
    """

    images: Mapping[str, UInt8Array]
    categories: Mapping[int, str] | None = None
    well_seen: Mapping[str, Collection[int]] = field(default_factory=dict)


@dataclass(frozen=True)
class MaskScore:
    """
    How well estimates explain the labelled objects of a scene, added up over its views.

    :ivar explained: number of labelled objects with a partner of IoU >= 0.5.
    :ivar labelled: number of labelled objects that count, see `countable`.
    :ivar estimated: number of estimates, counted once per labelled view.
    :ivar iou: IoU of every labelled object with its partner, 0 where it has none.
    :ivar named: by category, None where the categories of the labels are not known.
    """

    name: str
    explained: int
    labelled: int
    estimated: int
    iou: tuple[float, ...]
    seconds: float = float('nan')
    missing: bool = False
    named: NamedScore | None = None


def countable(labels: AnyArray, valid: BoolArray, with_category: bool) -> list[int]:
    """
    Return the labels that count: those of more than 150 pixels.

    Where their categories are known, of at least 150 pixels with a reading: nothing can be named
    where nothing was measured.
    """
    if not with_category:
        return [int(v) for v in np.unique(labels)
                if v > 0 and (labels == v).sum() > MIN_LABEL_PIXELS]
    return [int(v) for v in np.unique(labels)
            if v > 0 and ((labels == v) & valid).sum() >= MIN_LABEL_PIXELS]


def overlaps(estimated_ids: AnyArray, n_estimates: int, labels: AnyArray, values: Sequence[int],
             valid: BoolArray) -> Float64Array:
    """
    Return (len(values), n_estimates) IoU of labels and visible estimates in one view.

    :param estimated_ids: (H, W) int, the estimate visible at a pixel, -1 none.
    :param labels: (H, W) integers, 0 none; `values` those of interest.
    :param valid: (H, W) bool, pixels with a reading; all others are left out.
    """
    iou = np.zeros((len(values), n_estimates))
    shown = np.bincount(estimated_ids[valid & (estimated_ids >= 0)], minlength=n_estimates)
    for row, value in enumerate(values):
        mask = (labels == value) & valid
        both = np.bincount(estimated_ids[mask & (estimated_ids >= 0)], minlength=n_estimates)
        iou[row] = both / np.maximum(mask.sum() + shown - both, 1)
    return iou


def matched(iou: Float64Array) -> tuple[Int64Array, Float64Array]:
    """Return (matched estimate or -1, IoU or 0) of every label, one to one."""
    partner, best = np.full(len(iou), -1), np.zeros(len(iou))
    for row, column in zip(*linear_sum_assignment(-iou)):
        partner[row], best[row] = column, iou[row, column]
    return partner, best


def score_masks(name: str, estimates: Sequence[PosedObject], models: Mapping[str, GenericModel],
                views: Sequence[RectifiedView], labels: Labels,
                seconds: float = float('nan'), missing: bool = False) -> MaskScore:
    """
    Return the MaskScore of a scene.

    :param estimates: each model is rendered at its estimated size.
    :param views: RectifiedViews whose camera is that of the labels.
    """
    meshes = [world_mesh(e, shape_of(e, models)) for e in estimates]
    found = [e.category for e in estimates]
    explained = labelled = estimated = 0
    ious: list[float] = []
    named = None if labels.categories is None else NamedScore()
    for view in views:
        camera = view.camera.name
        if camera not in labels.images:
            continue
        image, valid = labels.images[camera], np.isfinite(view.depth)
        ids = render_depth(meshes, view.camera)[1]
        values = countable(image, valid, named is not None)
        iou = overlaps(ids, len(meshes), image, values, valid)
        partner, best = matched(iou)
        explained += int((best >= EXPLAINED_IOU).sum())
        labelled += len(values)
        estimated += len(meshes)
        ious.extend(float(b) for b in best)
        if named is not None and labels.categories is not None:
            well_seen = labels.well_seen.get(camera, ())
            taken_for = [found[k] if b >= EXPLAINED_IOU else None for k, b in zip(partner, best)]
            named += named_score(
                iou, [labels.categories.get(v) for v in values], [v in well_seen for v in values],
                taken_for, found, np.bincount(ids[ids >= 0], minlength=len(meshes)))
    return MaskScore(name, explained, labelled, estimated, tuple(ious), float(seconds), missing,
                     named)
