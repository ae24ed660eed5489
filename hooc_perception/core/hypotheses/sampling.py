# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Model-driven hypotheses: put every model onto the measured surface in many poses and sizes.

A sample puts a random model point onto a random scene point with the same facing; resting poses
are preferred, other rotations are tried as well. Samples are scored and refined in the fused
field; what is left is then ranked in the images.
"""

from collections.abc import Sequence
from typing import NamedTuple

from hooc_perception.core.arrays import AnyArray, Float64Array, Int64Array
from hooc_perception.core.frame.field import Cloud
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.frame.kernels.records import Field
from hooc_perception.core.hypotheses.config import ProposeConfig
from hooc_perception.core.hypotheses.kernels.drawing import sample_all
from hooc_perception.core.hypotheses.kernels.records import (
    DrawSettings,
    FieldRefineSettings,
    ModelTables,
    ScoreWeights,
    Surface,
)
from hooc_perception.core.hypotheses.kernels.refinement import refine_all
from hooc_perception.core.hypotheses.kernels.scoring import quick_field
from hooc_perception.core.hypotheses.kernels.suppression import suppress_near_duplicates
from hooc_perception.core.kernels.pose import SCORE, WIDTH
from hooc_perception.core.memo import per_model
from hooc_perception.core.types import GenericModel
import numpy as np

# Surface points in the tables; how many of them the quick test, the score and the refinement use.
TABLE_POINTS = 512
QUICK_POINTS, SCORE_POINTS, REFINE_POINTS = 16, 32, 128
# Initial random steps of the refinement in the field: metres, radians, log scale.
STEP_SIZES = (0.01, 0.12, 0.08)
# Added to the probability of every resting pose: in clutter objects lie in poses that they would
# seldom take alone.
REST_FLOOR = 0.05
# Hypotheses of one category closer than this share of the longest side may be near duplicates.
DUPLICATE_REACH = 0.12
# Ranking: weight of a hypothesis that shares no patch, and pixels added to the visible ones so
# that a few good pixels do not win.
LEAST_SHARE = 0.25
PIXEL_PRIOR = 100


class SampleCounts(NamedTuple):
    """
    How many hypotheses are drawn.

    :ivar samples: drawn per category; `keep` of them are refined.
    :ivar refine_steps: trials per refinement.
    """

    samples: int
    keep: int
    refine_steps: int


def tables(models: Sequence[GenericModel]) -> ModelTables:
    """Return the models' surface points and resting rotations, stacked for the kernels."""
    most = max(len(m.rest_rotations) for m in models)
    rest = np.zeros((len(models), most, 4))
    cdf = np.zeros((len(models), most))
    for k, m in enumerate(models):
        n = len(m.rest_rotations)
        rest[k, :n], rest[k, n:] = m.rest_rotations, m.rest_rotations[0]
        weight = np.zeros(most)
        weight[:n] = m.rest_probability + REST_FLOOR
        cdf[k] = np.cumsum(weight)
    points, normals = zip(*(_surface(m) for m in models))
    return ModelTables(np.stack(points), np.stack(normals), rest, cdf)


@per_model
def _surface(model: GenericModel) -> tuple[Float64Array, Float64Array]:
    """Return TABLE_POINTS surface points and normals, float64."""
    n, most = len(model.surface_points), TABLE_POINTS
    rows = np.arange(most) % n if n < most else np.linspace(0, n - 1, most).astype(int)
    return (model.surface_points[rows].astype(np.float64),
            model.surface_normals[rows].astype(np.float64))


