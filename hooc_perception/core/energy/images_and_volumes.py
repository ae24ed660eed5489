# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the energies that look at images and at volumes have in common."""


class ImagesAndVolumes:
    """
    The subset of an energy that is a sum over a Compositor and an OverlapTerm.

    Sub-classes set `_images` and `_overlap` and say how the two are weighed.
    """

    @property
    def mask(self):
        """Return a copy of the current subset, (n,) bool."""
        return self._images.mask

    def flip(self, k):
        """Let candidate k join the subset, or leave it if it is in."""
        self._images.flip(k)
        self._overlap.flip(k)

    def reset(self, mask):
        """Start again from the subset `mask` (n,) bool."""
        self._images.reset(mask)
        self._overlap.reset(mask)
