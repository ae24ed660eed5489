# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Setting B of the paper: the true poses are added to the candidates."""

from collections.abc import Callable, Iterable, Sequence

from hooc_perception.core.types import Candidates, GenericModel
from hooc_perception.evaluation.matching import posed
from hooc_perception.evaluation.stages import as_candidates
from hooc_perception.io.scenes.scene_set import TrueObject
import numpy as np


def with_true_poses(truth: Iterable[TrueObject], models: Sequence[GenericModel],
                    ) -> Callable[[Candidates], Candidates]:
    """
    Return a callable Candidates -> Candidates that adds the true poses to a pool.

    The true pose replaces the worst candidate of its category (section 6 of the paper); a
    category without candidates gains one. The generic model takes the true object's size.
    """
    true = as_candidates([posed(t) for t in truth], models)

    def change(pool: Candidates) -> Candidates:
        out = np.zeros(len(pool), bool)
        for c in true.category:
            mine = np.flatnonzero((pool.category == c) & ~out)
            if len(mine):
                out[mine[np.argmin(pool.score[mine])]] = True
        return pool.take(~out).extended(true)

    return change
