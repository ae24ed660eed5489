# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Take back what a dead chain has said: nobody should reach for what nobody watches."""

from geometry_msgs.msg import PoseArray
from hooc_perception.ros.conversions import header
from hooc_perception.ros.point_clouds import cloud_message, row_dtype
from hooc_perception.ros.qos import qos
from hooc_perception.ros.stage_messages import OBJECT_COLUMNS, points_message
import numpy as np
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray


class EmptyAnswer:
    """
    Publish empty objects in place of a parsing node that cannot do it itself.

    :param node: rclpy Node in the namespace of the chain.
    :param frame: the target frame.
    """

    def __init__(self, node, frame):
        """Create the publishers, one for each topic of the answer that anybody knows."""
        self._node, self._frame = node, frame
        self._poses = [self._publisher(PoseArray, topic) for topic in self._pose_topics()]
        self._attributes = self._publisher(PointCloud2, 'objects/attributes')
        self._markers = self._publisher(MarkerArray, 'objects/markers')
        self._unexplained = self._publisher(PointCloud2, 'scene/unexplained')

    def _publisher(self, kind, topic):
        return self._node.create_publisher(kind, topic, qos('objects/poses'))

    def _pose_topics(self):
        """Return objects/<category>/poses of all categories, then objects/poses."""
        prefix = self._node.resolve_topic_name('objects').rstrip('/') + '/'
        known = {topic for topic, _ in self._node.get_topic_names_and_types()
                 if topic.startswith(prefix) and topic.endswith('/poses')}
        return sorted(known - {prefix + 'poses'}) + [prefix + 'poses']

    def publish(self):
        """Say that nothing is known to stand there; `objects/poses` goes last."""
        head = header(self._node.get_clock().now().nanoseconds, self._frame)
        self._attributes.publish(cloud_message(np.zeros(0, row_dtype(OBJECT_COLUMNS)), head))
        self._markers.publish(MarkerArray(markers=[Marker(action=Marker.DELETEALL)]))
        self._unexplained.publish(points_message(np.zeros((0, 3)), head))
        for publisher in self._poses:
            publisher.publish(PoseArray(header=head))

    def close(self):
        """Leave the topics to the parsing node."""
        for publisher in (*self._poses, self._attributes, self._markers, self._unexplained):
            self._node.destroy_publisher(publisher)
