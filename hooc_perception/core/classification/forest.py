# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A decision forest as plain arrays: what a MODEL folder stores and inference reads."""

from dataclasses import dataclass, fields

from hooc_perception.core.classification.kernels import walk as forest_walk
from hooc_perception.errors import HoocError
import numpy as np


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

    feature: np.ndarray
    threshold: np.ndarray
    left: np.ndarray
    roots: np.ndarray
    leaf: np.ndarray
    leaf_p: np.ndarray

    def leaves(self, x):
        """Return (n, T) int32: the node in which each row of x (n, F) float32 ends."""
        x = np.ascontiguousarray(x, np.float32)
        out = np.empty((len(self.roots), len(x)), np.int32)
        for t, root in enumerate(self.roots):
            forest_walk.walk_tree(x, self.feature, self.threshold, self.left, root, out[t])
        return out.T

    def predict(self, x):
        """Return (n, C) float32 class probabilities of feature rows x (n, F) float32."""
        return forest_walk.predict(np.ascontiguousarray(x, np.float32), self.feature,
                                   self.threshold, self.left, self.roots, self.leaf, self.leaf_p)

    def arrays(self, prefix=''):
        """Return the arrays as a dict whose keys start with `prefix`."""
        return {prefix + f.name: getattr(self, f.name) for f in fields(self)}

    @staticmethod
    def from_arrays(arrays, prefix=''):
        """
        Return the Forest stored under `prefix` in a dict of arrays.

        :raises HoocError: where arrays are missing or point outside of one another, so that
            a damaged model can never read foreign memory.
        """
        try:
            forest = Forest(*(np.ascontiguousarray(arrays[prefix + f.name], dtype)
                              for f, dtype in zip(fields(Forest), (
                                  np.int32, np.float32, np.int32, np.int32, np.int32, np.uint8))))
        except KeyError as missing:
            raise HoocError(f'the classifier has no array {missing}; train the model again')
        except (ValueError, TypeError):
            raise HoocError('the classifier holds texts for numbers; train the model again')
        n = forest.feature.size
        rows = forest.feature, forest.threshold, forest.left, forest.leaf
        if any(row.shape != (n,) for row in rows) or forest.roots.ndim != 1:
            raise HoocError('the classifier holds a damaged forest; train the model again')
        inner = forest.feature >= 0
        children = forest.left[inner]
        ok = (forest.leaf_p.ndim == 2 and len(forest.roots) > 0
              and _within(forest.roots, n) and _within(forest.leaf[~inner], len(forest.leaf_p))
              and (children > np.nonzero(inner)[0]).all() and _within(children + 1, n))
        if not ok:
            raise HoocError('the classifier holds a damaged forest; train the model again')
        return forest


def _within(index, size):
    """Return whether every entry of an integer array lies in [0, size)."""
    return bool(((index >= 0) & (index < size)).all())


def quantised(p):
    """Return uint8 rows of probabilities (n, C) x 255, rounded so that each row sums to 255."""
    scaled = np.asarray(p, np.float64) * 255 / np.maximum(np.sum(p, 1, keepdims=True), 1e-12)
    low = np.floor(scaled)
    short = (255 - low.sum(1)).round().astype(int)
    rank = np.argsort(np.argsort(low - scaled, axis=1, kind='stable'), axis=1, kind='stable')
    return (low + (rank < short[:, None])).astype(np.uint8)
