# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 3: class probabilities and depth become pose candidates of every category.

Two ways: `fragments`, the paper's (section 4), and `field`, model-driven hypotheses over the
fused views.
"""

from dataclasses import dataclass
from functools import cache

from hooc_perception.core.config import param
from hooc_perception.core.frame.evidence import hypotheses_of, PixelWeights
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.frame.workspace import workspace_of
from hooc_perception.core.hypotheses.sampling import benefit, distinct, sample
from hooc_perception.core.methods.fragments import FragmentConfig, propose_fragments
from hooc_perception.core.types import Candidates
import numpy as np
from scipy.spatial.transform import Rotation

# Pixels in half resolution that are enough to refine a hypothesis.
MANY = 120


@dataclass(frozen=True)
class ProposeConfig(FragmentConfig):
    """Parameters of stage 3; those of FragmentConfig serve the method `fragments`."""

    method: str = param('field', 'how candidates are found', choices=('field', 'fragments'))
    fragments: bool = param(False, 'field: whether the fragments of the pixel classes (the '
                            "paper's candidates) are added to the hypotheses")
    samples: int = param(10000, 'field: poses drawn for each category', low=100)
    pool: int = param(120, 'field: hypotheses a category that are refined in the field', low=5)
    refine_steps: int = param(20, 'field: steps of refinement in the field', low=0)
    polish: int = param(15, 'field: hypotheses a category that are refined in the images', low=1)
    polish_steps: int = param(10, 'field: steps of refinement in the images', low=0)
    per_category: int = param(15, 'field: candidates a category', low=1)
    round_samples: int = param(4000, 'field: poses a category in a round of re-proposal', low=10)
    round_pool: int = param(30, 'field: hypotheses a category refined in such a round', low=1)
    round_per_category: int = param(6, 'field: candidates a category from such a round', low=1)
    free_weight: float = param(0.7, 'field: weight of a point in space that is seen through', '',
                               0.0, 5.0)
    shell_weight: float = param(0.6, 'field: weight of a point that has no air in front', '',
                                0.0, 5.0)
    size_sigma: float = param(0.2, 'field: log deviation of the size of samples', '', 0.0, 1.0)
    size_prior: float = param(0.02, 'field: cost of squared log scale', '', 0.0, 1.0)
    tilted: float = param(0.2, 'field: share of samples in any rotation, not a resting one', '',
                          0.0, 1.0)
    distrust: float = param(0.03, 'field: least weight of a scene point whatever the classifier '
                            'says', '', 0.0, 1.0)
    complexity: float = param(0.1, 'field: cost of a covered pixel in ranking', '', 0.0, 2.0)


def propose(observation, probabilities, models, config=ProposeConfig(), rng=None):
    """
    Return Candidates of every category, the best of each first.

    :param observation: Observation of one frame set.
    :param probabilities: PixelProbabilities of the same.
    :param models: tuple of GenericModel; class id c is models[c - 1].
    :param rng: numpy Generator of this stage.
    """
    if config.method == 'fragments':
        return propose_fragments(observation, probabilities, models, config, rng)
    space = workspace_of(observation, probabilities, models)
    if space.field is None:
        return Candidates.empty()
    extra = None
    if config.fragments:
        found = propose_fragments(observation, probabilities, models, config, rng)
        extra = hypotheses_of(found, models), found.category
    H, category = sample(space, models, config, rng, config.samples, config.pool,
                         config.refine_steps, extra=extra)
    return _ranked(space, models, config, rng, H, category, lambda evidence: evidence.nothing,
                   config.polish, config.polish_steps, config.per_category)


def propose_more(observation, probabilities, models, objects, config=ProposeConfig(), rng=None):
    """
    Return further Candidates for what `objects` (Candidates) leave unexplained.

    Only the `field` method has an answer; the paper proposes once.
    """
    space = workspace_of(observation, probabilities, models)
    if config.method == 'fragments' or space.field is None:
        return Candidates.empty()

    @cache
    def shown(evidence):
        _, lists = evidence.explain(hypotheses_of(objects, models), objects.category,
                                    PixelWeights(), lists=True)
        return evidence.compose(np.arange(len(objects)), lists)

    left = space.coarse.unexplained(shown(space.coarse))
    if not left.any():
        return Candidates.empty()
    H, category = sample(space, models, config, rng, config.round_samples, config.round_pool,
                         config.refine_steps, left + 0.02)
    return _ranked(space, models, config, rng, H, category, shown, config.round_per_category,
                   config.polish_steps, config.round_per_category)


def _ranked(space, models, config, rng, H, category, shown, n_polish, steps, n_keep):
    """
    Rank hypotheses in the images, refine the best there and return the best of those.

    :param shown: callable Evidence -> the context of what is there already.
    """
    weights, coarse = PixelWeights(), space.coarse
    stats = coarse.explain(H, category, weights, shown(coarse))
    score = benefit(stats, config.complexity)
    # Half of the places go to the field's own order: it knows what the images hide.
    rows = np.union1d(distinct(H, category, score, models, n_polish),
                      distinct(H, category, H[:, 10], models, n_polish // 2))
    H, category, covered = H[rows], category[rows], stats[rows, stat.SHOWN]
    # A few hundred pixels pin a thing down: large ones need no more, thin ones need them all.
    for evidence, low, high in ((space.evidence, 0, MANY), (coarse, MANY, 8 * MANY),
                                (space.coarsest, 8 * MANY, np.inf)):
        mine = np.flatnonzero((low <= covered) & (covered < high))
        if steps and len(mine):
            H[mine, :10] = evidence.polish(
                H[mine], category[mine], np.full(len(mine), -1), shown(evidence), weights,
                config.complexity, 0.1, steps, (0.006, 0.08, 0.05), rng)
    score = benefit(coarse.explain(H, category, weights, shown(coarse)), config.complexity)
    rows = distinct(H, category, score, models, n_keep)
    return candidates_of(H[rows], category[rows], score[rows], models)


def candidates_of(H, category, score, models):
    """Return Candidates from hypotheses (m, 10+), class ids and scores."""
    extents = np.array([models[c - 1].extents for c in category]).reshape(-1, 3)
    return Candidates(category.astype(np.uint16), H[:, :3].copy(),
                      Rotation.from_quat(H[:, 3:7]).as_quat() if len(H) else H[:, 3:7].copy(),
                      (H[:, 7:10] * extents).astype(np.float32), score.astype(np.float32))
