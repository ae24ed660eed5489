# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 2: class probabilities of foreground pixels.

The classifier's arrays say which of two forests it holds: the paper's, one a view and bound
to its rig, or one forest over fused features for any rig (docs/classifier.md).
"""

from dataclasses import dataclass

from hooc_perception.core.classification import features
from hooc_perception.core.classification.forest import Forest, quantised
from hooc_perception.core.classification.kernels import smoothing as forest_smooth
from hooc_perception.core.classification.pixel_forest import centres, depth_stack, PixelForest
from hooc_perception.core.config import Config, param
from hooc_perception.core.types import PixelProbabilities
from hooc_perception.errors import HoocError
import numpy as np

KIND_PAPER, KIND_FUSED = 0, 1
FORMAT_VERSION = 1


@dataclass(frozen=True)
class ClassifyConfig(Config):
    """Parameters of stage 2; those of training are stored with the classifier."""

    stride: int = param(2, 'The fused forest reads every n-th pixel in both directions; pixels '
                        'between take the probabilities of neighbours at their depth.', 'px', 1, 8)
    smoothing_steps: int = param(12, 'Steps by which probabilities spread over the surface '
                                 "graph, over all views; 0 = none. Never used by the paper's "
                                 'forest.', '', 0, 200)
    smoothing_angle_rad: float = param(0.8, 'A valley of about this angle between two surface '
                                       'points cuts the spread to 1/e.', 'rad', 0.01, 3.0)


def classify(observation, classifier, config=ClassifyConfig()):
    """
    Return the PixelProbabilities of every foreground pixel of an Observation.

    :param classifier: dict of arrays as `hooc train` leaves it.
    :raises HoocError: a damaged or foreign classifier, or, for the paper's, another number of
        views than it was trained for.
    """
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


def _paper(observation, pixels, classifier, config):
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


def _fused(observation, pixels, classifier, config):
    """Return (k, C) probabilities by the one forest, and the row (n,) that is each pixel's."""
    forest = Forest.from_arrays(classifier, 'forest_')
    probes = np.ascontiguousarray(classifier['probes'], np.float64)
    if probes.ndim != 2 or probes.shape[1] != 5 or (
            forest.feature.max(initial=-1) >= features.feature_count(len(probes))):
        raise HoocError('the classifier holds a damaged forest; train the model again')
    around = features.surroundings(observation, pixels)
    rows, donor = forest_smooth.thin(pixels.camera, pixels.uv, pixels.points, config.stride)
    p = forest.predict(features.pixel_features(pixels, around, probes, rows))
    if config.smoothing_steps:
        p = forest_smooth.spread(
            p, around.voxel[rows], len(around.voxel_points), around.pairs,
            np.exp(-(around.weight / config.smoothing_angle_rad) ** 2), config.smoothing_steps)
        return p, around.voxel
    return p, donor
