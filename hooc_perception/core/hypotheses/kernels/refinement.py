# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Refine hypotheses in the fused field by Gauss-Newton and random steps."""

from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.core.frame.kernels.records import Field
from hooc_perception.core.hypotheses.kernels.records import (
    FieldRefineSettings,
    ModelTables,
    ScoreWeights,
    Surface,
)
from hooc_perception.core.hypotheses.kernels.scoring import score
from hooc_perception.core.kernels.gauss_newton import COLUMNS, gauss_newton_step, UNKNOWNS
from hooc_perception.core.kernels.pose import (
    adapted_length,
    random_step,
    SCALE_LIMITS,
    SCORE,
    StepSizes,
    WIDTH,
)
import numba as nb
import numpy as np

# Random steps turn this much farther about the vertical: on a table yaw is the least known.
YAW = 2.0
# Factor on the length of random steps after a failure.
SHORTEN = 0.95


@nb.njit(cache=True)
def refine(seed: int, h: Float64Array, surface: Surface, field: Field, weights: ScoreWeights,
           settings: FieldRefineSettings) -> float:
    """
    Raise the score of hypothesis `h` (10,) in place; return the score.

    A (1 + 1) evolution strategy with the 1/5 success rule sees the whole score; after each of
    its gains Gauss-Newton steps follow until they no longer help.
    """
    np.random.seed(seed)
    n = settings.points
    sizes = StepSizes(settings.translation, settings.rotation, settings.log_scale)
    R, q = np.empty((3, 3)), np.empty(4)
    here, there = np.zeros((UNKNOWNS, COLUMNS)), np.zeros((UNKNOWNS, COLUMNS))
    best = score(h, surface, n, field, weights, R, here)
    trial = np.empty(WIDTH)
    length, fresh = 1.0, True
    for _ in range(settings.steps):
        trial[:] = h
        solved = fresh
        if solved:
            gauss_newton_step(here, n, h,
                              weights.size_prior * n * field.truncation * field.truncation,
                              SCALE_LIMITS, trial)
            fresh = False
        else:
            random_step(sizes, length, YAW, q, trial)
        reached = score(trial, surface, n, field, weights, R, there)
        success = reached > best
        if success:
            best = reached
            h[:] = trial
            here, there = there, here
            fresh = True
        if not solved:
            length = adapted_length(length, success, SHORTEN)
    return best


@nb.njit(cache=True, parallel=True)
def refine_all(seeds: Int64Array, hypotheses: Float64Array, model_of: Int64Array,
               tables: ModelTables, field: Field, weights: ScoreWeights,
               settings: FieldRefineSettings) -> None:
    """
    Refine every row of `hypotheses` (m, 11) in place; the last column becomes the score.

    :param model_of: (m,) int64 row of `tables`.
    """
    for k in nb.prange(hypotheses.shape[0]):
        c = model_of[k]
        surface = Surface(tables.points[c], tables.normals[c])
        hypotheses[k, SCORE] = refine(seeds[k], hypotheses[k, :WIDTH], surface, field, weights,
                                      settings)
