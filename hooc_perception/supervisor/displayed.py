# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What viewers and planners keep of the answers, for whoever has to take it back."""

import json
import re

from hooc_perception.chain import topic_token
from hooc_perception.errors import HoocError
from hooc_perception.ros.outputs.adapters.guard import messages_of
from hooc_perception.ros.outputs.adapters.planning_scene import diff_message
from hooc_perception.ros.qos import qos
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray


def optional_messages(package):
    """Return the module of a message package, None where no node can speak its language."""
    try:
        return messages_of(package, '')
    except HoocError:
        return None     # the node that needs it has said so


class Displayed:
    """
    Listen to the answers, and remember what a parsing node that is gone cannot take back.

    A new one would not know it, and its ids begin with 1 again.

    :param node: rclpy Node in the namespace of the chain.
    :ivar markers: set of (ns, id).
    :ivar collision_objects: set of the names that our objects have in the planning scene.
    :ivar labels: the latest content of `objects/labels`, None before any.
    """

    def __init__(self, node):
        """Subscribe to what everybody can; see `watch_planning_scene`."""
        self._node, self._messages = node, None
        self.markers, self.collision_objects, self.labels = set(), set(), None
        for kind, topic, take in ((MarkerArray, 'objects/markers', self._on_markers),
                                  (String, 'objects/labels', self._on_labels)):
            node.create_subscription(kind, topic, take, qos(topic))

    def watch_planning_scene(self):
        """Mind the planning scene as well."""
        if self._messages is None and (messages := optional_messages('moveit_msgs')):
            self._messages = messages
            topic, kind = '/planning_scene', self._messages.PlanningScene
            # Made early: what is said the moment that a publisher is made reaches nobody.
            self._publisher = self._node.create_publisher(kind, topic, qos(topic))
            self._node.create_subscription(kind, topic, self._on_planning_scene, qos(topic))

    def remove_collision_objects(self, head):
        """Remove from the planning scene what is still in there; heard, it is forgotten."""
        if self.collision_objects:
            self._publisher.publish(
                diff_message([], sorted(self.collision_objects), head, self._messages))

    def _on_markers(self, message):
        for marker in message.markers:
            if marker.action == Marker.DELETEALL:
                self.markers.clear()
            elif marker.action == Marker.DELETE:
                self.markers.discard((marker.ns, marker.id))
            else:
                self.markers.add((marker.ns, marker.id))

    def _on_labels(self, message):
        try:
            content = json.loads(message.data)
        except ValueError:
            return      # not of our nodes
        if isinstance(content, dict):
            self.labels = content

    def _on_planning_scene(self, message):
        for thing in message.world.collision_objects:
            if thing.operation == thing.REMOVE:
                self.collision_objects.discard(thing.id)
            elif re.fullmatch(re.escape(topic_token(thing.type.key)) + r'_\d+', thing.id):
                # Named as ours are, whose type says the category: not the user's own.
                self.collision_objects.add(thing.id)
