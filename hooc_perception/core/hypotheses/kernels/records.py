# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Groups of arrays and numbers that the kernels of this stage take as one argument."""

from typing import NamedTuple

from hooc_perception.core.arrays import Float64Array


class ModelTables(NamedTuple):
    """
    What hypotheses are drawn and scored with, for the N meshes of a Shapes.

    :ivar points: (N, P, 3) float64 surface points, model frame; `normals` likewise, unit.
    :ivar rest: (N, R, 4) float64 resting rotations, quaternions xyzw, padded.
    :ivar rest_cdf: (N, R) float64 their cumulative weights.
    """

    points: Float64Array
    normals: Float64Array
    rest: Float64Array
    rest_cdf: Float64Array


class Surface(NamedTuple):
    """Points (n, 3) float64, metres, and their unit normals (n, 3) float64."""

    points: Float64Array
    normals: Float64Array


class ScoreWeights(NamedTuple):
    """
    Weights of the score in the field.

    :ivar free: of a point in space that some view sees through.
    :ivar shell: of a point without free space in front.
    :ivar size_prior: of the squared log scale.
    """

    free: float
    shell: float
    size_prior: float


class DrawSettings(NamedTuple):
    """
    How hypotheses are drawn.

    :ivar samples: hypotheses drawn per mesh; `keep` of them are returned at most.
    :ivar size_sigma: standard deviation of the log scale.
    :ivar tilted: share of hypotheses in any rotation instead of a resting one.
    :ivar first_points: model points of the quick test; `points` of the score.
    """

    samples: int
    keep: int
    size_sigma: float
    tilted: float
    first_points: int
    points: int


class FieldRefineSettings(NamedTuple):
    """
    How hypotheses are refined in the field.

    :ivar points: model points that the score looks at.
    :ivar steps: trials per hypothesis.
    :ivar translation: initial size of random steps, metres; `rotation` radians, `log_scale`.
    """

    points: int
    steps: int
    translation: float
    rotation: float
    log_scale: float
