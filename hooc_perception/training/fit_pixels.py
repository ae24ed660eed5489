# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Fitting of the paper's multi-view forests, one per view.

Basevi & Leonardis 2016, section 4, after Brachmann et al. 2014. One pool of scenes learns the
structure, another fills the leaves. What the paper leaves open is a named parameter here.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import cast, TypeAlias

from hooc_perception.core.arrays import (
    AnyArray,
    Float32Array,
    Int32Array,
    UInt8Array,
    UInt16Array,
)
from hooc_perception.core.classification import pixel_forest
from hooc_perception.core.classification.forest import Forest, quantised
from hooc_perception.core.classification.kernels.pixel_forest import (
    DepthTests,
    Samples,
    walk_pixels,
)
from hooc_perception.core.classification.kernels.walk import Nodes
from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.profiles import profile
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import Observation
from hooc_perception.synthesis.training_scenes import TrainingScene
from hooc_perception.training.kernels.pixel_tree import DrawRules, grow_pixel_tree
from hooc_perception.training.kernels.splits import Limits
from joblib import delayed, Parallel
import numpy as np

# Of one tree: feature, threshold, left of its nodes, view and offsets of its tests, leaf_p.
PixelTree: TypeAlias = tuple[AnyArray, Float32Array, AnyArray, UInt8Array, Float32Array,
                             UInt8Array]


@dataclass(frozen=True)
class PixelFitConfig(Config):
    """Parameters of the paper's forests; (paper) = published, (open) = the paper does not say."""

    structure_scenes: int = param(500, 'Scenes that determine the tests of the trees (paper).',
                                  '', 1, 100000)
    leaf_scenes: int = param(500, 'Other scenes that fill the leaves (paper).', '', 1, 100000)
    trees: int = param(5, 'Trees per view (open); training time grows in proportion.', '', 1, 100)
    structure_pixels: int = param(300, 'Foreground pixels drawn per view of a structure scene '
                                  '(open); neighbouring pixels add little.', '', 1, 100000)
    leaf_pixels: int = param(1500, 'Foreground pixels drawn per view of a leaf scene (open).', '',
                             1, 100000)
    table_share: float = param(0.1, 'Pixels of the empty table added to these, as a share, to '
                               'represent the background class (open).', '', 0.0, 2.0)
    region_m: float = param(0.12, "Half the side of a bounding region at the point's depth "
                            '(open); most objects, seen from their middle, fit in.', 'm',
                            0.01, 1.0)
    centre_share: float = param(0.5, 'Share of tests against the centre instead of a second '
                                'offset (open).', '', 0.0, 1.0)
    tests_per_node: int = param(400, 'Random tests over all views per node (open).', '', 1, 10000)
    thresholds: int = param(24, 'Thresholds tried per test, drawn from its responses (open).', '',
                            1, 200)
    node_samples: int = param(3000, 'Most pixels that rank the tests of a node (open); all '
                              'pixels are then split.', '', 10, 10000000)
    max_depth: int = param(18, 'Deepest split (open).', '', 1, 40)
    min_leaf: int = param(12, 'Fewest structure pixels in a leaf (open).', '', 1, 10000)
    min_gain_bits: float = param(0.01, 'Least information gain of a split (open).', 'bit', 0.0,
                                 1.0)
    prior: float = param(1.0, 'Samples added to every leaf with the class distribution of the '
                         'whole pool (open).', '', 0.0, 100.0)


@dataclass
class PixelPool:
    """
    Pixels drawn from scenes, with the images that tests read.

    :ivar images: (S, V, H, W) uint16 mm.
    :ivar scene: per view, (n,) int32; `centre` per view, (n, V, 3) float32; `y` per view,
        (n,) uint8 classes.
    """

    images: UInt16Array
    scene: Sequence[Int32Array]
    centre: Sequence[Float32Array]
    y: Sequence[UInt8Array]

    def samples(self, view: int) -> Samples:
        """Return the pixels of one view as kernels take them."""
        return Samples(self.images, self.scene[view], self.centre[view])


def pool(scenes: Iterable[TrainingScene], n_scenes: int, n_pixels: int, config: PixelFitConfig,
         seed: int, stage: str) -> PixelPool:
    """
    Return the PixelPool of TrainingScenes.

    :param scenes: `n_scenes` scenes, at least one, that all share one rig.
    :param n_pixels: foreground pixels drawn from each view.
    """
    images, parts = np.zeros((0, 0, 0, 0), np.uint16), []
    for s, training in enumerate(scenes):
        observation = observe(training.views, profile('paper').observe)
        stack = pixel_forest.depth_stack(observation.views)
        if not s:
            images = np.zeros((n_scenes, *stack.shape), np.uint16)
        images[s] = stack
        parts.append([_draw(observation, training.labels[v], v, n_pixels, config,
                            stage_rng(seed, stage, s, v))
                      for v in range(len(observation.views))])
    columns = [[part[v] for part in parts] for v in range(len(parts[0]))]
    return PixelPool(
        images,
        [np.repeat(np.arange(len(c), dtype=np.int32), [len(y) for _, y in c]) for c in columns],
        [np.concatenate([centre for centre, _ in c]) for c in columns],
        [np.concatenate([y for _, y in c]) for c in columns])


