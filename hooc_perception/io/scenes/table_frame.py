# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Express a recording in the frame of its table, whether that frame is known or estimated."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

from hooc_perception.core.geometry import pose_from_matrix
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.segment.support_plane import find_support_plane, SupportPlane
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError

# Whatever was measured may show the table.
_RECTIFY = ObserveConfig(max_depth_m=20.0)


class TableFrameScene:
    """
    Base of recorded scenes, whose files state poses in a source world.

    Where the source world is not known to be a table's (`table_known` is False), the frame of
    the dominant support plane is estimated from the depth when it is first needed.

    :ivar source_cameras: posed in the source world.
    """

    name: str
    source_cameras: tuple[Camera, ...]
    table_known: bool

    def source_views(self) -> tuple[DepthView, ...]:
        """Return the raw depth views of one frame set with the cameras of the source world."""
        raise NotImplementedError

    @cached_property
    def table(self) -> SupportPlane | None:
        """Return the estimated SupportPlane, None if the source world is a table's."""
        if self.table_known:
            return None
        return estimate_table_frame(self.source_views(), self.name)

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the cameras, posed in the table frame."""
        if self.table is None:
            return self.source_cameras
        T_table_source = self.table.T_table_source
        return tuple(replace(camera, T_world_camera=T_table_source @ camera.T_world_camera)
                     for camera in self.source_cameras)

    @property
    def world(self) -> dict[str, Any]:
        """Return the results entries that describe an estimated world frame, {} if it is known."""
        return {} if self.table is None else {'world': _as_dict(self.table)}


def estimate_table_frame(views: Sequence[DepthView], scene_name: str) -> SupportPlane:
    """
    Return the SupportPlane of one scene, see find_support_plane.

    :param views: raw; the poses of their cameras define the source frame.
    :raises HoocError: if there is none.
    """
    plane = find_support_plane([rectify(view, _RECTIFY) for view in views])
    if plane is None:
        raise HoocError(f'scene {scene_name}: no support plane was found in the depth images, so '
                        'the table frame is unknown; give extrinsics in a table frame')
    return plane


def _as_dict(plane: SupportPlane) -> dict[str, Any]:
    """Return plain data for a results file."""
    translation, rotation = pose_from_matrix(plane.T_table_source)
    return {'frame': 'table', 'estimated_from': 'dominant support plane',
            'table_from_source': {'translation': translation.tolist(),
                                  'rotation_xyzw': rotation.tolist()},
            'inlier_share': round(plane.inlier_share, 4),
            'residual_m': round(plane.residual_m, 5)}
