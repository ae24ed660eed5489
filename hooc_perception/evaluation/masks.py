# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scores by masks, for recordings with instance labels but without poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import AnyArray, BoolArray, Float64Array, Int64Array, UInt8Array
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import GenericModel, RectifiedView
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.matching import PosedObject, shape_of
import numpy as np
from scipy.optimize import linear_sum_assignment

MIN_LABEL_PIXELS = 150
EXPLAINED_IOU = 0.5


@dataclass(frozen=True)
class MaskScore:
    """
    How well estimates explain the labelled objects of a scene, added up over its views.

    :ivar explained: number of labelled objects with a partner of IoU >= 0.5.
    :ivar labelled: number of labelled objects of more than 150 pixels.
    :ivar estimated: number of estimates, counted once per labelled view.
    :ivar iou: IoU of every labelled object with its partner, 0 where it has none.
    """

    name: str
    explained: int
    labelled: int
    estimated: int
    iou: tuple[float, ...]
    seconds: float = float('nan')
    missing: bool = False


def match_masks(estimated_ids: AnyArray, n_estimates: int, labels: AnyArray,
                valid: BoolArray) -> tuple[list[int], Int64Array, Float64Array]:
    """
    Return (label values, matched estimate or -1, IoU), one to one, of one view.

    :param estimated_ids: (H, W) int, the estimate visible at a pixel, -1 none.
    :param labels: (H, W) integers, 0 none.
    :param valid: (H, W) bool, pixels with a reading; all others are left out.
    """
    values = [int(v) for v in np.unique(labels)
              if v > 0 and (labels == v).sum() > MIN_LABEL_PIXELS]
    partner, best = np.full(len(values), -1), np.zeros(len(values))
    if not n_estimates or not values:
        return values, partner, best
    iou = np.zeros((len(values), n_estimates))
    shown = np.bincount(estimated_ids[valid & (estimated_ids >= 0)], minlength=n_estimates)
    for row, value in enumerate(values):
        mask = (labels == value) & valid
        both = np.bincount(estimated_ids[mask & (estimated_ids >= 0)], minlength=n_estimates)
        iou[row] = both / np.maximum(mask.sum() + shown - both, 1)
    for row, column in zip(*linear_sum_assignment(-iou)):
        partner[row], best[row] = column, iou[row, column]
    return values, partner, best


def score_masks(name: str, estimates: Sequence[PosedObject], models: Mapping[str, GenericModel],
                views: Sequence[RectifiedView], labels: Mapping[str, UInt8Array],
                seconds: float = float('nan'), missing: bool = False) -> MaskScore:
    """
    Return the MaskScore of a scene.

    :param estimates: each model is rendered at its estimated size.
    :param views: RectifiedViews whose camera is that of the labels.
    :param labels: mapping camera name -> (H, W) uint8 instance labels, rectified too.
    """
    meshes = [world_mesh(e, shape_of(e, models)) for e in estimates]
    explained = labelled = estimated = 0
    ious: list[float] = []
    for view in views:
        if view.camera.name not in labels:
            continue
        ids = render_depth(meshes, view.camera)[1]
        values, _, best = match_masks(ids, len(meshes), labels[view.camera.name],
                                      np.isfinite(view.depth))
        explained += int((best >= EXPLAINED_IOU).sum())
        labelled += len(values)
        estimated += len(meshes)
        ious.extend(float(b) for b in best)
    return MaskScore(name, explained, labelled, estimated, tuple(ious), float(seconds), missing)
