# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The topics views/*: rectified frame sets, from ingestion to the later nodes, bit for bit."""

from geometry_msgs.msg import TransformStamped
from hooc_perception.core.geometry import back_project, pose_from_matrix
from hooc_perception.core.types import RectifiedView
from hooc_perception.ros.conversions import (
    camera_from_messages,
    camera_info_message,
    depth_from_message,
    depth_message,
    header,
    nanoseconds,
    transform_message,
)
from hooc_perception.ros.frame_sets import StampJoin
from hooc_perception.ros.stage_messages import points_message
import numpy as np
from sensor_msgs.msg import CameraInfo, Image, PointCloud2

_KINDS = (('camera_info', CameraInfo), ('extrinsics', TransformStamped), ('depth_rect', Image))


class ViewOutput:
    """Publish rectified views, all with the stamp of their set."""

    def __init__(self, node, names):
        """Create the publishers on a StageNode."""
        self._publishers = {name: [node.publisher(kind, f'views/<camera>/{suffix}',
                                                  f'views/{name}/{suffix}')
                                   for suffix, kind in _KINDS] for name in names}
        self._points = node.publisher(PointCloud2, 'views/points')

    def publish(self, stamp_ns, target_frame, views, frames):
        """
        Publish one frame set.

        :param views: RectifiedView a camera.
        :param frames: frame_id of each camera's optical frame.
        """
        for view, frame in zip(views, frames):
            head = header(stamp_ns, frame)
            info, extrinsics, depth = self._publishers[view.camera.name]
            info.publish(camera_info_message(view.camera, head))
            extrinsics.publish(transform_message(*pose_from_matrix(view.camera.T_world_camera),
                                                 header(stamp_ns, target_frame), frame))
            depth.publish(depth_message(view.depth, head))
        # Ten megabytes a set: only for those who look.
        if self._points.get_subscription_count():
            self._points.publish(fused_cloud(views, header(stamp_ns, target_frame)))


def fused_cloud(views, head):
    """Return the PointCloud2 x y z camera of all readings of RectifiedViews, world frame."""
    clouds = [back_project(view.depth, view.camera).reshape(-1, 3) for view in views]
    points = np.concatenate(clouds)
    camera = np.repeat(np.arange(len(views), dtype=np.uint8), [len(c) for c in clouds])
    seen = np.isfinite(points[:, 2])
    return points_message(points[seen], head, camera[seen])


class ViewInput:
    """
    Receive rectified views and whatever else a stage needs for the same stamp.

    :param others: {part: (message type, topic)} that are joined with the views by stamp.
    :param callback: called as callback(stamp_ns, views, {part: message}) for each whole set.
    """

    def __init__(self, node, names, others, callback):
        """Create the subscriptions on a StageNode."""
        self._node, self._names, self._callback = node, names, callback
        views = [f'{name}/{suffix}' for name in names for suffix, _ in _KINDS]
        self.join = StampJoin([*views, *others])
        for name in names:
            for suffix, kind in _KINDS:
                node.subscription(kind, f'views/<camera>/{suffix}',
                                  self._taker(f'{name}/{suffix}'), f'views/{name}/{suffix}')
        for part, (kind, topic) in others.items():
            node.subscription(kind, topic, self._taker(part))

    def _taker(self, part):
        def take(message):
            before = sum(self.join.drops.values())
            whole = self.join.add(part, nanoseconds(message.header.stamp), message)
            dropped = sum(self.join.drops.values()) - before
            if dropped:
                self._node.diagnostics.count('input', 'incomplete', dropped)
            if whole and self._node.active:
                self._callback(nanoseconds(message.header.stamp), self._views(whole), whole)
        return take

    def _views(self, parts):
        return tuple(RectifiedView(
            camera_from_messages(name, parts[f'{name}/camera_info'], parts[f'{name}/extrinsics']),
            depth_from_message(parts[f'{name}/depth_rect'])) for name in self._names)
