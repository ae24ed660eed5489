# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 3 of the joint method: model-driven hypotheses become candidates of every category.

Hypotheses are sampled and refined in the voxel field (sampling.py), then ranked, refined and
ranked again in the images.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

from hooc_perception.core.arrays import AnyArray, BoolArray, Float64Array, Int64Array
from hooc_perception.core.frame.costs import PixelCosts
from hooc_perception.core.frame.evidence import Evidence, hypotheses_of
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.frame.kernels.records import Context, RefineSettings
from hooc_perception.core.hypotheses.config import ProposeConfig
from hooc_perception.core.hypotheses.sampling import (
    benefit,
    non_maximum_suppression,
    sample,
    SampleCounts,
)
from hooc_perception.core.kernels.pose import QUATERNION, SCALE, SCORE, TRANSLATION, WIDTH
from hooc_perception.core.shapes import Shapes
from hooc_perception.core.types import Candidates
import numpy as np
from scipy.spatial.transform import Rotation

# Pixels in half resolution that are enough to refine a hypothesis.
MANY = 120
# Weight of points that are explained, where the unexplained ones are drawn with 1.
ELSEWHERE = 0.02
# Points of the cloud of a full table, where all poses are drawn; at least this share of them is.
FULL_TABLE, LEAST_FILLED = 40_000, 0.5
# Where a third of the foreground is asked for, all candidates of a round are drawn.
FULL_EFFORT = 3.0
# Refinement in the images: cost of the squared log scale per covered pixel, and initial random
# steps (metres, radians, log scale).
SIZE_PRIOR, STEP_SIZES = 0.1, (0.006, 0.08, 0.05)


@dataclass(frozen=True)
class _Ranking:
    """How hypotheses are ranked in the images, and how many survive each step."""

    config: ProposeConfig
    costs: PixelCosts
    n_refine: int
    n_keep: int


def propose(frame: Frame, config: ProposeConfig, costs: PixelCosts,
            rng: np.random.Generator) -> Candidates:
    """
    Return Candidates of every category, the best of each first.

    :param costs: of a pixel, as in parsing.
    :param rng: numpy Generator of this stage.
    """
    if frame.field is None:
        return Candidates.empty()
    filled = min(max(len(frame.cloud.points) / FULL_TABLE, LEAST_FILLED), 1.0)
    H, shape = sample(
        frame.cloud, frame.field, frame.shapes, config, rng,
        SampleCounts(share_of(config.samples, filled), config.pool, config.refine_steps))
    return _ranked(frame, _Ranking(config, costs, config.polish, config.per_category), rng, H,
                   shape, lambda evidence: evidence.nothing)


def propose_more(frame: Frame, objects: Candidates, config: ProposeConfig, costs: PixelCosts,
                 rng: np.random.Generator, region: Sequence[BoolArray] | None = None,
                 ) -> Candidates:
    """
    Return further Candidates for what `objects` leave unexplained.

    :param region: per view (H, W) bool, where they are looked for; None = everywhere.
    """
    if frame.field is None:
        return Candidates.empty()

    @cache
    def shown(evidence: Evidence) -> Context:
        _, lists = evidence.compare_pixels(hypotheses_of(objects, frame.shapes),
                                           frame.shapes.of(objects), costs.weights())
        return evidence.compose(np.arange(len(objects)), lists)

    left = frame.coarse.unexplained(shown(frame.coarse))
    weight = left + ELSEWHERE
    if region is not None:
        left = left * (frame.evidence.share_of_points(region) > 0)
        weight = left
    if not left.any():
        return Candidates.empty()
    effort = effort_of(float(left.mean()), config.least_effort)
    H, shape = sample(
        frame.cloud, frame.field, frame.shapes, config, rng,
        SampleCounts(share_of(config.round_samples, effort), share_of(config.round_pool, effort),
                     config.refine_steps), weight)
    few = share_of(config.round_per_category, effort)
    return _ranked(frame, _Ranking(config, costs, few, few), rng, H, shape, shown)


def effort_of(share: float, least: float) -> float:
    """Return the share of the candidates that are needed where a share of a scene is asked for."""
    return min(max(FULL_EFFORT * share, least), 1.0)


def share_of(number: int, share: float) -> int:
    """Return a share of a number of candidates, at least one."""
    return max(1, round(number * share))


def _ranked(frame: Frame, ranking: _Ranking, rng: np.random.Generator, H: Float64Array,
            shape: Int64Array, shown: Callable[[Evidence], Context]) -> Candidates:
    """
    Rank hypotheses in the images, refine the best there and return the best of those.

    :param H: (m, 11) hypotheses with their score in the voxel field; `shape` (m,) their meshes.
    :param shown: Evidence -> the context of what is explained already.
    """
    shapes, config, coarse = frame.shapes, ranking.config, frame.coarse
    weights = ranking.costs.weights()
    stats = coarse.compare(H, shape, weights, shown(coarse))
    score = benefit(stats, config.complexity)
    # Half of the places go to the field's own order: it knows what the images hide.
    rows = np.union1d(
        non_maximum_suppression(H, shape, score, shapes, ranking.n_refine),
        non_maximum_suppression(H, shape, H[:, SCORE], shapes, ranking.n_refine // 2))
    H, shape, covered = H[rows], shape[rows], stats[rows, stat.SHOWN]
    settings = RefineSettings(config.complexity, SIZE_PRIOR, config.polish_steps, *STEP_SIZES)
    # A few hundred pixels determine a pose: large objects need no more, thin ones need them all.
    for evidence, low, high in ((frame.evidence, 0, MANY), (coarse, MANY, 8 * MANY),
                                (frame.coarsest, 8 * MANY, np.inf)):
        mine = np.flatnonzero((low <= covered) & (covered < high))
        if config.polish_steps and len(mine):
            H[mine, :WIDTH] = evidence.refine(H[mine], shape[mine], weights, settings, rng,
                                              shown(evidence))
    score = benefit(coarse.compare(H, shape, weights, shown(coarse)), config.complexity)
    rows = non_maximum_suppression(H, shape, score, shapes, ranking.n_keep)
    return candidates_of(H[rows], shape[rows], score[rows], shapes)


def candidates_of(H: Float64Array, shape: Int64Array, score: AnyArray,
                  shapes: Shapes) -> Candidates:
    """Return Candidates from hypotheses (m, 10+), the numbers of their meshes, and scores."""
    return Candidates(shapes.category[shape].astype(np.uint16), H[:, TRANSLATION].copy(),
                      Rotation.from_quat(H[:, QUATERNION]).as_quat() if len(H)
                      else H[:, QUATERNION].copy(),
                      (H[:, SCALE] * shapes.extents[shape]).astype(np.float32),
                      score.astype(np.float32), shapes.member[shape])
