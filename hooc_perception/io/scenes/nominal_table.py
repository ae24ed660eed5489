# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Guess where the table is from the camera poses alone."""

from collections.abc import Sequence
from dataclasses import replace

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import inverse
from hooc_perception.core.types import Camera
import numpy as np

# Assumed distance of the table where the optical axes do not meet.
DISTANCE_M = 0.8
# Axes with a larger cosine between them are too close to parallel to be intersected.
PARALLEL = 0.98


def nominal_cameras(cameras: Sequence[Camera]) -> tuple[Camera, ...]:
    """
    Return cameras of an unknown world in the frame of a nominal table; training sees no depth.

    Its origin is the point that is closest to all optical axes. Up is the mean direction of
    the images' upper edges and the cameras' backs: exact for cameras evenly around a table,
    and an elevation of 45 degrees for a single camera.

    :param cameras: posed in one world.
    """
    backs = -np.array([camera.T_world_camera[:3, 2] for camera in cameras])
    eyes = np.array([camera.T_world_camera[:3, 3] for camera in cameras])
    image_ups = -np.array([camera.T_world_camera[:3, 1] for camera in cameras])
    up = image_ups.mean(0) + backs.mean(0)
    up /= np.linalg.norm(up)
    x = cameras[0].T_world_camera[:3, 0]
    x = x - (x @ up) * up
    x /= np.linalg.norm(x)
    T_world_table = np.eye(4)
    T_world_table[:3, :3] = np.column_stack([x, np.cross(up, x), up])
    T_world_table[:3, 3] = _closest_point(eyes, -backs)
    T_table_world = inverse(T_world_table)
    return tuple(replace(camera, T_world_camera=T_table_world @ camera.T_world_camera)
                 for camera in cameras)


def _closest_point(eyes: Float64Array, axes: Float64Array) -> Float64Array:
    """Return the point (3,) closest to all rays, or a point ahead if they are parallel."""
    if (axes @ axes.T).min() < PARALLEL:
        across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
        point = np.linalg.lstsq(across.sum(0), (across @ eyes[:, :, None]).sum(0)[:, 0],
                                rcond=None)[0]
        if (((point - eyes) * axes).sum(1) > 0).all():
            return point
    return (eyes + DISTANCE_M * axes).mean(0)
