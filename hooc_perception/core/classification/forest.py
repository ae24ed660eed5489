# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A decision forest as plain arrays: what a MODEL folder stores and inference reads."""

from collections.abc import Mapping
from dataclasses import dataclass

from hooc_perception.core.arrays import (
    AnyArray,
    Float32Array,
    Int32Array,
    UInt8Array,
)
from hooc_perception.core.classification.kernels import walk
from hooc_perception.core.classification.kernels.walk import Leaves, Nodes
from hooc_perception.errors import HoocError
import numpy as np
from numpy.typing import ArrayLike

DAMAGED = 'the classifier holds a damaged forest; train the model again'


@dataclass(frozen=True)
class Forest:
    """
    Trees, one after the other in one node table.

    :ivar feature: (nodes,) int32 column that a node tests, -1 in a leaf.
    :ivar threshold: (nodes,) float32; a sample goes left where its value <= threshold.
    :ivar left: (nodes,) int32 left child, the right one is `left + 1`.
    :ivar roots: (T,) int32 first node of every tree.
    :ivar leaf: (nodes,) int32 row of `leaf_p` for leaves.
    :ivar leaf_p: (L, C) uint8 class distribution of a leaf, probability x 255.
    """

    feature: Int32Array
    threshold: Float32Array
    left: Int32Array
    roots: Int32Array
    leaf: Int32Array
    leaf_p: UInt8Array

    @property
    def nodes(self) -> Nodes:
        """Return the node table as kernels take it."""
        return Nodes(self.feature, self.threshold, self.left)

    @property
    def distributions(self) -> Leaves:
        """Return the class distributions of the leaves as kernels take them."""
        return Leaves(self.leaf, self.leaf_p)

    def leaves(self, x: AnyArray) -> Int32Array:
        """Return (n, T) int32: the node in which each row of x (n, F) float32 ends."""
        x = np.ascontiguousarray(x, np.float32)
        out = np.empty((len(self.roots), len(x)), np.int32)
        for t, root in enumerate(self.roots):
            walk.walk_tree(x, self.nodes, root, out[t])
        return out.T

    def predict(self, x: AnyArray) -> Float32Array:
        """Return (n, C) float32 class probabilities of feature rows x (n, F) float32."""
        return walk.predict(np.ascontiguousarray(x, np.float32), self.nodes, self.roots,
                            self.distributions)

    def arrays(self, prefix: str = '') -> dict[str, AnyArray]:
        """Return the arrays as a dict whose keys start with `prefix`."""
        return {prefix + 'feature': self.feature, prefix + 'threshold': self.threshold,
                prefix + 'left': self.left, prefix + 'roots': self.roots,
                prefix + 'leaf': self.leaf, prefix + 'leaf_p': self.leaf_p}

    @staticmethod
    def from_arrays(arrays: Mapping[str, AnyArray], prefix: str = '') -> 'Forest':
        """
        Return the Forest stored under `prefix` in a dict of arrays.

        :raises HoocError: if arrays are missing or point outside of one another, so that a
            damaged model can never read foreign memory.
        """
        try:
            forest = Forest(np.ascontiguousarray(arrays[prefix + 'feature'], np.int32),
                            np.ascontiguousarray(arrays[prefix + 'threshold'], np.float32),
                            np.ascontiguousarray(arrays[prefix + 'left'], np.int32),
                            np.ascontiguousarray(arrays[prefix + 'roots'], np.int32),
                            np.ascontiguousarray(arrays[prefix + 'leaf'], np.int32),
                            np.ascontiguousarray(arrays[prefix + 'leaf_p'], np.uint8))
        except KeyError as missing:
            raise HoocError(f'the classifier has no array {missing}; train the model again')
        except (ValueError, TypeError):
            raise HoocError('the classifier holds text instead of numbers; train the model again')
        if not forest._is_sound():
            raise HoocError(DAMAGED)
        return forest

    def _is_sound(self) -> bool:
        """Return whether no index of the arrays points outside of another one."""
        n = self.feature.size
        rows = self.feature, self.threshold, self.left, self.leaf
        if any(row.shape != (n,) for row in rows) or self.roots.ndim != 1:
            return False
        return (self.leaf_p.ndim == 2 and len(self.roots) > 0
                and walk.is_sound(self.nodes, self.roots, self.leaf, len(self.leaf_p)))


def quantised(p: ArrayLike) -> UInt8Array:
    """Return uint8 rows of probabilities (n, C) x 255, rounded so that each row sums to 255."""
    return walk.quantise_rows(np.ascontiguousarray(p, np.float64),
                              np.sum(p, 1).astype(np.float64))
