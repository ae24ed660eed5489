# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One recorded scene: its cameras, its depth images (read when asked for) and its truth."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from hooc_perception.core.geometry import matrix_from_pose, pose_from_matrix
from hooc_perception.core.types import DepthView
from hooc_perception.io.scenes import png
from hooc_perception.io.scenes.support_plane import estimate_table_frame
import numpy as np


@dataclass(frozen=True)
class Category:
    """
    A class of objects and its generic model.

    :ivar mesh_path: the mesh file, of any format that trimesh reads.
    :ivar scale: metres per unit of the mesh.
    """

    name: str
    mesh_path: Path
    scale: float = 1.0


@dataclass(frozen=True, eq=False)
class TrueObject:
    """
    What really stands in a scene.

    :ivar translation: (3,) float64 centre of the bounding box, world, metres.
    :ivar rotation_xyzw: (4,) float64 unit quaternion, model axes to world.
    :ivar size: (3,) float64 the real object's extents along its model axes, metres.
    :ivar surface_visibility: share of its surface that some camera sees, None where unknown.
    """

    category: str
    translation: np.ndarray
    rotation_xyzw: np.ndarray
    size: np.ndarray
    surface_visibility: float | None = None


@dataclass(frozen=True, eq=False)
class RecordedScene:
    """
    One recorded frame set.

    What the files say is in the source world; where that is not known to be a table's
    (`table_known` False), `cameras` and `truth` are moved into the frame of the dominant
    support plane, which is estimated from the depth when it is first needed.

    :ivar depth_files: one 16-bit PNG a camera, in camera order.
    :ivar depth_units: metres per count, one a camera.
    :ivar source_truth: tuple of TrueObject, or None for scenes that nobody annotated.
    :ivar label_files: {camera name: 8-bit PNG of instance labels}, where there are any.
    """

    name: str
    source_cameras: tuple
    depth_files: tuple
    depth_units: tuple
    source_truth: tuple | None = None
    label_files: dict = field(default_factory=dict)
    table_known: bool = True

    @cached_property
    def table(self):
        """Return the SupportPlane that was estimated, None where the world is a table's."""
        if self.table_known:
            return None
        views = [DepthView(c, d) for c, d in zip(self.source_cameras, self._depth_images)]
        return estimate_table_frame(views, self.name)

    @cached_property
    def cameras(self):
        """Return the tuple of Camera, posed in the table's frame."""
        if self.table_known:
            return self.source_cameras
        T_table_source = self.table.T_table_source
        return tuple(replace(camera, T_world_camera=T_table_source @ camera.T_world_camera)
                     for camera in self.source_cameras)

    @property
    def truth(self):
        """Return the tuple of TrueObject in the table's frame, None where nobody annotated."""
        if self.table_known or self.source_truth is None:
            return self.source_truth
        return tuple(_moved(self.table.T_table_source, true) for true in self.source_truth)

    @property
    def world(self):
        """Return what a results file says of an estimated world frame, {} where it is known."""
        return {} if self.table_known else {'world': self.table.as_dict()}

    def depth(self):
        """
        Return the tuple of DepthView: float32 metres, NaN = none, still distorted.

        :raises HoocError: where an image is missing, damaged, empty or of another size.
        """
        return tuple(DepthView(camera, depth)
                     for camera, depth in zip(self.cameras, self._depth_images))

    def labels(self):
        """Return {camera: (H, W) uint8 instance labels, 0 = none}, None where there are none."""
        if not self.label_files:
            return None
        return {camera.name: png.read_png(self.label_files[camera.name], camera.width,
                                            camera.height, 8)
                for camera in self.source_cameras if camera.name in self.label_files}

    @property
    def _depth_images(self):
        """Return the depth images, read anew each time: scenes are many, memory is not."""
        return tuple(png.read_depth_png(path, camera.width, camera.height, unit)
                     for path, camera, unit in zip(self.depth_files, self.source_cameras,
                                                   self.depth_units))


def _moved(T_a_b, true):
    """Return a TrueObject of frame b in frame a."""
    T_a_model = T_a_b @ matrix_from_pose(true.translation, true.rotation_xyzw)
    translation, rotation = pose_from_matrix(T_a_model)
    return replace(true, translation=translation, rotation_xyzw=rotation)
