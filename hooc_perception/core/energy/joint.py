# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The energy of the `best` profile: what a set of objects leaves unexplained, in pixels.

    E(S) = sum_i c_i(S) + sum_k [base_cost + A_k (complexity + size_prior |log scale_k|^2)]
           + overlap sum_k v_k

c_i is the cost of the object that is nearest at pixel i (kernels/explain.py: depth, normal,
category, free space), 1 for a foreground pixel that nothing explains; A_k the pixels that object
k covers; v_k the share of its volume inside others.
"""

from hooc_perception.core.energy.compositor import Compositor
from hooc_perception.core.energy.images_and_volumes import ImagesAndVolumes
from hooc_perception.core.energy.overlap import OverlapTerm
from hooc_perception.core.frame.kernels import compare as stat
import numpy as np


class JointEnergy(ImagesAndVolumes):
    """
    The joint energy over a pool; see core/energy/compositor.py for what a search calls.

    :param stats: (n, STATS) of the pool, `lists` its PixelLists.
    :param judged: (n,) what each object costs, in pixels, instead of base_cost.
    """

    def __init__(self, evidence, pool, stats, lists, models, config, max_instances=0,
                 judged=None):
        """Lay the pool's pixel lists into a Compositor and compare its volumes."""
        self.n = len(pool)
        prior = np.zeros(self.n)
        if self.n:
            extents = np.array([models[c - 1].extents for c in pool.category])
            prior = (np.log(pool.size / np.maximum(extents, 1e-9)) ** 2).sum(1)
        scale = evidence.scale
        base = config.base_cost if judged is None else judged
        unary = base * scale + stats[:, stat.SHOWN] * (config.complexity
                                                       + config.size_prior * prior)
        self._images = Compositor(lists.offsets, lists.pixel, lists.depth, lists.cost,
                                  evidence.cost_none.astype(np.float64), unary=unary,
                                  group=pool.category, max_per_group=max_instances)
        # A volume need not be known better than the pixels.
        self._overlap = OverlapTerm(pool, models, 256 if scale == 1 else 128)
        self._weight = config.overlap * scale

    @property
    def value(self):
        """Return the energy of the current subset, in pixels."""
        return self._images.value + self._weight * self._overlap.value

    def deltas(self):
        """Return (n,) float64: the change by each flip, inf where it is not allowed."""
        return self._images.deltas() + self._weight * self._overlap.deltas()

    def joining_costs(self):
        """Return (n,) float64: what each would cost if it joined, whatever the group's limit."""
        return (self._images.deltas(limited=False)
                + self._weight * self._overlap.deltas())

    def evaluate(self, mask):
        """Return the energy of the subset `mask` (n,) bool; the current one stays."""
        return self._images.evaluate(mask) + self._weight * self._overlap.evaluate(mask)
