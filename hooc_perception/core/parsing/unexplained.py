# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Measured points above the support plane that no object explains."""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import back_project, posed_meshes
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Candidates, GenericModel, Observation
import numpy as np


def unexplained_points(observation: Observation, objects: Candidates,
                       models: Sequence[GenericModel], tolerance_m: float = 0.02) -> Float64Array:
    """
    Return (n, 3) float64 world points of the foreground that the objects do not explain.

    A pixel is explained where the composed depth of all objects lies within `tolerance_m` of
    the measured one.

    :param objects: Candidates.
    :param models: tuple of GenericModel; class id c is models[c - 1].
    """
    meshes = posed_meshes(objects, models)
    left = []
    for view in observation.views:
        composed, _ = render_depth(meshes, view.camera)
        open_pixels = view.foreground & ~(np.abs(composed - view.depth) <= tolerance_m)
        left.append(back_project(view.depth, view.camera)[open_pixels])
    return np.concatenate(left) if left else np.zeros((0, 3))
