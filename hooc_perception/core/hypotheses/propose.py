# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 3 of the joint method: model-driven hypotheses become candidates of every category.

Hypotheses are sampled and refined in the voxel field (sampling.py), then ranked, refined and
ranked again in the images.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.core.config import Config, param
from hooc_perception.core.frame.costs import PixelCosts
from hooc_perception.core.frame.evidence import Context, Evidence, hypotheses_of
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.hypotheses.sampling import benefit, distinct, sample
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np
from scipy.spatial.transform import Rotation

# Pixels in half resolution that are enough to refine a hypothesis.
MANY = 120


@dataclass(frozen=True)
class ProposeConfig(Config):
    """Parameters of stage 3 of the joint method."""

    samples: int = param(10000, 'Poses drawn per category.', low=100)
    pool: int = param(120, 'Hypotheses per category that are refined in the voxel field.', low=5)
    refine_steps: int = param(20, 'Refinement steps in the voxel field.', low=0)
    polish: int = param(15, 'Hypotheses per category that are refined in the images.', low=1)
    polish_steps: int = param(10, 'Refinement steps in the images.', low=0)
    per_category: int = param(15, 'Candidates per category.', low=1)
    round_samples: int = param(4000, 'Poses drawn per category in a round of re-proposal.',
                               low=10)
    round_pool: int = param(30, 'Hypotheses per category refined in such a round.', low=1)
    round_per_category: int = param(6, 'Candidates per category from such a round.', low=1)
    free_weight: float = param(0.7, 'Weight of a free-space violation in the voxel field.', '',
                               0.0, 5.0)
    shell_weight: float = param(0.6, 'Weight of a surface point without free space in front of '
                                'it.', '', 0.0, 5.0)
    size_sigma: float = param(0.2, 'Standard deviation of the log size of samples.', '', 0.0, 1.0)
    size_prior: float = param(0.02, 'Cost of the squared log scale in the voxel field.', '', 0.0,
                              1.0)
    tilted: float = param(0.2, 'Share of samples in any rotation instead of a resting one.', '',
                          0.0, 1.0)
    distrust: float = param(0.03, 'Least weight of a scene point, whatever the classifier says.',
                            '', 0.0, 1.0)
    complexity: float = param(0.1, 'Cost per covered pixel in ranking.', '', 0.0, 2.0)


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
    H, category = sample(frame, frame.models, config, rng, config.samples, config.pool,
                         config.refine_steps)
    return _ranked(frame, _Ranking(config, costs, config.polish, config.per_category), rng, H,
                   category, lambda evidence: evidence.nothing)


def propose_more(frame: Frame, objects: Candidates, config: ProposeConfig, costs: PixelCosts,
                 rng: np.random.Generator) -> Candidates:
    """Return further Candidates for what `objects` leave unexplained."""
    if frame.field is None:
        return Candidates.empty()

    @cache
    def shown(evidence: Evidence) -> Context:
        _, lists = evidence.explain(hypotheses_of(objects, frame.models), objects.category,
                                    costs.weights(), lists=True)
        return evidence.compose(np.arange(len(objects)), lists)

    left = frame.coarse.unexplained(shown(frame.coarse))
    if not left.any():
        return Candidates.empty()
    H, category = sample(frame, frame.models, config, rng, config.round_samples,
                         config.round_pool, config.refine_steps, left + 0.02)
    few = config.round_per_category
    return _ranked(frame, _Ranking(config, costs, few, few), rng, H, category, shown)


def _ranked(frame: Frame, ranking: _Ranking, rng: np.random.Generator, H: Float64Array,
            category: Int64Array, shown: Callable[[Evidence], Context]) -> Candidates:
    """
    Rank hypotheses in the images, refine the best there and return the best of those.

    :param H: (m, 11) hypotheses with their score in the voxel field; `category` (m,).
    :param shown: Evidence -> the context of what is explained already.
    """
    models, config, coarse = frame.models, ranking.config, frame.coarse
    weights = ranking.costs.weights()
    stats = coarse.explain(H, category, weights, shown(coarse))
    score = benefit(stats, config.complexity)
    # Half of the places go to the field's own order: it knows what the images hide.
    rows = np.union1d(distinct(H, category, score, models, ranking.n_refine),
                      distinct(H, category, H[:, 10], models, ranking.n_refine // 2))
    H, category, covered = H[rows], category[rows], stats[rows, stat.SHOWN]
    # A few hundred pixels determine a pose: large objects need no more, thin ones need them all.
    for evidence, low, high in ((frame.evidence, 0, MANY), (coarse, MANY, 8 * MANY),
                                (frame.coarsest, 8 * MANY, np.inf)):
        mine = np.flatnonzero((low <= covered) & (covered < high))
        if config.polish_steps and len(mine):
            H[mine, :10] = evidence.polish(
                H[mine], category[mine], np.full(len(mine), -1), shown(evidence), weights,
                config.complexity, 0.1, config.polish_steps, (0.006, 0.08, 0.05), rng)
    score = benefit(coarse.explain(H, category, weights, shown(coarse)), config.complexity)
    rows = distinct(H, category, score, models, ranking.n_keep)
    return candidates_of(H[rows], category[rows], score[rows], models)


def candidates_of(H: Float64Array, category: Int64Array, score: Float64Array,
                  models: tuple[GenericModel, ...]) -> Candidates:
    """Return Candidates from hypotheses (m, 10+), class ids and scores."""
    extents = np.array([models[c - 1].extents for c in category]).reshape(-1, 3)
    return Candidates(category.astype(np.uint16), H[:, :3].copy(),
                      Rotation.from_quat(H[:, 3:7]).as_quat() if len(H) else H[:, 3:7].copy(),
                      (H[:, 7:10] * extents).astype(np.float32), score.astype(np.float32))
