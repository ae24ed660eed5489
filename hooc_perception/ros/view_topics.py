# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The topics views/*: rectified frame sets, from ingestion to the later nodes, bit for bit."""

import time

from geometry_msgs.msg import TransformStamped
from hooc_perception.core.geometry import back_project, pose_from_matrix
from hooc_perception.core.observe import observe
from hooc_perception.core.types import RectifiedView
from hooc_perception.errors import HoocError
from hooc_perception.ros.conversions import (
    camera_from_messages,
    camera_info_message,
    depth_from_message,
    depth_message,
    header,
    labels_message,
    nanoseconds,
    transform_message,
)
from hooc_perception.ros.frame_sets import StampJoin
from hooc_perception.ros.stage_messages import points_message
import numpy as np
from sensor_msgs.msg import CameraInfo, Image, PointCloud2

EXPLAIN_AFTER_S = 3.0
_MAKERS = {'views': 'ingestion_node', 'pixels': 'classification_node',
           'candidates': 'candidate_node'}
_KINDS = (('camera_info', CameraInfo), ('extrinsics', TransformStamped), ('depth_rect', Image))


class ViewOutput:
    """Publish rectified views, all with the stamp of their set."""

    def __init__(self, node, names):
        """Create the publishers on a StageNode."""
        self._publishers = {name: [node.publisher(kind, f'views/<camera>/{suffix}',
                                                  f'views/{name}/{suffix}')
                                   for suffix, kind in _KINDS] for name in names}
        self._points = node.publisher(PointCloud2, 'views/points')
        self._counts = {name: node.publisher(Image, 'views/<camera>/count', f'views/{name}/count')
                        for name in names}

    def publish(self, stamp_ns, target_frame, views, frames, counts=()):
        """
        Publish one frame set.

        :param views: RectifiedView a camera.
        :param frames: frame_id of each camera's optical frame.
        :param counts: (H, W) uint8 readings that each pixel is the median of, None where
            nothing was fused.
        """
        for view, frame, count in zip(views, frames, counts):
            if count is not None:
                self._counts[view.camera.name].publish(
                    labels_message(count, header(stamp_ns, frame)))
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
    Receive rectified views, observe them, join whatever else a stage needs of the same stamp.

    The views come first and are observed at once, while earlier stages still work.

    :param others: {part: (message type, topic)} that are joined with the observation by stamp.
    :param callback: called as callback(stamp_ns, Observation, {part: message}) for each whole
        set; the part `frames` holds the frame_id of every camera.
    """

    def __init__(self, node, names, others, callback):
        """Create the subscriptions on a StageNode that declares the stage `observe`."""
        self._node, self._names, self._callback = node, names, callback
        self._views = StampJoin([f'{name}/{suffix}' for name in names for suffix, _ in _KINDS])
        self._whole = StampJoin(['observation', 'frames', *others])
        for name in names:
            for suffix, kind in _KINDS:
                node.subscription(kind, f'views/<camera>/{suffix}',
                                  self._taker(self._views, f'{name}/{suffix}', self._observe),
                                  f'views/{name}/{suffix}')
        for part, (kind, topic) in others.items():
            node.subscription(kind, topic, self._taker(self._whole, part, self._deliver))
        self._needed = [*(f'views/{name}/depth_rect' for name in names),
                        *(topic for _, topic in others.values())]
        node.steady_timer(1.0, self._explain)

    def clear(self):
        """Forget what waits."""
        self._views.clear()
        self._whole.clear()

    def _explain(self):
        """Say which node is missing, or works for other cameras."""
        node = self._node
        if not node.active or time.monotonic() - node.since < EXPLAIN_AFTER_S:
            return
        silent = [topic for topic in self._needed if not node.count_publishers(topic)]
        if not silent:
            return
        makers = dict.fromkeys(_MAKERS[topic.partition('/')[0]] for topic in silent)
        sentence = (f'nobody publishes {", ".join(map(node.resolve_topic_name, silent))}, so '
                    f'nothing can be done; start {" and ".join(makers)}')
        if silent[0].startswith('views/'):
            sentence += (', with the same parameter cameras in every node (here: '
                         f'{", ".join(self._names)})')
        node.diagnostics.warn('input', 'no_publisher', sentence)

    def _taker(self, join, part, then):
        def take(message):
            self._add(join, part, nanoseconds(message.header.stamp), message, then)
        return take

    def _add(self, join, part, stamp_ns, value, then):
        before = sum(join.drops.values())
        whole = join.add(part, stamp_ns, value)
        dropped = sum(join.drops.values()) - before
        if dropped:
            self._node.diagnostics.count('input', 'incomplete', dropped)
        if whole and self._node.active:
            then(stamp_ns, whole)

    def _observe(self, stamp_ns, parts):
        frames = {name: parts[f'{name}/depth_rect'].header.frame_id for name in self._names}
        try:
            views = tuple(RectifiedView(
                camera_from_messages(name, parts[f'{name}/camera_info'],
                                     parts[f'{name}/extrinsics']),
                depth_from_message(parts[f'{name}/depth_rect'])) for name in self._names)
            observation = observe(views, self._node.parameters['observe'])
        except HoocError as error:
            self._node.diagnostics.error('views', 'refused', str(error))
            return
        self._add(self._whole, 'frames', stamp_ns, frames, self._deliver)
        self._add(self._whole, 'observation', stamp_ns, observation, self._deliver)

    def _deliver(self, stamp_ns, parts):
        self._node.diagnostics.ok('input')
        self._callback(stamp_ns, parts['observation'], parts)
