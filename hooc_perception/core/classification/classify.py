# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 2: class probabilities of foreground pixels.

A classifier holds one of two kinds of forests: the paper's, one per view and bound to its rig,
or one forest over fused features for any rig (docs/classifier.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from hooc_perception.core.arrays import AnyArray, Int64Array
from hooc_perception.core.classification import features, table_network
from hooc_perception.core.classification.features import Pixels
from hooc_perception.core.classification.forest import DAMAGED, Forest, quantised
from hooc_perception.core.classification.kernels import smoothing
from hooc_perception.core.classification.pixel_forest import centres, depth_stack, PixelForest
from hooc_perception.core.config import Config, param
from hooc_perception.core.types import Observation, PixelProbabilities
from hooc_perception.errors import HoocError
import numpy as np

KIND_PAPER, KIND_FUSED = 0, 1
FORMAT_VERSION = 1


@dataclass(frozen=True)
class ClassifyConfig(Config):
    """Parameters of stage 2; those of training are stored with the classifier."""

    stride: int = param(2, 'The fused forest classifies every n-th pixel in both directions; the '
                        'pixels in between copy neighbours at the same depth.', 'px', 1, 8)
    smoothing_steps: int = param(12, 'Number of steps by which probabilities are smoothed over '
                                 "the surface graph of all views; 0 = none. The paper's forest "
                                 'is never smoothed.', '', 0, 200)
    smoothing_angle_rad: float = param(0.8, 'A concave edge of this angle between two surface '
                                       'points reduces smoothing across it to 1/e.', 'rad',
                                       0.01, 3.0)


def classify(observation: Observation, classifier: Mapping[str, AnyArray],
             config: ClassifyConfig = ClassifyConfig()) -> PixelProbabilities:
    """
    Return the PixelProbabilities of every foreground pixel of an Observation.

    :param classifier: arrays by name, as `hooc train` stores them.
    :raises HoocError: if the classifier is damaged or foreign, or if the paper's classifier was
        trained for another number of views.
    """
    kind, n_columns = _header(classifier)
    rows = [np.nonzero(v.foreground & np.isfinite(v.depth)) for v in observation.views]
    if not sum(len(r) for r, _ in rows):
        return PixelProbabilities(np.zeros(0, np.uint8), np.zeros((0, 2), np.uint16),
                                  np.zeros((0, n_columns), np.uint8))
    pixels = features.foreground_pixels(observation)
    stage = _paper if kind == KIND_PAPER else _fused
    p, row = stage(observation, pixels, classifier, config)
    if p.shape[1] != n_columns:
        raise HoocError(f'the classifier knows {p.shape[1] - 1} classes but says '
                        f'{n_columns - 1}; train the model again')
    return PixelProbabilities(pixels.camera, pixels.uv, quantised(p)[row])


def _header(classifier: Mapping[str, AnyArray]) -> tuple[int, int]:
    """Return (kind, number of probability columns) of a classifier; raise HoocError."""
    try:
        kind, version = int(classifier['kind']), int(classifier['version'])
        n_columns = int(classifier['classes']) + 1
        if kind == KIND_PAPER:
            int(classifier['views'])
    except (KeyError, TypeError, ValueError, OverflowError) as e:
        raise HoocError(f'the classifier is not one of ours ({e}); train the model again')
    if version != FORMAT_VERSION or kind not in (KIND_PAPER, KIND_FUSED):
        raise HoocError(f'the classifier has format {version}, kind {kind}; this program reads '
                        f'format {FORMAT_VERSION}; train the model again')
    return kind, n_columns


def _paper(observation: Observation, pixels: Pixels, classifier: Mapping[str, AnyArray],
           config: ClassifyConfig) -> tuple[AnyArray, Int64Array]:
    """Return (n, C) probabilities by the forest of each pixel's own view, and arange(n)."""
    views = observation.views
    trained = int(classifier['views'])
    if len(views) != trained:
        raise HoocError(f'this classifier was trained for {trained} views, but there are '
                        f'{len(views)}; train again for this rig, or use the best profile')
    images = depth_stack(views)
    parts = []
    for index in range(trained):
        forest = PixelForest.from_arrays(classifier, f'view{index}_', trained)
        points = pixels.points[pixels.camera == index]
        parts.append(forest.predict(images, centres(points, views)))
    return np.concatenate(parts), np.arange(len(pixels.camera))


def _fused(observation: Observation, pixels: Pixels, classifier: Mapping[str, AnyArray],
           config: ClassifyConfig) -> tuple[AnyArray, AnyArray]:
    """Return (k, C) probabilities by the fused forest, and the row (n,) of each pixel in them."""
    forest = Forest.from_arrays(classifier, 'forest_')
    probes = np.ascontiguousarray(classifier['probes'], np.float64)
    network = table_network.from_arrays(classifier)
    if probes.ndim != 2 or probes.shape[1] != 5 or (
            forest.feature.max(initial=-1) >= features.feature_count(len(probes), network)):
        raise HoocError(DAMAGED)
    around = features.surroundings(observation, pixels, table=network is not None)
    rows, donor = smoothing.thin(pixels.camera, pixels.uv, pixels.points, config.stride)
    p = forest.predict(features.pixel_features(pixels, around, probes, rows, network))
    if config.smoothing_steps:
        p = smoothing.spread(
            p, around.voxel[rows], len(around.voxel_points), around.pairs,
            np.exp(-(around.weight / config.smoothing_angle_rad) ** 2), config.smoothing_steps)
        return p, around.voxel
    return p, donor
