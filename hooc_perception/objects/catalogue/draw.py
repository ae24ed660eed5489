# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Random proportions of the members of a shape family."""

from typing import TypeVar

import numpy as np

# Draws beyond this many standard deviations are clipped: no outliers.
CLIP = 2.0
_T = TypeVar('_T')


class Draw:
    """
    The proportions of one member of a family.

    :param rng: None gives the nominal proportions.
    """

    def __init__(self, rng: np.random.Generator | None = None) -> None:
        self._rng = rng

    def about(self, value: float, spread: float = 0.15) -> float:
        """Return a positive value whose logarithm has the standard deviation `spread`."""
        if self._rng is None:
            return value
        return float(value * np.exp(spread * np.clip(self._rng.standard_normal(), -CLIP, CLIP)))

    def between(self, low: float, high: float) -> float:
        """Return a value between two bounds; nominal = the middle."""
        return 0.5 * (low + high) if self._rng is None else float(self._rng.uniform(low, high))

    def chance(self, p: float) -> bool:
        """Return whether something with probability `p` is the case."""
        return p >= 0.5 if self._rng is None else bool(self._rng.random() < p)

    def pick(self, *options: _T) -> _T:
        """Return one of the options; nominal = the first."""
        return options[0 if self._rng is None else int(self._rng.integers(len(options)))]
