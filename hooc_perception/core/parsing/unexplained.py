# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Measured points above the support plane that no object explains, and why."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from hooc_perception.core.arrays import BoolArray, Float64Array, UInt8Array
from hooc_perception.core.geometry import back_project, posed_meshes
from hooc_perception.core.parsing.groups import cells_of, near_surfaces
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Candidates, GenericModel, Observation, UnknownObjects
import numpy as np
from scipy.spatial.transform import Rotation

# A pixel is explained where the composed depth of all objects is so near to the measured one.
TOLERANCE_M = 0.02
# How far beyond the box of a thing its readings may lie.
BOX_MARGIN_M = 0.01


class Reason(IntEnum):
    """Why a point belongs to no object."""

    NOISE = 0       # too little for a thing
    RESIDUE = 1     # beside the surface of an object, whose mesh is only similar to it
    UNKNOWN = 2     # part of a thing of no category that is reported


@dataclass(frozen=True)
class Unexplained:
    """
    Points that no object explains.

    :ivar points: (n, 3) float64 metres; `reason` (n,) uint8, a Reason each.
    """

    points: Float64Array
    reason: UInt8Array


def unexplained(observation: Observation, objects: Candidates, unknown: UnknownObjects,
                models: Sequence[GenericModel], tolerance_m: float = TOLERANCE_M) -> Unexplained:
    """
    Return the Unexplained points of the foreground.

    A pixel is explained where the composed depth of all objects lies within `tolerance_m` of
    the measured one.

    :param objects, unknown: of the answer, in the frame of the observation's views.
    :param models: class id c is models[c - 1].
    """
    points = _open_points(observation, objects, models, tolerance_m)
    return Unexplained(points, reasons(points, objects, unknown, models))


def reasons(points: Float64Array, objects: Candidates, unknown: UnknownObjects,
            models: Sequence[GenericModel]) -> UInt8Array:
    """Return (n,) uint8, a Reason for each of the points (n, 3) that no object explains."""
    if not len(points):
        return np.zeros(0, np.uint8)
    middles, cell = cells_of(points)
    reason = np.full(len(middles), Reason.NOISE, np.uint8)
    reason[near_surfaces(middles, objects, models)] = Reason.RESIDUE
    reason[_boxed(middles, unknown)] = Reason.UNKNOWN
    return reason[cell]


def _open_points(observation: Observation, objects: Candidates, models: Sequence[GenericModel],
                 tolerance_m: float) -> Float64Array:
    """Return (n, 3) points of the foreground pixels that no object explains."""
    meshes = posed_meshes(objects, models)
    left = []
    for view in observation.views:
        composed, _ = render_depth(meshes, view.camera)
        open_pixels = view.foreground & ~(np.abs(composed - view.depth) <= tolerance_m)
        left.append(back_project(view.depth, view.camera)[open_pixels])
    points = np.concatenate(left) if left else np.zeros((0, 3))
    return points[np.isfinite(points).all(1)]


def _boxed(points: Float64Array, unknown: UnknownObjects) -> BoolArray:
    """Return (n,) bool: which points lie in the box of a thing."""
    inside = np.zeros(len(points), bool)
    for k in range(len(unknown)):
        R = Rotation.from_quat(unknown.rotation_xyzw[k]).as_matrix()
        local = np.abs((points - unknown.translation[k]) @ R)
        inside |= (local <= unknown.size[k] / 2 + BOX_MARGIN_M).all(1)
    return inside
