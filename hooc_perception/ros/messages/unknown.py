# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Things of no category as messages: `objects/unknown` and `objects/unknown_attributes`."""

from geometry_msgs.msg import PoseArray
from hooc_perception.core.arrays import AnyArray
from hooc_perception.core.types import UnknownObjects
from hooc_perception.errors import HoocError
from hooc_perception.ros.messages.conversions import pose_array_message, poses_from_message
from hooc_perception.ros.messages.point_clouds import cloud_message, cloud_rows, row_dtype
import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

UNKNOWN_COLUMNS = tuple((name, 'f4') for name in (
    'x', 'y', 'z', 'score', 'size_x', 'size_y', 'size_z', 'age_s')) + (('id', 'u4'),)


def unknown_messages(unknown: UnknownObjects, ids: AnyArray, age_s: float,
                     head: Header) -> tuple[PoseArray, PointCloud2]:
    """
    Return (PoseArray, PointCloud2) of UnknownObjects; row i belongs to pose i.

    :param ids: (n,) uint32 instance ids.
    :param age_s: seconds from the stamp of the frame set to now.
    """
    rows = np.zeros(len(unknown), row_dtype(UNKNOWN_COLUMNS))
    rows['x'], rows['y'], rows['z'] = unknown.translation.T
    rows['size_x'], rows['size_y'], rows['size_z'] = unknown.size.T
    rows['score'], rows['age_s'], rows['id'] = unknown.score, age_s, ids
    return (pose_array_message(unknown.translation, unknown.rotation_xyzw, head),
            cloud_message(rows, head))


def unknown_from_messages(poses: PoseArray, attributes: PointCloud2) -> UnknownObjects:
    """
    Return the UnknownObjects of their two messages, without hulls, which are not sent.

    :raises HoocError: if the messages do not belong together.
    """
    translation, rotation = poses_from_message(poses)
    rows = cloud_rows(attributes, [name for name, _ in UNKNOWN_COLUMNS])
    if len(rows) != len(translation):
        raise HoocError(f'objects/unknown has {len(translation)} poses, but '
                        f'objects/unknown_attributes {len(rows)} rows; is another node '
                        'publishing on these topics?')
    size = np.column_stack([rows['size_x'], rows['size_y'], rows['size_z']])
    return UnknownObjects(translation, rotation, size, rows['score'].copy(),
                          (np.zeros((0, 3)),) * len(rows))
