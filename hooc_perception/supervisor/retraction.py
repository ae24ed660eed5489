# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Take back what a dead chain has said: nobody should reach for what nobody watches."""

import json

from geometry_msgs.msg import PoseArray
from hooc_perception.ros.outputs.adapters.detections import detections_message
from hooc_perception.ros.outputs.detected import DetectedScene
from hooc_perception.ros.outputs.object_output import empty_clouds, summary_json
from hooc_perception.ros.qos import qos
from hooc_perception.supervisor.displayed import optional_messages
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray


class Retraction:
    """
    Publish empty objects in place of a parsing node that cannot do it itself.

    :param node: rclpy Node in the namespace of the chain, by whose clock they are stamped.
    :param shown: the Displayed that remembers what has to be taken back one by one.
    :param detections: whether `objects/detections` is one of the topics.
    """

    def __init__(self, node, shown, detections=False):
        """Create the publishers, one for each topic of the answer that anybody knows."""
        self._node, self._shown, self._made = node, shown, []
        self._markers = set()       # all that ever have to go: subscribers come late
        self._detections = optional_messages('vision_msgs') if detections else None
        self._topics = {topic: self._publisher(kind, topic) for kind, topic in (
            (String, 'objects/labels'), (PointCloud2, 'objects/attributes'),
            (MarkerArray, 'objects/markers'), (PointCloud2, 'scene/unexplained'),
            (String, 'scene/summary'))}
        if self._detections:
            self._topics['objects/detections'] = self._publisher(
                self._detections.Detection3DArray, 'objects/detections')
        self._poses = [self._publisher(PoseArray, topic) for topic in self._pose_topics()]

    def _publisher(self, kind, topic):
        self._made.append(self._node.create_publisher(kind, topic, qos('objects/poses')))
        return self._made[-1]

    def _pose_topics(self):
        """Return objects/<category>/poses of all categories, then objects/poses."""
        prefix = self._node.resolve_topic_name('objects').rstrip('/') + '/'
        known = {topic for topic, _ in self._node.get_topic_names_and_types()
                 if topic.startswith(prefix) and topic.endswith('/poses')}
        return sorted(known - {prefix + 'poses'}) + [prefix + 'poses']

    def publish(self, frame):
        """Say that nothing is known to stand in the target frame; `objects/poses` goes last."""
        scene = DetectedScene(self._node.get_clock().now().nanoseconds, frame, ())
        head, shown = scene.header, self._shown
        attributes, unexplained = empty_clouds(head)
        messages = {
            'objects/attributes': attributes,
            'objects/markers': self._markers_message(head),
            'scene/unexplained': unexplained,
            'scene/summary': String(data=summary_json(None, scene.stamp_ns))}
        if shown.labels is not None:
            messages['objects/labels'] = String(data=json.dumps({**shown.labels, 'objects': {}}))
        if self._detections:
            messages['objects/detections'] = detections_message(scene, self._detections)
        for topic, message in messages.items():
            self._topics[topic].publish(message)
        shown.remove_collision_objects(head)
        for publisher in self._poses:
            publisher.publish(PoseArray(header=head))

    def _markers_message(self, head):
        """Return DELETE for all that was shown, behind DELETEALL for what nobody has seen."""
        self._markers |= self._shown.markers
        return MarkerArray(markers=[Marker(header=head, action=Marker.DELETEALL)] + [
            Marker(header=head, ns=ns, id=number, action=Marker.DELETE)
            for ns, number in sorted(self._markers)])

    def close(self):
        """Leave the topics to the parsing node."""
        for publisher in self._made:
            self._node.destroy_publisher(publisher)
