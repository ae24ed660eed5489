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

from hooc_perception.core.arrays import Float64Array, Int64Array
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
from hooc_perception.core.kernels.pose import SCALE, SCORE, WIDTH
from hooc_perception.core.memo import per_model
from hooc_perception.core.shapes import Shapes
from hooc_perception.core.types import GenericModel
import numpy as np

# Surface points in the tables; how many of them the quick test, the score and the refinement use.
TABLE_POINTS = 512
QUICK_POINTS, SCORE_POINTS, REFINE_POINTS = 16, 32, 128
# Initial random steps of the refinement in the field: metres, radians, log scale.
STEP_SIZES = (0.01, 0.12, 0.08)
# After this share of the refinement steps only the better half of the hypotheses goes on.
FIRST_STEPS = 0.3
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

    :ivar samples: drawn per category; `keep` of them are refined. The members of a family share
        them.
    :ivar refine_steps: trials per refinement.
    """

    samples: int
    keep: int
    refine_steps: int


def tables(models: Sequence[GenericModel]) -> ModelTables:
    """Return the meshes' surface points and resting rotations, stacked for the kernels."""
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


def sample(cloud: Cloud, field: Field, shapes: Shapes, config: ProposeConfig,
           rng: np.random.Generator, counts: SampleCounts, weight: Float64Array | None = None,
           ) -> tuple[Float64Array, Int64Array]:
    """
    Return hypotheses (m, 11), scores in the last column, and the numbers of their meshes (m,).

    Of every mesh the best of every cell of the table are drawn and then refined in the field.

    :param weight: (n,) how likely each point of the cloud is drawn.
    """
    t, weights = tables(shapes.models), ScoreWeights(
        float(config.free_weight), float(config.shell_weight), float(config.size_prior))
    cdf = _scene_cdf(cloud, config.distrust, weight)
    scene, quick = Surface(cloud.points, cloud.normals), quick_field(field.data)
    seeds = rng.integers(0, 2**31, len(shapes))
    parts, shape_of = [], []
    # Families of one size are drawn together: they share the samples of a category alike.
    for size in np.unique(shapes.family):
        mine = np.flatnonzero(shapes.family == size)
        samples, keep = (-(-count // int(size)) for count in (counts.samples, counts.keep))
        drawn = sample_all(
            seeds[mine], ModelTables(*(rows[mine] for rows in t)), scene,
            cdf[shapes.category[mine] - 1], field, quick, weights,
            DrawSettings(samples, keep, float(config.size_sigma), float(config.tilted),
                         QUICK_POINTS, SCORE_POINTS))
        parts.append(drawn.reshape(-1, WIDTH + 1))
        shape_of.append(np.repeat(mine, keep))
    H, shape = np.concatenate(parts), np.concatenate(shape_of)
    filled = np.isfinite(H[:, SCORE])
    H, shape = np.ascontiguousarray(H[filled]), shape[filled]

    def refine(steps: int) -> None:
        refine_all(rng.integers(0, 2**31, len(H)), H, shape, t, field, weights,
                   FieldRefineSettings(REFINE_POINTS, steps, *STEP_SIZES))

    first = int(FIRST_STEPS * counts.refine_steps)
    refine(first)
    rows = best_half(H[:, SCORE], shape)
    H, shape = np.ascontiguousarray(H[rows]), shape[rows]
    refine(counts.refine_steps - first)
    return H, shape


def best_half(score: Float64Array, shape: Int64Array) -> Int64Array:
    """Return the rows of the better half of the hypotheses of each mesh, in their order."""
    order = np.lexsort((-score, shape))
    first = np.searchsorted(shape[order], shape[order])
    place = np.arange(len(order)) - first
    size = np.bincount(shape)[shape[order]] if len(shape) else first
    return np.sort(order[2 * place < size])


def _scene_cdf(cloud: Cloud, distrust: float, weight: Float64Array | None) -> Float64Array:
    """Return (N, n) float64 cumulative weights of the cloud's points for each category."""
    n = len(cloud.points)
    if weight is None:
        weight = np.ones(n)
    # Draws follow the classifier, but no point is ruled out.
    likely = cloud.p[:, 1:].T.astype(np.float64)
    return np.ascontiguousarray(np.cumsum(weight * (likely + distrust), 1))


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


def non_maximum_suppression(H: Float64Array, shape: Int64Array, score: Float64Array,
                            shapes: Shapes, most: int) -> Int64Array:
    """
    Return the rows of the best `most` per category, without near duplicates of better ones.

    Duplicates agree in place, rotation and size; the same place with another size is kept. Of
    the members of a family that lie there alike only the best is.
    """
    H = np.array(H[:, :WIDTH], np.float64)
    H[:, SCALE] *= shapes.extents[shape]
    category, longest = shapes.category[shape], shapes.extents.max(1)
    rows = []
    for c in np.unique(category):
        mine = np.flatnonzero(category == c)
        mine = mine[np.argsort(-score[mine], kind='stable')]
        reach = DUPLICATE_REACH * longest[shape[mine[0]]]
        rows.append(mine[suppress_near_duplicates(H[mine], reach, most)])
    return np.concatenate(rows) if rows else np.zeros(0, np.int64)