def sample(cloud: Cloud, field: Field, models: Sequence[GenericModel], config: ProposeConfig,
           rng: np.random.Generator, counts: SampleCounts, weight: Float64Array | None = None,
           extra: tuple[Float64Array, AnyArray] | None = None) -> tuple[Float64Array, Int64Array]:
    """
    Return hypotheses (m, 11), scores in the last column, and their categories (m,).

    Of every model the best of every cell of the table are drawn and then refined in the field.

    :param weight: (n,) or (models, n) how likely each point of the cloud is drawn.
    :param extra: (hypotheses (k, 10), categories (k,)) from elsewhere, to be refined with them;
        those that do not fit the field at all are left out.
    """
    t, weights = tables(models), ScoreWeights(
        float(config.free_weight), float(config.shell_weight), float(config.size_prior))
    drawn = sample_all(
        rng.integers(0, 2**31, len(models)), t, Surface(cloud.points, cloud.normals),
        _scene_cdf(cloud, len(models), config.distrust, weight), field, quick_field(field.data),
        weights, DrawSettings(counts.samples, counts.keep, float(config.size_sigma),
                              float(config.tilted), QUICK_POINTS, SCORE_POINTS))
    H = drawn.reshape(-1, WIDTH + 1)
    model_of = np.repeat(np.arange(len(models)), counts.keep)
    filled = np.isfinite(H[:, SCORE])
    H, model_of = np.ascontiguousarray(H[filled]), model_of[filled]
    drawn_here = len(H)
    if extra is not None:
        H = np.concatenate([H, np.column_stack([extra[0], np.zeros(len(extra[0]))])])
        model_of = np.concatenate([model_of, extra[1].astype(np.int64) - 1])
    refine_all(rng.integers(0, 2**31, len(H)), H, model_of, t, field, weights,
               FieldRefineSettings(REFINE_POINTS, counts.refine_steps, *STEP_SIZES))
    fits = (np.arange(len(H)) < drawn_here) | (H[:, SCORE] > 0)
    return H[fits], model_of[fits] + 1


def _scene_cdf(cloud: Cloud, n_models: int, distrust: float,
               weight: Float64Array | None) -> Float64Array:
    """Return (models, n) float64 cumulative weights of the cloud's points for each model."""
    n = len(cloud.points)
    if weight is None:
        weight = np.ones(n)
    if cloud.p.shape[1] > 1:
        # Draws follow the classifier, but no point is ruled out.
        likely = cloud.p[:, 1:].T.astype(np.float64)
        weight = weight * (likely + distrust)
    weight = np.broadcast_to(weight, (n_models, n))
    return np.ascontiguousarray(np.cumsum(weight, 1))


def benefit(stats: Float64Array, complexity: float) -> Float64Array:
    """
    Return (m,) how much each hypothesis lowers the cost of the images, relative to its size.

    Small models fit easily inside of large objects: a gain counts by the share of the smooth
    patches that the hypothesis agrees with.

    :param stats: (m, STATS) of Evidence.compare.
    :param complexity: cost per covered pixel.
    """
    seen = stats[:, stat.SHOWN] - stats[:, stat.BEHIND] - stats[:, stat.MISSING]
    gain = -stats[:, stat.DELTA] - complexity * stats[:, stat.SHOWN]
    loss = np.minimum(gain, 0)
    share = LEAST_SHARE + (1 - LEAST_SHARE) * stats[:, stat.SHARE]
    return (np.maximum(gain, 0) * share + loss) / (seen + PIXEL_PRIOR)


def non_maximum_suppression(H: Float64Array, category: Int64Array, score: Float64Array,
                            models: Sequence[GenericModel], most: int) -> Int64Array:
    """
    Return the rows of the best `most` per category, without near duplicates of better ones.

    Duplicates agree in place, rotation and size; the same place with another size is kept.
    """
    H = np.ascontiguousarray(H[:, :WIDTH], np.float64)
    rows = []
    for c in np.unique(category):
        mine = np.flatnonzero(category == c)
        mine = mine[np.argsort(-score[mine], kind='stable')]
        reach = DUPLICATE_REACH * models[c - 1].longest_side
        rows.append(mine[suppress_near_duplicates(H[mine], reach, most)])
    return np.concatenate(rows) if rows else np.zeros(0, np.int64)
