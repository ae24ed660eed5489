# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Express a recording in the frame of its table, whether that frame is known or estimated."""

from dataclasses import replace
from functools import cached_property
from typing import Any

from hooc_perception.core.types import Camera, DepthView
from hooc_perception.io.scenes.support_plane import estimate_table_frame, SupportPlane


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
        return {} if self.table is None else {'world': self.table.as_dict()}
