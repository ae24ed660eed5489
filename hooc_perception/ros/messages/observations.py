# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
An Observation (stage 1) as messages, exactly there and back.

Per camera: rectified depth, its intrinsics, and the segments of the image. Per frame set: one
row per camera with its levelled pose, the pose of the table and the noise. The rest of an
ObservedView is computed from these. Exact where the target frame is that of the table, as by
default; else the camera poses are rounded in the last bits.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from geometry_msgs.msg import TransformStamped
from hooc_perception.core.arrays import AnyArray, BoolArray, Float32Array, Float64Array
from hooc_perception.core.geometry import inverse
from hooc_perception.core.segment.foreground import observed_view
from hooc_perception.core.types import Camera, Observation, ObservedView
from hooc_perception.errors import HoocError
from hooc_perception.ros.messages.conversions import (
    camera_from_messages,
    depth_from_message,
    labels_from_message,
    labels_message,
)
from hooc_perception.ros.messages.point_clouds import cloud_message, cloud_rows, row_dtype
import numpy as np
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

# Bits of a pixel in `views/<camera>/segments`.
FOREGROUND, TABLE, HIDDEN = 1, 2, 4
# The upper three rows of T_target_camera, row by row; x y z is where the camera is.
POSE_COLUMNS = ('r00', 'r01', 'r02', 'x', 'r10', 'r11', 'r12', 'y', 'r20', 'r21', 'r22', 'z')
# The same of T_target_table, equal in every row.
TABLE_COLUMNS = tuple(f'table_{name}' for name in POSE_COLUMNS)
NOISE_COLUMN = 'noise_m'
_COLUMNS = (*POSE_COLUMNS, NOISE_COLUMN, *TABLE_COLUMNS)
_DTYPE = row_dtype([(name, 'f8') for name in _COLUMNS])
# A rotation matrix deviates from orthonormality by rounding alone.
ORTHONORMAL_WITHIN = 1e-6


@dataclass(frozen=True)
class ViewMessages:
    """The messages of one camera: intrinsics, rectified depth, segments."""

    info: CameraInfo
    depth: Image
    segments: Image


def segments_message(view: ObservedView, head: Header) -> Image:
    """Return the mono8 Image of a view's masks: FOREGROUND, TABLE and HIDDEN are its bits."""
    bits = view.foreground * np.uint8(FOREGROUND) | view.table * np.uint8(TABLE)
    if view.hidden is not None:
        bits |= view.hidden * np.uint8(HIDDEN)
    return labels_message(bits, head)


def poses_message(observation: Observation, head: Header) -> PointCloud2:
    """Return the PointCloud2 of the levelled camera poses and the table, one row per camera."""
    rows = np.zeros(len(observation.views), _DTYPE)
    for row, view in zip(rows, observation.in_target_frame().views):
        for name, value in zip(POSE_COLUMNS, view.camera.T_world_camera[:3].ravel()):
            row[name] = value
    T = observation.T_target_table
    for name, value in zip(TABLE_COLUMNS, (np.eye(4) if T is None else T)[:3].ravel()):
        rows[name] = value
    rows[NOISE_COLUMN] = observation.noise_m
    return cloud_message(rows, head)


def observation_from_messages(views: Mapping[str, ViewMessages],
                              poses: PointCloud2) -> Observation:
    """
    Return the Observation of its messages, equal to the original to the last bit.

    :param views: by camera name, in the order of the rows of `poses`.
    :raises HoocError: if a message is malformed, or does not belong to the others.
    """
    posed = poses_from_message(poses, list(views))
    T_table_target = None if posed.T_target_table is None else inverse(posed.T_target_table)
    observed = tuple(_view(name, messages, T if T_table_target is None else T_table_target @ T)
                     for (name, messages), T in zip(views.items(), posed.T_target_camera))
    if not any(np.isfinite(view.depth).any() for view in observed):
        raise HoocError(f'views/<camera>/depth_rect of {", ".join(views)} hold no reading at all; '
                        'is another node publishing on these topics?')
    return Observation(observed, posed.noise_m, posed.T_target_table)


@dataclass(frozen=True)
class Poses:
    """
    What `views/poses` says.

    :ivar T_target_camera: one (4, 4) per camera, levelled on the table.
    :ivar noise_m: standard deviation of the heights of the table.
    :ivar T_target_table: (4, 4); None = the identity.
    """

    T_target_camera: list[Float64Array]
    noise_m: float
    T_target_table: Float64Array | None


