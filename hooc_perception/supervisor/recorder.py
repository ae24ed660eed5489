# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Record what goes over the topics of the chain while a bag is played."""

import time

from geometry_msgs.msg import PoseArray, TransformStamped
from hooc_perception.io.bags.raw_writer import RawBagWriter
from hooc_perception.ros.qos import qos
from rclpy.qos import DurabilityPolicy
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

# Not views/*: large, a function of the raw images, and a reader of the bag would take them for
# further cameras.
_KINDS = {
    '<camera>/depth/image_raw': Image, '<camera>/depth/camera_info': CameraInfo,
    '<camera>/extrinsics': TransformStamped, 'pixels/probabilities': PointCloud2,
    'pixels/<camera>/labels': Image, 'candidates/poses': PoseArray,
    'candidates/attributes': PointCloud2, 'objects/poses': PoseArray,
    'objects/attributes': PointCloud2, 'objects/labels': String, 'objects/markers': MarkerArray,
    'scene/unexplained': PointCloud2, 'scene/summary': String}


class Recorder:
    """Subscribe to all topics of the chain and write them as they come."""

    def __init__(self, node, path, cameras):
        """Start to record; HoocError where the bag exists already."""
        self._node, self._writer = node, RawBagWriter(path)
        self._subscriptions, self._began = [], time.time_ns()
        for row, kind in _KINDS.items():
            for camera in cameras if '<camera>' in row else ('',):
                self._subscribe(row, kind, row.replace('<camera>', camera))

    def close(self):
        """Finish the bag."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._writer.__exit__()

    def _subscribe(self, row, kind, topic):
        name = self._node.resolve_topic_name(topic)
        type_name = f'{kind.__module__.partition(".")[0]}/msg/{kind.__name__}'
        latched = qos(row).durability == DurabilityPolicy.TRANSIENT_LOCAL

        def take(data, info):
            # What is latched of the last scene is not of this one.
            if info['source_timestamp'] >= self._began:
                self._writer.write(name, type_name, data, time.time_ns(), latched)

        self._subscriptions.append(
            self._node.create_subscription(kind, topic, take, qos(row), raw=True))
