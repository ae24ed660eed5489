# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The energy of the joint method: what a set of objects leaves unexplained, in pixels.

    E(S) = sum_i c_i(S) + sum_k [base_cost + A_k (complexity + size_prior |log scale_k|^2)]
           + overlap sum_k v_k

c_i is the cost of the object that is nearest at pixel i (frame/kernels/compare.py: depth, normal,
category, free space), 1 for a foreground pixel that nothing explains; A_k the pixels that object
k covers; v_k the share of its volume inside others.
"""

from collections.abc import Sequence

from hooc_perception.core.arrays import BoolArray, Float64Array, Int64Array
from hooc_perception.core.energy.compositor import Compositor
from hooc_perception.core.energy.images_and_volumes import ImagesAndVolumes
from hooc_perception.core.energy.overlap import OverlapTerm
from hooc_perception.core.frame.costs import ObjectCosts
from hooc_perception.core.frame.evidence import Evidence
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.frame.kernels.pixel_lists import PixelLists
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np


class JointEnergy(ImagesAndVolumes):
    """
    The joint energy over a pool; see compositor.py for what a search calls.

    :param stats: (n, STATS) of the pool, `lists` its PixelLists.
    :param penalty: (n,) cost of each object, in pixels, instead of `base_cost`.
    """

    def __init__(self, evidence: Evidence, pool: Candidates, stats: Float64Array,
                 lists: PixelLists, models: Sequence[GenericModel], costs: ObjectCosts,
                 max_instances: int = 0, penalty: Float64Array | None = None) -> None:
        """Lay the pool's pixel lists into a Compositor and compare its volumes."""
        self.n = len(pool)
        prior = np.zeros(self.n)
        if self.n:
            extents = np.array([shape.extents for shape in pool.shapes(models)])
            prior = (np.log(pool.size / np.maximum(extents, 1e-9)) ** 2).sum(1)
        self._costs, self._scale = costs, evidence.scale
        self._area_cost = stats[:, stat.SHOWN] * (costs.complexity + costs.size_prior * prior)
        # A volume need not be known better than the pixels.
        overlap = OverlapTerm(pool, models, 256 if evidence.scale == 1 else 128)
        super().__init__(
            Compositor(lists.offsets, lists.pixel, lists.depth, lists.cost,
                       evidence.cost_none.astype(np.float64), unary=self._unary(penalty),
                       group=pool.category, max_per_group=max_instances), overlap)
        self._weight = costs.overlap * self._scale

    def _unary(self, penalty: Float64Array | None) -> Float64Array:
        """Return (n,) what each candidate costs by itself."""
        base = self._costs.base_cost if penalty is None else penalty
        return base * self._scale + self._area_cost

    def reprice(self, penalty: Float64Array | None) -> None:
        """Replace the cost (n,) of each object, as in the constructor; the subset stays."""
        self._images.reprice(self._unary(penalty))

    @property
    def value(self) -> float:
        """Return the energy of the current subset, in pixels."""
        return self._images.value + self._weight * self._overlap.value

    def deltas(self) -> Float64Array:
        """Return (n,) float64: the change by each flip, inf where it is not allowed."""
        return self._images.deltas() + self._weight * self._overlap.deltas()

    def deltas_without(self, members: Int64Array) -> Float64Array:
        """Return (m, n) float64: the change by adding each outsider once a member has left."""
        return (self._images.deltas_without(members)
                + self._weight * self._overlap.deltas_without(members))

    def joining_costs(self) -> Float64Array:
        """Return (n,) float64: the cost of adding each candidate, whatever the group's limit."""
        return (self._images.deltas(limited=False)
                + self._weight * self._overlap.deltas())

    def evaluate(self, mask: BoolArray) -> float:
        """Return the energy of the subset `mask` (n,) bool; the current one stays."""
        return self._images.evaluate(mask) + self._weight * self._overlap.evaluate(mask)
