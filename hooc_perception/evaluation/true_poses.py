# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Setting B of the paper: the true poses are put among the candidates."""

from hooc_perception.evaluation.matching import posed
from hooc_perception.evaluation.stages import as_candidates
import numpy as np


def with_true_poses(truth, models):
    """
    Return a callable Candidates -> Candidates that puts the true poses into a pool.

    The worst candidate of each true category makes room for its true pose (section 6 of the
    paper); a category without candidates simply gains one. The generic model takes the true
    object's size.

    :param truth: sequence of TrueObject.
    """
    true = as_candidates([posed(t) for t in truth], models)

    def change(pool):
        out = np.zeros(len(pool), bool)
        for c in true.category:
            mine = np.flatnonzero((pool.category == c) & ~out)
            if len(mine):
                out[mine[np.argmin(pool.score[mine])]] = True
        return pool.take(~out).extended(true)

    return change
