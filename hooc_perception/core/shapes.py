# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""All meshes of all categories, numbered through: what hypotheses are made of."""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float64Array, Int64Array, UInt16Array
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np


class Shapes:
    """
    The members of the families of some categories, one after the other.

    :ivar models: the S meshes.
    :ivar category: (S,) int64 class ids, 1..N; `member` (S,) uint16 their places in the families.
    :ivar extents: (S, 3) float64 sides of their bounding boxes, metres.
    :ivar family: (S,) int64 number of members of its family.
    """

    def __init__(self, models: Sequence[GenericModel]) -> None:
        """Give each member of the families a number; class id c is models[c - 1]."""
        count = np.array([len(m.members) for m in models], np.int64)
        self.models: tuple[GenericModel, ...] = tuple(s for m in models for s in m.members)
        self.category: Int64Array = np.repeat(np.arange(1, len(models) + 1), count)
        self.member: UInt16Array = np.concatenate(
            [np.arange(n, dtype=np.uint16) for n in count] or [np.zeros(0, np.uint16)])
        self.extents: Float64Array = np.array([s.extents for s in self.models],
                                              np.float64).reshape(-1, 3)
        self.family: Int64Array = np.repeat(count, count)
        self._first: Int64Array = np.cumsum(count) - count

    def __len__(self) -> int:
        """Return the number of meshes."""
        return len(self.models)

    def of(self, objects: Candidates) -> Int64Array:
        """Return (n,) the number of each candidate's mesh."""
        return self._first[objects.category.astype(np.int64) - 1] + objects.member
