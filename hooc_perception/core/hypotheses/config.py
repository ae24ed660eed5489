# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of joint proposing."""

from dataclasses import dataclass

from hooc_perception.core.config import Config, param


@dataclass(frozen=True)
class ProposeConfig(Config):
    """Parameters of stage 3 of the joint method."""

    samples: int = param(10000, 'Poses drawn per category where much stands on the table (twenty '
                         'objects); where there is less foreground fewer, down to half.', low=100)
    pool: int = param(120, 'Hypotheses per category that are refined in the voxel field.', low=5)
    refine_steps: int = param(20, 'Refinement steps in the voxel field.', low=0)
    polish: int = param(15, 'Hypotheses per category that are refined in the images.', low=1)
    polish_steps: int = param(10, 'Refinement steps in the images.', low=0)
    per_category: int = param(15, 'Candidates per category.', low=1)
    round_samples: int = param(4000, 'Poses drawn per category in a round of re-proposal, where a '
                               'third of the foreground is unexplained.', low=10)
    least_effort: float = param(
        0.3, 'Where less is unexplained, fewer candidates are drawn and refined in a round, but '
        'at least this share.', '', 0.01, 1.0)
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
