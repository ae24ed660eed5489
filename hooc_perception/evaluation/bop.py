# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
BOP's average recalls of VSD, MSSD and MSPD, and its CSV of results.

Hodan et al., "BOP Challenge 2019/2020" (https://bop.felk.cvut.cz/challenges): a pose counts as
correct when its error is below a threshold; the average recall is the share of correct ones,
averaged over thresholds (and, for VSD, over misalignment tolerances).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.types import GenericModel, RectifiedView
from hooc_perception.evaluation.errors import diameter, mspd, mssd, Pose, vsd
from hooc_perception.evaluation.matching import PosedObject
from hooc_perception.evaluation.scores import SceneScore
from hooc_perception.evaluation.visibility import Visibility
import numpy as np

# Tolerances of VSD and thresholds of MSSD, both as shares of the object's diameter, and
# thresholds of the VSD error itself.
SHARES = np.arange(0.05, 0.51, 0.05)
# Thresholds of MSPD, pixels in an image of 640 columns.
MSPD_PIXELS = np.arange(5, 51, 5)
MIN_VISIBLE = 0.1


@dataclass(frozen=True)
class BopScore:
    """
    Average recalls over the targets: true objects, once for each view that shows them.

    :ivar targets: number of (true object, view) with at least a tenth of its pixels visible.
    """

    vsd: float
    mssd: float
    mspd: float
    targets: int

    @property
    def average(self) -> float:
        """Return BOP's AR: the mean of the three recalls."""
        return (self.vsd + self.mssd + self.mspd) / 3


class BopScene(NamedTuple):
    """
    What BOP's recalls need of a scene.

    :ivar visibility: `scene_visibility` of the truths.
    :ivar models: by category.
    """

    score: SceneScore
    estimates: Sequence[PosedObject]
    truths: Sequence[PosedObject]
    views: Sequence[RectifiedView]
    visibility: Sequence[Visibility]
    models: Mapping[str, GenericModel]


def object_recalls(est: Pose, true: Pose, model: GenericModel,
                   view: RectifiedView) -> Float64Array:
    """Return (3,) average recalls of VSD, MSSD, MSPD of one estimate in one view."""
    by_tau = vsd(est, true, model, view, SHARES)
    return np.array([
        (by_tau[:, None] < SHARES).mean(),
        (mssd(est, true, model) < SHARES * diameter(true, model)).mean(),
        (mspd(est, true, model, view.camera) < MSPD_PIXELS * view.camera.width / 640).mean()])


def bop_score(scenes: Iterable[BopScene]) -> BopScore:
    """
    Return the BopScore over scenes.

    Estimates are matched to the truth by their centres, one to one (`match_by_centre`); with
    one instance per category this is BOP's own matching.
    """
    total, targets = np.zeros(3), 0
    for score, estimates, truths, views, visibility, models in scenes:
        for result in score.objects:
            for j, view in enumerate(views):
                if not visibility[result.truth].pixels[j] >= MIN_VISIBLE:
                    continue
                targets += 1
                if result.estimate is not None:
                    total += object_recalls(estimates[result.estimate], truths[result.truth],
                                            models[result.category], view)
    recalls = total / targets if targets else np.full(3, np.nan)
    return BopScore(float(recalls[0]), float(recalls[1]), float(recalls[2]), targets)
