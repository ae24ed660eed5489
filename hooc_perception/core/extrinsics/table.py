# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Level a camera on the table that it sees, from a pose that is degrees and centimetres off."""

from collections.abc import Sequence
from dataclasses import replace

from hooc_perception.core.arrays import AnyArray, Float64Array
from hooc_perception.core.segment.level import levelling
from hooc_perception.core.segment.support_plane import find_support_plane, PlaneBounds
from hooc_perception.core.types import Camera, RectifiedView
from hooc_perception.errors import HoocError
import numpy as np

# Where the table may lie for a camera that is off by 5 degrees and 5 cm, with a margin.
BOUNDS = PlaneBounds(-0.25, 0.25, np.radians(10.0))
# So many views are enough to find a plane.
MOST_VIEWS = 4


def levelled(views: Sequence[RectifiedView]) -> Camera:
    """
    Return the camera of some views with height, roll and pitch from the table.

    It turns about itself: its position and heading on the table stay.

    :raises HoocError: where no view shows a table within BOUNDS of where its pose says.
    """
    camera = views[0].camera
    planes = []
    for view in views[::max(1, len(views) // MOST_VIEWS)][:MOST_VIEWS]:
        found = find_support_plane([view], BOUNDS)
        if found is not None:
            planes.append(found.T_table_source[2])      # z over the table of a point (x, y, z, 1)
    if not planes:
        raise HoocError(f'{camera.name} sees no table within {100 * BOUNDS.high_m:.0f} cm and '
                        f'{np.degrees(BOUNDS.tilt_rad):.0f} degrees of where its pose says; '
                        'check its extrinsics (camera to world, metres, optical frame), and '
                        'start from a pose that is right to 5 degrees and 5 cm')
    plane: AnyArray = np.median(planes, axis=0)
    plane = plane / np.linalg.norm(plane[:3])
    return replace(camera, T_world_camera=_turned(camera.T_world_camera, plane))


def _turned(T_world_camera: Float64Array, plane: Float64Array) -> Float64Array:
    """Return a pose (4, 4) for which the plane (4,) of the present world becomes z = 0."""
    slopes = np.array([-plane[0] / plane[2], -plane[1] / plane[2], 0.0])
    T = T_world_camera.copy()
    T[:3, :3] = levelling(slopes)[:3, :3] @ T[:3, :3]
    T[2, 3] = plane[:3] @ T_world_camera[:3, 3] + plane[3]
    return T
