# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Fitting of decision forests to feature tables.

Features are quantised once to at most 64 levels at their quantiles; trees grow by
information gain over a random subset of features per node. scikit-learn's random forest is the
reference in the tests; it is ten times slower with this many classes and features.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import cast, TypeAlias

from hooc_perception.core.arrays import AnyArray, Float32Array, Int8Array, UInt8Array
from hooc_perception.core.classification.forest import Forest, quantised
from hooc_perception.core.config import Config, param
from hooc_perception.synthesis.population import FOLDS
from hooc_perception.training.kernels import table_tree
from hooc_perception.training.kernels.splits import Limits
from hooc_perception.training.kernels.table_tree import Table
from joblib import delayed, Parallel
import numpy as np

# Of one tree: feature, threshold, left of its nodes, and leaf_p of its leaves, see Forest.
Tree: TypeAlias = tuple[AnyArray, Float32Array, AnyArray, UInt8Array]


@dataclass(frozen=True)
class FitConfig(Config):
    """Parameters of forest growth."""

    trees: int = param(40, 'Trees in the forest.', '', 1, 1000)
    features_per_node: int = param(80, 'Features drawn at random at each node.', '', 1, 10000)
    node_samples: int = param(6000, 'Most samples that rank the features of a node; all samples '
                              'are then split.', '', 10, 100000000)
    max_depth: int = param(26, 'Deepest split.', '', 1, 60)
    min_leaf: int = param(10, 'Fewest training samples in a leaf.', '', 1, 10000)
    min_gain_bits: float = param(0.005, 'Least information gain of a split.', 'bit', 0.0, 1.0)
    bins: int = param(64, 'Quantisation levels of a feature.', '', 2, 255)
    prior: float = param(0.3, 'Samples added to every leaf with the class distribution of the '
                         'whole training set, so that no class is ever impossible.', '', 0.0, 100)
    sample_share: float = param(0.6, 'Share of the samples, without replacement, that grows a '
                                'tree; all samples fill its leaves.', '', 0.01, 1.0)


def thresholds(x: Float32Array, bins: int, rng: np.random.Generator) -> Float32Array:
    """
    Return (F, bins - 1) float32 ascending split values at the quantiles of x (n, F).

    Estimated from at most 20000 rows; repeated values leave trailing +inf.
    """
    rows = np.sort(rng.choice(len(x), min(len(x), 20000), replace=False))
    q = np.quantile(x[rows], np.linspace(0, 1, bins + 1)[1:-1], axis=0).astype(np.float32)
    out = np.full((x.shape[1], bins - 1), np.inf, np.float32)
    for f in range(x.shape[1]):
        values = np.unique(q[:, f])
        out[f, :len(values)] = values
    return out


def quantise(x: Float32Array, cuts: Float32Array) -> UInt8Array:
    """Return (F, n) uint8: the number of cuts (F, B) that are < each value of x (n, F)."""
    out = np.empty((x.shape[1], len(x)), np.uint8)
    for f in range(x.shape[1]):
        out[f] = np.searchsorted(cuts[f], x[:, f], side='left')
    return out


def fit(binned: UInt8Array, y: UInt8Array, n_classes: int, cuts: Float32Array,
        config: FitConfig, rng: np.random.Generator, n_jobs: int = 1,
        progress: Callable[[int], object] | None = None,
        fold: Int8Array | None = None) -> Forest:
    """
    Return a Forest fitted to quantised features.

    :param binned: (F, n) uint8 from `quantise`; y (n,) uint8 classes.
    :param cuts: (F, B) float32 split values; bin b means value <= cuts[b].
    :param rng: the same generator state gives the same forest for any `n_jobs`.
    :param progress: called with 1 after every tree.
    :param fold: (n,) int8; tree t never sees the samples of fold t % FOLDS. None = all see all.
    """
    n = len(y)
    prior = np.bincount(y, minlength=n_classes) / n
    seeds = rng.integers(1 << 31, size=(config.trees, 2))
    table = Table(binned, y, n_classes, config.bins)
    limits = Limits(config.node_samples, config.max_depth, config.min_leaf,
                    config.min_gain_bits)

    def one(tree: int, order_seed: int, node_seed: int) -> Tree:
        seen = np.ones(n, bool) if fold is None else fold != tree % FOLDS
        order = np.random.default_rng(order_seed).permutation(n)
        order = order[seen[order]]
        order = order[:max(1, round(config.sample_share * len(order)))].astype(np.int32)
        feature, split, left = table_tree.grow_tree(
            table, np.sort(order), config.features_per_node, limits, int(node_seed))
        end = table_tree.walk_binned(binned, feature, split, left)
        threshold = np.zeros(len(feature), np.float32)
        inner = feature >= 0
        threshold[inner] = cuts[feature[inner], split[inner]]
        counts = np.bincount((end * n_classes + y)[seen], minlength=len(feature) * n_classes)
        counts = counts.reshape(-1, n_classes)[~inner] + config.prior * prior
        if progress:
            progress(1)
        return feature, threshold, left, quantised(counts)

    trees = Parallel(n_jobs=n_jobs, require='sharedmem')(delayed(one)(t, *s)
                                                         for t, s in enumerate(seeds))
    return joined(cast(list[Tree], trees))


def unaware_of(arrays: Mapping[str, AnyArray], fold: int, prefix: str) -> dict[str, AnyArray]:
    """Return a forest's arrays with only the trees that have not seen the samples of a fold."""
    return {**arrays, prefix + 'roots': arrays[prefix + 'roots'][fold::FOLDS]}


def joined(trees: Sequence[Tree]) -> Forest:
    """Return the Forest of (feature, threshold, left, leaf_p) trees, leaves in node order."""
    nodes = np.cumsum([0, *(len(t[0]) for t in trees)])
    feature = np.concatenate([t[0] for t in trees])
    left = np.concatenate([t[2] + start for t, start in zip(trees, nodes)])
    leaf = np.where(feature < 0, np.cumsum(feature < 0) - 1, 0)
    return Forest(feature.astype(np.int32), np.concatenate([t[1] for t in trees]),
                  left.astype(np.int32), nodes[:-1].astype(np.int32), leaf.astype(np.int32),
                  np.concatenate([t[3] for t in trees]))
