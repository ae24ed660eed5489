# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Retract the results of a dead pipeline so that no client acts on stale poses."""

import json
from typing import Any

from geometry_msgs.msg import PoseArray
from hooc_perception.ros.outputs.adapters.detections import detections_message
from hooc_perception.ros.outputs.detected import DetectedScene
from hooc_perception.ros.outputs.object_output import empty_clouds, empty_unknown, summary_json
from hooc_perception.ros.qos import qos
from hooc_perception.supervisor.displayed import Displayed, optional_messages
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header, String
from visualization_msgs.msg import Marker, MarkerArray


class Retraction:
    """
    Publish empty results on behalf of a parsing node that has died.

    :param node: a node in the namespace of the chain; its clock stamps the messages.
    :param displayed: what has to be retracted one by one.
    :param detections: whether `objects/detections` is one of the topics.
    """

    def __init__(self, node: Node, displayed: Displayed, detections: bool = False) -> None:
        """Create one publisher per topic of the results."""
        self._node, self._displayed = node, displayed
        self._made: list[Publisher] = []
        # All markers that were ever displayed: subscribers may come late.
        self._markers: set[tuple[str, int]] = set()
        self._detections = optional_messages('vision_msgs') if detections else None
        self._topics = {topic: self._publisher(kind, topic) for kind, topic in (
            (String, 'objects/labels'), (PointCloud2, 'objects/attributes'),
            (PoseArray, 'objects/unknown'), (PointCloud2, 'objects/unknown_attributes'),
            (MarkerArray, 'objects/markers'), (PointCloud2, 'scene/unexplained'),
            (String, 'scene/summary'))}
        if self._detections:
            self._topics['objects/detections'] = self._publisher(
                self._detections.Detection3DArray, 'objects/detections')
        self._poses = [self._publisher(PoseArray, topic) for topic in self._pose_topics()]

    def _publisher(self, kind: Any, topic: str) -> Publisher:
        self._made.append(self._node.create_publisher(kind, topic, qos('objects/poses')))
        return self._made[-1]

    def _pose_topics(self) -> list[str]:
        """Return objects/<category>/poses of all categories, then objects/poses."""
        prefix = self._node.resolve_topic_name('objects').rstrip('/') + '/'
        known = {topic for topic, _ in self._node.get_topic_names_and_types()
                 if topic.startswith(prefix) and topic.endswith('/poses')}
        return sorted(known - {prefix + 'poses'}) + [prefix + 'poses']

    def publish(self, frame: str) -> None:
        """Publish empty results in the target frame; `objects/poses` goes last."""
        scene = DetectedScene(self._node.get_clock().now().nanoseconds, frame, ())
        head, displayed = scene.header, self._displayed
        attributes, unexplained = empty_clouds(head)
        messages = {
            'objects/attributes': attributes,
            'objects/unknown_attributes': empty_unknown(head),
            'objects/unknown': PoseArray(header=head),
            'objects/markers': self._markers_message(head),
            'scene/unexplained': unexplained,
            'scene/summary': String(data=summary_json(None, scene.stamp_ns))}
        if displayed.labels is not None:
            messages['objects/labels'] = String(
                data=json.dumps({**displayed.labels, 'objects': {}}))
        if self._detections:
            messages['objects/detections'] = detections_message(scene, self._detections)
        for topic, message in messages.items():
            self._topics[topic].publish(message)
        displayed.remove_collision_objects(head)
        for publisher in self._poses:
            publisher.publish(PoseArray(header=head))

    def _markers_message(self, head: Header) -> MarkerArray:
        """Return DELETEALL, for unknown markers, followed by DELETE for the known ones."""
        self._markers |= self._displayed.markers
        return MarkerArray(markers=[Marker(header=head, action=Marker.DELETEALL)] + [
            Marker(header=head, ns=ns, id=number, action=Marker.DELETE)
            for ns, number in sorted(self._markers)])

    def close(self) -> None:
        """Leave the topics to the parsing node."""
        for publisher in self._made:
            self._node.destroy_publisher(publisher)
