# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where a table would be that cameras look at, as far as the cameras alone tell."""

from dataclasses import replace

from hooc_perception.core.geometry import inverse
import numpy as np

# How far ahead a table is taken to be where the optical axes do not meet.
DISTANCE_M = 0.8
# Axes that are this close to parallel (cosine) do not say where they meet.
PARALLEL = 0.98


def nominal_cameras(cameras):
    """
    Return cameras of an unknown world in the frame of a nominal table; training sees no depth.

    Its origin is the point that is closest to all optical axes. Up is the mean of where the
    images' upper edges and the cameras' backs point: exact for cameras evenly around a table,
    and an elevation of 45 degrees for a single one.

    :param cameras: sequence of Camera, posed in one world.
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
    T_world_table[:3, 3] = _meeting_point(eyes, -backs)
    T_table_world = inverse(T_world_table)
    return tuple(replace(camera, T_world_camera=T_table_world @ camera.T_world_camera)
                 for camera in cameras)


def _meeting_point(eyes, axes):
    """Return the point (3,) closest to all rays, or one ahead where they are parallel."""
    if (axes @ axes.T).min() < PARALLEL:
        across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
        point = np.linalg.lstsq(across.sum(0), (across @ eyes[:, :, None]).sum(0)[:, 0],
                                rcond=None)[0]
        if (((point - eyes) * axes).sum(1) > 0).all():
            return point
    return (eyes + DISTANCE_M * axes).mean(0)
