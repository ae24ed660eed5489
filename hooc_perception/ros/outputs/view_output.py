# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The topics views/* as ingestion publishes them: what stage 1 knows of a frame set."""

from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import TransformStamped
from hooc_perception.core.arrays import UInt8Array
from hooc_perception.core.geometry import back_project, pose_from_matrix
from hooc_perception.core.types import Observation, RectifiedView
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import (
    camera_info_message,
    depth_message,
    labels_message,
    transform_message,
)
from hooc_perception.ros.messages.observations import poses_message, segments_message
from hooc_perception.ros.messages.stages import points_message
import numpy as np
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

_KINDS = {'camera_info': CameraInfo, 'extrinsics': TransformStamped, 'segments': Image,
          'depth_rect': Image, 'count': Image}


class ViewOutput:
    """Publish observed frame sets; all messages carry the stamp of their set."""

    def __init__(self, node: StageNode[Any, Any], names: Sequence[str]) -> None:
        """Create the publishers of the named cameras on a StageNode."""
        self._cameras = {name: {suffix: node.publisher(kind, f'views/<camera>/{suffix}',
                                                       f'views/{name}/{suffix}')
                                for suffix, kind in _KINDS.items()} for name in names}
        self._poses = node.publisher(PointCloud2, 'views/poses')
        self._points = node.publisher(PointCloud2, 'views/points')

    def publish(self, head: Header, observation: Observation, views: Sequence[RectifiedView],
                frames: Sequence[str], counts: Sequence[UInt8Array | None]) -> None:
        """
        Publish one frame set.

        :param head: stamp of the set, and the target frame.
        :param views: the rectified views that were observed; their poses are as calibrated.
        :param frames: frame_id of each camera's optical frame.
        :param counts: per camera the (H, W) number of readings that each pixel is the median
            of, None if nothing was fused.
        """
        for seen, view, frame, count in zip(observation.views, views, frames, counts):
            own = Header(stamp=head.stamp, frame_id=frame)
            outputs = self._cameras[view.camera.name]
            if count is not None:
                outputs['count'].publish(labels_message(count, own))
            outputs['camera_info'].publish(camera_info_message(view.camera, own))
            outputs['extrinsics'].publish(transform_message(
                *pose_from_matrix(view.camera.T_world_camera), head, frame))
            outputs['segments'].publish(segments_message(seen, own))
            outputs['depth_rect'].publish(depth_message(seen.depth, own))
        self._poses.publish(poses_message(observation, head))
        # Ten megabytes per set: only if somebody listens.
        if self._points.get_subscription_count():
            self._points.publish(fused_cloud(views, head))


def fused_cloud(views: Sequence[RectifiedView], head: Header) -> PointCloud2:
    """Return the PointCloud2 x y z camera of all readings of RectifiedViews, world frame."""
    clouds = [back_project(view.depth, view.camera).reshape(-1, 3) for view in views]
    points = np.concatenate(clouds)
    camera = np.repeat(np.arange(len(views), dtype=np.uint8), [len(c) for c in clouds])
    seen = np.isfinite(points[:, 2])
    return points_message(points[seen], head, camera=camera[seen])
