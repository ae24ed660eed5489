# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One recorded scene: its cameras, its depth images (read on demand) and its ground truth."""

from dataclasses import dataclass, field, replace
from pathlib import Path

from hooc_perception.core.arrays import Float32Array, Float64Array, UInt8Array
from hooc_perception.core.geometry import matrix_from_pose, pose_from_matrix
from hooc_perception.core.segment.hidden import with_hidden
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.io.scenes import png
from hooc_perception.io.scenes.plausible import check_aim, check_distances, check_unit
from hooc_perception.io.scenes.table_frame import TableFrameScene


@dataclass(frozen=True)
class Category:
    """
    A class of objects and its meshes.

    :ivar mesh_path: the file of the generic mesh, of any format that trimesh reads.
    :ivar scale: metres per unit of the meshes, None = as their files document it, else 1.0.
    :ivar variant_paths: files of further meshes of the category, in the same axes.
    :ivar up: axis of the files that points up, None = as they document it, else z.
    """

    name: str
    mesh_path: Path
    scale: float | None = None
    variant_paths: tuple[Path, ...] = ()
    up: str | None = None


@dataclass(frozen=True, eq=False)
class TrueObject:
    """
    A ground truth object of a scene.

    :ivar translation: (3,) float64 centre of the bounding box, world, metres.
    :ivar rotation_xyzw: (4,) float64 unit quaternion, model axes to world.
    :ivar size: (3,) float64 the real object's extents along its model axes, metres.
    :ivar surface_visibility: share of its surface that some camera sees, None if unknown.
    """

    category: str
    translation: Float64Array
    rotation_xyzw: Float64Array
    size: Float64Array
    surface_visibility: float | None = None


@dataclass(frozen=True, eq=False)
class RecordedScene(TableFrameScene):
    """
    One recorded frame set.

    The files state poses in the source world. If that is not known to be a table's
    (`table_known` is False), `cameras` and `truth` are moved into the frame of the dominant
    support plane, which is estimated from the depth when it is first needed.

    :ivar depth_files: one 16-bit PNG per camera, in camera order.
    :ivar depth_units: metres per count, one per camera.
    :ivar source_truth: None for scenes without annotation.
    :ivar source_strangers: things of none of the set's categories that stand there, their names
        as `category`; None for scenes where nobody noted them.
    :ivar label_files: {camera name: 8-bit PNG of instance labels}, where there are any.
    :ivar label_categories: {label: category}, None where nobody noted them.
    :ivar well_seen: {camera name: labels with enough depth}, as somebody noted them.
    :ivar mask_files: {camera name: 8-bit PNG, not black where the robot hides the scene}.
    """

    name: str
    source_cameras: tuple[Camera, ...]
    depth_files: tuple[Path, ...]
    depth_units: tuple[float, ...]
    source_truth: tuple[TrueObject, ...] | None = None
    label_files: dict[str, Path] = field(default_factory=dict)
    table_known: bool = True
    source_strangers: tuple[TrueObject, ...] | None = None
    mask_files: dict[str, Path] = field(default_factory=dict)
    label_categories: dict[int, str] | None = None
    well_seen: dict[str, tuple[int, ...]] = field(default_factory=dict)

    @property
    def truth(self) -> tuple[TrueObject, ...] | None:
        """Return the ground truth in the table frame, None without annotation."""
        return self._in_table_frame(self.source_truth)

    @property
    def strangers(self) -> tuple[TrueObject, ...] | None:
        """Return the things of no category in the table frame, None where nobody noted them."""
        return self._in_table_frame(self.source_strangers)

    def source_views(self) -> tuple[DepthView, ...]:
        """
        Return the raw depth views with the cameras of the source world.

        :raises HoocError: as `depth`, but for what only a table's frame tells.
        """
        views = tuple(self._view(camera, depth)
                      for camera, depth in zip(self.source_cameras, self._depth_images))
        check_distances(views, self.depth_files, self.depth_units)
        return views

    def depth(self) -> tuple[DepthView, ...]:
        """
        Return one DepthView per camera: float32 metres, NaN = none, still distorted.

        :raises HoocError: if an image is missing, damaged, empty, of another size or in another
            unit than stated, or a camera's pose cannot be meant.
        """
        if self.table_known:
            check_aim(self.cameras, self.name)
        views = tuple(replace(view, camera=camera)
                      for view, camera in zip(self.source_views(), self.cameras))
        check_unit(views, self.depth_files, self.depth_units)
        return views

    def labels(self) -> dict[str, UInt8Array] | None:
        """Return {camera: (H, W) uint8 instance labels, 0 = none}, None without labels."""
        if not self.label_files:
            return None
        return {camera.name: png.read_png(self.label_files[camera.name], camera.width,
                                          camera.height, 8)
                for camera in self.source_cameras if camera.name in self.label_files}

    def _in_table_frame(self, things: tuple[TrueObject, ...] | None
                        ) -> tuple[TrueObject, ...] | None:
        if things is None or self.table is None:
            return things
        return tuple(_moved(self.table.T_table_source, true) for true in things)

    def _view(self, camera: Camera, depth: Float32Array) -> DepthView:
        """Return the DepthView of a camera, without what its mask covers."""
        view, path = DepthView(camera, depth), self.mask_files.get(camera.name)
        if path is None:
            return view
        return with_hidden(view, png.read_png(path, camera.width, camera.height, 8) > 0)

    @property
    def _depth_images(self) -> tuple[Float32Array, ...]:
        """Return the depth images, read again each time to save memory."""
        return tuple(png.read_depth_png(path, camera.width, camera.height, unit)
                     for path, camera, unit in zip(self.depth_files, self.source_cameras,
                                                   self.depth_units))


def _moved(T_a_b: Float64Array, true: TrueObject) -> TrueObject:
    """Return a TrueObject of frame b in frame a."""
    T_a_model = T_a_b @ matrix_from_pose(true.translation, true.rotation_xyzw)
    translation, rotation = pose_from_matrix(T_a_model)
    return replace(true, translation=translation, rotation_xyzw=rotation)
