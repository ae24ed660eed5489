# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Refine hypotheses in the images by Gauss-Newton and random steps."""

from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.core.frame.kernels.compare import AGREE, compare_one, DELTA, SHOWN, STATS
from hooc_perception.core.frame.kernels.records import (
    Context,
    Hypotheses,
    Meshes,
    PixelOutput,
    PixelWeights,
    RefineSettings,
    Target,
    Views,
)
from hooc_perception.core.kernels.gauss_newton import COLUMNS, gauss_newton_step, UNKNOWNS
from hooc_perception.core.kernels.pose import (
    adapted_length,
    random_step,
    SCALE_LIMITS,
    squared_log_scale,
    StepSizes,
    WIDTH,
)
import numba as nb
import numpy as np

# Fewest agreeing pixels for a Gauss-Newton step.
MIN_AGREEING = 20
# Factor on the length of random steps after a failure.
SHORTEN = 0.93


@nb.njit(cache=True)
def _refine_one(seed: int, hypotheses: Hypotheses, k: int, target: Target,
                settings: RefineSettings) -> float:
    """Refine row k of `hypotheses` in place; see refine_all."""
    h = hypotheses.rows[k]
    np.random.seed(seed)
    prior, tolerance = settings.size_prior, target.weights.tolerance_m
    sizes = StepSizes(settings.translation, settings.rotation, settings.log_scale)
    nowhere = PixelOutput(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, np.float32),
                          np.empty(0, np.float32))
    stats, trial, q = np.empty(STATS), np.empty(WIDTH), np.empty(4)
    here, there = np.zeros((UNKNOWNS, COLUMNS)), np.zeros((UNKNOWNS, COLUMNS))
    length, best, agreeing, fresh = 1.0, np.inf, 0.0, False
    for i in range(settings.steps + 1):
        trial[:] = h
        solved = fresh
        if solved:
            gauss_newton_step(here, agreeing, h, prior * agreeing * tolerance * tolerance,
                              SCALE_LIMITS, trial)
            fresh = False
        elif i > 0:
            random_step(sizes, length, 1.0, q, trial)
        compare_one(hypotheses, k, trial, target, stats, there, -1, nowhere)
        cost = stats[DELTA] + stats[SHOWN] * (
            settings.complexity + prior * squared_log_scale(trial))
        success = cost < best
        if success:
            best = cost
            h[:] = trial
            here, there = there, here
            agreeing, fresh = stats[AGREE], stats[AGREE] > MIN_AGREEING
        if not solved:
            length = adapted_length(length, success, SHORTEN)
    return best


@nb.njit(cache=True, parallel=True)
def refine_all(seeds: Int64Array, hypotheses: Hypotheses, views: Views, meshes: Meshes,
               context: Context, weights: PixelWeights, settings: RefineSettings) -> Float64Array:
    """
    Refine every hypothesis in place, by itself, in the images.

    Minimized is the cost of the scene with the hypothesis in the context instead of its former
    self `me`, plus a cost per covered pixel and a prior on its scale. A (1 + 1) evolution
    strategy takes random steps of adapting length; after each success Gauss-Newton steps follow
    until they no longer help.

    :return: (m,) float64, the cost reached.
    """
    m = hypotheses.rows.shape[0]
    reached = np.zeros(m)
    for k in nb.prange(m):
        target = Target(views, meshes, context, weights)
        reached[k] = _refine_one(seeds[k], hypotheses, k, target, settings)
    return reached