def _draw(observation: Observation, labels: UInt8Array, index: int, n_pixels: int,
          config: PixelFitConfig, rng: np.random.Generator) -> tuple[Float32Array, UInt8Array]:
    """Return (centre (n, V, 3), y (n,)) of random pixels of one view."""
    view = observation.views[index]
    seen = np.isfinite(view.depth)
    front = np.flatnonzero(view.foreground & seen)
    table = np.flatnonzero(view.table & seen & ~view.foreground)
    take = rng.choice(front, min(n_pixels, len(front)), replace=False)
    extra = rng.choice(table, min(int(config.table_share * n_pixels), len(table)), replace=False)
    flat = np.sort(np.concatenate([take, extra])).astype(np.int64)
    rows, cols = np.divmod(flat, view.depth.shape[1])
    K, T = view.camera.K, view.camera.T_world_camera
    d = view.depth[rows, cols].astype(np.float64)
    local = np.column_stack([(cols - K[0, 2]) / K[0, 0] * d, (rows - K[1, 2]) / K[1, 1] * d, d])
    points = local @ T[:3, :3].T + T[:3, 3]
    return pixel_forest.centres(points, observation.views), labels[rows, cols]


def fit_view(structure: PixelPool, leaves: PixelPool, view: int, n_classes: int,
             config: PixelFitConfig, seed: int, n_jobs: int = 1,
             progress: Callable[[int], object] | None = None) -> pixel_forest.PixelForest:
    """
    Return the PixelForest of one view; the same seed gives the same forest for any `n_jobs`.

    :param structure: PixelPool that learns the tests; `leaves` the one that fills the leaves.
    :param progress: called with 1 after every tree.
    """
    y = structure.y[view]
    prior = np.bincount(leaves.y[view], minlength=n_classes) / max(1, len(leaves.y[view]))
    rules = DrawRules(config.tests_per_node, config.thresholds, config.region_m,
                      config.centre_share, pixel_forest.FAR_MM)
    limits = Limits(config.node_samples, config.max_depth, config.min_leaf, config.min_gain_bits)

    def one(tree: int) -> PixelTree:
        rng = stage_rng(seed, 'paper forest', view, tree)
        # A bootstrap: trees of one pool must differ by more than their random tests.
        samples = np.sort(rng.integers(0, len(y), len(y))).astype(np.int32)
        feature, threshold, left, test_view, offsets = grow_pixel_tree(
            structure.samples(view), y, samples, n_classes, rules, limits,
            int(rng.integers(1 << 31)))
        end = np.empty(len(leaves.y[view]), np.int32)
        walk_pixels(leaves.samples(view), DepthTests(test_view, offsets, pixel_forest.FAR_MM),
                    Nodes(feature, threshold, left), 0, end)
        counts = np.bincount(end.astype(np.int64) * n_classes + leaves.y[view],
                             minlength=len(feature) * n_classes).reshape(-1, n_classes)
        leaf_p = quantised(counts[feature < 0] + config.prior * prior)
        if progress:
            progress(1)
        return feature, threshold, left, test_view, offsets, leaf_p

    trees = Parallel(n_jobs=n_jobs, require='sharedmem')(delayed(one)(t)
                                                         for t in range(config.trees))
    return _joined(cast(list[PixelTree], trees))


def _joined(trees: Sequence[PixelTree]) -> pixel_forest.PixelForest:
    """Return one PixelForest of (feature, threshold, left, view, offsets, leaf_p) trees."""
    nodes = np.cumsum([0, *(len(t[0]) for t in trees)])
    tests = np.cumsum([0, *(len(t[3]) for t in trees)])
    feature = np.concatenate([np.where(t[0] >= 0, t[0] + k, -1) for t, k in zip(trees, tests)])
    leaf = np.where(feature < 0, np.cumsum(feature < 0) - 1, 0)
    forest = Forest(
        feature.astype(np.int32), np.concatenate([t[1] for t in trees]),
        np.concatenate([t[2] + k for t, k in zip(trees, nodes)]).astype(np.int32),
        nodes[:-1].astype(np.int32), leaf.astype(np.int32),
        np.concatenate([t[5] for t in trees]))
    return pixel_forest.PixelForest(forest, np.concatenate([t[3] for t in trees]),
                                    np.concatenate([t[4] for t in trees]))
