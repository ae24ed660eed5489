# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Split the fused cloud into smooth patches."""

from hooc_perception.core.arrays import Int32Array
from hooc_perception.core.frame.field import Cloud
from hooc_perception.core.frame.kernels.patches import smooth_labels
import numpy as np


def smooth_patches(cloud: Cloud, radius_m: float = 0.009, smooth_cos: float = 0.94,
                   step_m: float = 0.006) -> Int32Array:
    """
    Return (n,) int32 labels: points joined where neighbouring normals agree.

    :param radius_m: neighbours are at most this far apart.
    :param smooth_cos: least cosine of the angle between the normals of neighbours.
    :param step_m: neighbours may lie this far off each other's tangent planes, summed.
    """
    if len(cloud.points) < 2:
        return np.zeros(len(cloud.points), np.int32)
    return smooth_labels(np.ascontiguousarray(cloud.points, np.float64),
                         np.ascontiguousarray(cloud.normals, np.float64), radius_m, smooth_cos,
                         step_m)
