# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The common part of the energies that look at images and at volumes."""

from hooc_perception.core.arrays import BoolArray
from hooc_perception.core.energy.compositor import Compositor
from hooc_perception.core.energy.overlap import OverlapTerm


class ImagesAndVolumes:
    """
    The current subset of an energy that is a sum over a Compositor and an OverlapTerm.

    Sub-classes say how the two are weighed.
    """

    def __init__(self, images: Compositor, overlap: OverlapTerm) -> None:
        self._images, self._overlap = images, overlap

    @property
    def mask(self) -> BoolArray:
        """Return a copy of the current subset, (n,) bool."""
        return self._images.mask

    def flip(self, k: int) -> None:
        """Add candidate k to the subset, or remove it."""
        self._images.flip(k)
        self._overlap.flip(k)

    def reset(self, mask: BoolArray) -> None:
        """Start again from the subset `mask` (n,) bool."""
        self._images.reset(mask)
        self._overlap.reset(mask)
