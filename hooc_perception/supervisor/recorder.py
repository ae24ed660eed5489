# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Record the topics of the chain while a bag is played."""

from collections.abc import Callable, Mapping
from pathlib import Path
import time
from typing import Any

from geometry_msgs.msg import PoseArray, TransformStamped
from hooc_perception.io.bags.files import iter_messages
from hooc_perception.io.bags.raw_writer import RawBagWriter
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.bags.scene_info import SUFFIX
from hooc_perception.ros.health.silence import type_name
from hooc_perception.ros.qos import qos
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.subscription import Subscription
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

# Not views/*: they are large, follow from the raw images, and would look like further cameras to
# a reader of the bag.
_KINDS: dict[str, Any] = {
    '<camera>/depth/image_raw': Image, '<camera>/depth/camera_info': CameraInfo,
    '<camera>/extrinsics': TransformStamped, 'pixels/probabilities': PointCloud2,
    'pixels/<camera>/labels': Image, 'candidates/poses': PoseArray,
    'candidates/attributes': PointCloud2, 'objects/poses': PoseArray,
    'objects/attributes': PointCloud2, 'objects/labels': String, 'objects/markers': MarkerArray,
    'objects/unknown': PoseArray, 'objects/unknown_attributes': PointCloud2,
    'objects/events': String, 'scene/unexplained': PointCloud2, 'scene/summary': String}


class Recorder:
    """Subscribe to all topics of the chain and write their messages as they arrive."""

    def __init__(self, node: Node, path: Path, bag: BagScene) -> None:
        """
        Start to record what follows from a bag, and what the bag says of its scene.

        :raises HoocError: if there is a bag at `path` already.
        """
        self._node, self._writer = node, RawBagWriter(path)
        self._subscriptions: list[Subscription] = []
        self._began, cameras = time.time_ns(), [camera.name for camera in bag.cameras]
        # No node publishes it.
        for message in iter_messages(bag.path, [t for t in bag.topics if t.endswith(SUFFIX)]):
            self._writer.write(message.topic.name, message.topic.type_name, message.data,
                               self._began, latched=True)
        for row, kind in _KINDS.items():
            for camera in cameras if '<camera>' in row else ('',):
                self._subscribe(row, kind, row.replace('<camera>', camera))

    def close(self) -> None:
        """Finish the bag."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._writer.__exit__()

    def _subscribe(self, row: str, kind: Any, topic: str) -> None:
        name = self._node.resolve_topic_name(topic)
        latched = qos(row).durability == DurabilityPolicy.TRANSIENT_LOCAL

        type_of_kind = type_name(kind)

        def take(data: bytes, info: Mapping[str, int]) -> None:
            # Latched messages of the previous scene do not belong here.
            if info['source_timestamp'] >= self._began:
                self._writer.write(name, type_of_kind, data, time.time_ns(), latched)

        # rclpy's annotation of callbacks leaves out the message info.
        callback: Callable[..., None] = take
        self._subscriptions.append(
            self._node.create_subscription(kind, topic, callback, qos(row), raw=True))
