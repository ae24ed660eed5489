# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Model-driven hypotheses: put every model onto the seen surface in many poses and sizes.

A sample puts a random model point onto a random scene point with the same facing; resting poses
are preferred, other rotations are tried as well. Scored against the fused field, refined there,
then ranked in the images.
"""

from dataclasses import dataclass

from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.hypotheses.kernels import hypotheses as kernel
from hooc_perception.core.hypotheses.kernels.suppression import first_unlike
from hooc_perception.core.memo import per_model
import numpy as np


@dataclass(frozen=True)
class Tables:
    """Surface points (models, P, 3), normals, resting poses (models, R, 4) and their cdf."""

    points: np.ndarray
    normals: np.ndarray
    rest: np.ndarray
    rest_cdf: np.ndarray


def tables(models):
    """Return the models' arrays, stacked for the kernels."""
    most = max(len(m.rest_rotations) for m in models)
    rest = np.zeros((len(models), most, 4))
    cdf = np.zeros((len(models), most))
    for k, m in enumerate(models):
        n = len(m.rest_rotations)
        rest[k, :n], rest[k, n:] = m.rest_rotations, m.rest_rotations[0]
        weight = np.zeros(most)
        # Clutter holds things in poses that they would seldom take alone.
        weight[:n] = m.rest_probability + 0.05
        cdf[k] = np.cumsum(weight)
    points, normals = zip(*(_surface(m) for m in models))
    return Tables(np.stack(points), np.stack(normals), rest, cdf)


@per_model
def _surface(model):
    """Return 512 surface points and normals, float64."""
    n = len(model.surface_points)
    rows = np.arange(512) % n if n < 512 else np.linspace(0, n - 1, 512).astype(int)
    return (model.surface_points[rows].astype(np.float64),
            model.surface_normals[rows].astype(np.float64))


def sample(space, models, config, rng, n_samples, keep, refine_steps, weight=None, extra=None):
    """
    Return hypotheses (m, 11) and their categories (m,): the best of every patch of table.

    :param space: Workspace.
    :param weight: (n,) or (models, n) how likely each point of the cloud is drawn.
    :param extra: (hypotheses (k, 10), categories (k,)) from elsewhere, to be refined with them.
    """
    cloud, field, t = space.cloud, space.field, tables(models)
    n = len(cloud.points)
    if weight is None:
        weight = np.ones(n)
    if cloud.p.shape[1] > 1:
        # Half of the draws follow the classifier, half do not trust it.
        likely = cloud.p[:, 1:].T.astype(np.float64)
        weight = weight * (likely + config.distrust)
    weight = np.broadcast_to(weight, (len(models), n))
    shared = (field.origin, field.voxel, config.free_weight, config.shell_weight,
              config.size_prior)
    drawn = kernel.sample_all(
        rng.integers(0, 2**31, len(models)), n_samples, keep, t.points, t.normals, t.rest,
        t.rest_cdf, cloud.points, cloud.normals, np.ascontiguousarray(np.cumsum(weight, 1)),
        field.data, kernel.quick_field(field.data), *shared, config.size_sigma, config.tilted,
        16, 32)
    H = drawn.reshape(-1, kernel.WIDTH + 1)
    model_of = np.repeat(np.arange(len(models)), keep)
    filled = np.isfinite(H[:, kernel.WIDTH])
    H, model_of = np.ascontiguousarray(H[filled]), model_of[filled]
    drawn_here = len(H)
    if extra is not None:
        H = np.concatenate([H, np.column_stack([extra[0], np.zeros(len(extra[0]))])])
        model_of = np.concatenate([model_of, extra[1].astype(np.int64) - 1])
    kernel.refine_all(rng.integers(0, 2**31, len(H)), H, model_of, t.points, t.normals, 128,
                      field.data, *shared, refine_steps, 0.01, 0.12, 0.08)
    # What came from elsewhere has not yet been asked whether it fits at all.
    fits = (np.arange(len(H)) < drawn_here) | (H[:, kernel.WIDTH] > 0)
    return H[fits], model_of[fits] + 1


def benefit(stats, complexity):
    """
    Return (m,) how much each hypothesis betters the images for its size.

    Small models lie easily inside large things: what they explain counts by the share of the
    smooth patches that they explain with it.
    """
    seen = stats[:, stat.SHOWN] - stats[:, stat.BEHIND] - stats[:, stat.MISSING]
    gain = -stats[:, stat.DELTA] - complexity * stats[:, stat.SHOWN]
    loss = np.minimum(gain, 0)
    return (np.maximum(gain, 0) * (0.25 + 0.75 * stats[:, stat.SHARE]) + loss) / (seen + 100)


def distinct(H, category, score, models, most):
    """
    Return the rows of the best `most` a category, leaving out near copies of better ones.

    Copies agree in place, orientation and size; the same place with another size is kept.
    """
    H = np.ascontiguousarray(H[:, :kernel.WIDTH], np.float64)
    rows = []
    for c in np.unique(category):
        mine = np.flatnonzero(category == c)
        mine = mine[np.argsort(-score[mine], kind='stable')]
        rows.append(mine[first_unlike(H[mine], 0.12 * models[c - 1].longest_side, most)])
    return np.concatenate(rows) if rows else np.zeros(0, np.int64)