def poses_from_message(message: PointCloud2, names: Sequence[str]) -> Poses:
    """
    Return the Poses of `views/poses`.

    :param names: of the cameras, one per row.
    :raises HoocError: if columns are missing or of another type, or the values are no poses.
    """
    rows = cloud_rows(message, (*POSE_COLUMNS, NOISE_COLUMN))
    # Recordings of earlier versions have no table: it was where the target frame was.
    has_table = TABLE_COLUMNS[0] in (rows.dtype.names or ())
    columns = _COLUMNS if has_table else (*POSE_COLUMNS, NOISE_COLUMN)
    rows = cloud_rows(message, columns)
    wrong = [name for name in columns if rows.dtype[name].newbyteorder('=') != np.float64]
    if wrong:
        raise HoocError(f'views/poses has fields that are not float64 ({", ".join(wrong)}); is '
                        'another node publishing on this topic?')
    if len(rows) != len(names):
        raise HoocError(f'views/poses has {len(rows)} cameras, but here are {len(names)} '
                        f'({", ".join(names)}); give all nodes the same parameter cameras')
    poses = [_rigid(row, POSE_COLUMNS, name) for name, row in zip(names, rows)]
    tables = [_rigid(row, TABLE_COLUMNS, 'the table') for row in rows] if has_table else []
    noise = np.array(rows[NOISE_COLUMN], np.float64)
    if not (np.isfinite(noise).all() and (noise > 0).all() and (noise == noise[:1]).all()
            and all(np.array_equal(T, tables[0]) for T in tables)):
        raise HoocError('views/poses gives no noise_m in metres and no pose of the table that are '
                        'the same in every row; is another node publishing on this topic?')
    moved = bool(tables) and not np.array_equal(tables[0], np.eye(4))
    return Poses(poses, float(noise[0]) if len(noise) else 0.0, tables[0] if moved else None)


def _rigid(row: AnyArray, columns: Sequence[str], name: str) -> Float64Array:
    """Return the rigid (4, 4) transform in some columns of a row; HoocError if it is none."""
    T = np.eye(4)
    T[:3] = np.array([row[column] for column in columns]).reshape(3, 4)
    R = T[:3, :3]
    if not (np.isfinite(T).all() and (np.abs(R) < 2).all() and np.linalg.det(R) > 0
            and np.allclose(R @ R.T, np.eye(3), rtol=0, atol=ORTHONORMAL_WITHIN)):
        raise HoocError(f'views/poses holds no rigid pose for {name}; is another node '
                        'publishing on this topic?')
    return T


def _view(name: str, messages: ViewMessages, T_world_camera: Float64Array) -> ObservedView:
    """Return the ObservedView of one camera; HoocError if its messages do not fit together."""
    camera = replace(camera_from_messages(name, messages.info, TransformStamped()),
                     T_world_camera=T_world_camera)
    depth = depth_from_message(messages.depth)
    _check_size(camera, 'depth_rect', depth.shape)
    foreground, table, hidden = _masks(camera, depth, messages.segments)
    with np.errstate(over='ignore'):    # with absurd intrinsics
        view = replace(observed_view(camera, depth, foreground, table),
                       hidden=hidden if hidden.any() else None)
    if not np.isfinite(view.background[table]).all():
        raise HoocError(f'views/{name}/segments marks the table at pixels whose rays do not meet '
                        'it; is another node publishing on this topic?')
    return view


def _masks(camera: Camera, depth: Float32Array,
           message: Image) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Return the (H, W) masks (foreground, table, hidden) of an Image; HoocError if none."""
    segments = labels_from_message(message)
    _check_size(camera, 'segments', segments.shape)
    foreground = segments & FOREGROUND > 0
    hidden = segments & HIDDEN > 0
    if (segments.max(initial=0) > FOREGROUND | TABLE | HIDDEN
            or not np.isfinite(depth[foreground]).all() or np.isfinite(depth[hidden]).any()):
        raise HoocError(f'views/{camera.name}/segments has unknown bits, foreground at pixels '
                        'without a reading, or hidden pixels with one; is another node publishing '
                        'on this topic?')
    return foreground, segments & TABLE > 0, hidden


def _check_size(camera: Camera, suffix: str, shape: tuple[int, ...]) -> None:
    """Raise HoocError if an image is not of the size that its camera_info gives."""
    if shape != (camera.height, camera.width):
        raise HoocError(f'views/{camera.name}/{suffix} is {shape[1]} x {shape[0]} pixels, but its '
                        f'camera_info is for {camera.width} x {camera.height}; is another node '
                        'publishing on these topics?')
