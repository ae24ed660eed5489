# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What an implausible camera pose would mean in another convention: unit, order, direction."""

from collections.abc import Callable
from dataclasses import replace
import math
from typing import TypeAlias

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import (
    inverse,
    matrix_from_pose,
    pose_from_matrix,
    project,
    transform,
)
from hooc_perception.core.types import Camera
import numpy as np

WORKSPACE_M = 0.8
# Real rigs show nearly half of the workspace or more; a camera that shows less than LITTLE is
# not turned to it.
LITTLE, MUCH = 0.2, 0.4
NEAREST_CAMERA_M, USUAL_M, FARTHEST_CAMERA_M = 0.15, 1.2, 4.0


def workspace_share(camera: Camera, radius_m: float = WORKSPACE_M) -> float:
    """Return which share of the disc z = 0 around the origin a camera has in its image."""
    grid = np.linspace(-radius_m, radius_m, 41)
    x, y = (axis.ravel() for axis in np.meshgrid(grid, grid))
    disc = np.column_stack([x, y, np.zeros(len(x))])[np.hypot(x, y) < radius_m]
    points = transform(inverse(camera.T_world_camera), disc)
    ahead = points[:, 2] > 0.05
    u, v = project(camera.K, points[ahead])
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    return float(inside.sum() / len(disc)) if camera.T_world_camera[2, 3] > 0 else 0.0


def pose_reading(camera: Camera) -> str | None:
    """
    Return how an implausible pose seems to be meant, None if no usual mistake explains it.

    :param camera: one that stands in the wrong place or looks elsewhere.
    :return: words for "its pose is plausible if ...".
    """
    T = camera.T_world_camera
    is_far = np.linalg.norm(T[:3, 3]) > FARTHEST_CAMERA_M
    found: list[tuple[float, str]] = []
    for words, meant in _UNITS if is_far else _DIRECTIONS:
        fixed = replace(camera, T_world_camera=meant(T))
        away = float(np.linalg.norm(fixed.T_world_camera[:3, 3]))
        share = workspace_share(fixed)
        if NEAREST_CAMERA_M < away < FARTHEST_CAMERA_M and share > MUCH:
            # Of units, the one with the most usual distance; of directions, the best aimed.
            found.append((-abs(math.log(away / USUAL_M)) if is_far else share, words))
    return max(found)[1] if found else None


def _scaled(factor: float) -> Callable[[Float64Array], Float64Array]:
    """Return the function that multiplies the translation of a pose."""
    def meant(T: Float64Array) -> Float64Array:
        T = T.copy()
        T[:3, 3] *= factor
        return T
    return meant


def _w_first(T: Float64Array) -> Float64Array:
    """Return the pose whose quaternion was given as w, x, y, z."""
    translation, (w, x, y, z) = pose_from_matrix(T)
    return matrix_from_pose(translation, (x, y, z, w))


_Mistakes: TypeAlias = tuple[tuple[str, Callable[[Float64Array], Float64Array]], ...]
_UNITS: _Mistakes = (
    ('the translation is in millimetres; give it in metres', _scaled(0.001)),
    ('the translation is in centimetres; give it in metres', _scaled(0.01)),
    ('the translation is in inches; give it in metres', _scaled(0.0254)))
_DIRECTIONS: _Mistakes = (
    ('the quaternion is given as w, x, y, z; give x, y, z, w', _w_first),
    ('the transform is inverted; give camera to world', inverse))
