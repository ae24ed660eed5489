# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What viewers and planners keep of the results, for retracting it."""

import json
import re
from typing import Any

from hooc_perception.chain import topic_token
from hooc_perception.errors import HoocError
from hooc_perception.ros.outputs.adapters.guard import messages_of
from hooc_perception.ros.outputs.adapters.planning_scene import diff_message
from hooc_perception.ros.qos import qos
from rclpy.node import Node
from std_msgs.msg import Header, String
from visualization_msgs.msg import Marker, MarkerArray


def optional_messages(package: str) -> Any:
    """Return the module of a message package, None if it is not installed."""
    try:
        return messages_of(package, '')
    except HoocError:
        return None     # the node that needs it reports it


class Displayed:
    """
    Subscribe to the results, and remember what a parsing node that has died cannot retract.

    Its successor does not know it, and starts over with id 1.

    :param node: a node in the namespace of the chain.
    :ivar markers: (ns, id) of the markers.
    :ivar collision_objects: names of our objects in the planning scene.
    :ivar labels: the latest content of `objects/labels`, None before the first.
    """

    def __init__(self, node: Node) -> None:
        """Subscribe to markers and labels; see `watch_planning_scene`."""
        self._node, self._messages = node, None
        self.markers: set[tuple[str, int]] = set()
        self.collision_objects: set[str] = set()
        self.labels: dict[str, Any] | None = None
        node.create_subscription(MarkerArray, 'objects/markers', self._on_markers,
                                 qos('objects/markers'))
        node.create_subscription(String, 'objects/labels', self._on_labels,
                                 qos('objects/labels'))

    def watch_planning_scene(self) -> None:
        """Subscribe to the planning scene as well, if moveit_msgs is installed."""
        if self._messages is None and (messages := optional_messages('moveit_msgs')):
            self._messages = messages
            topic, kind = '/planning_scene', self._messages.PlanningScene
            # Created early: messages that follow at once reach no subscriber.
            self._publisher = self._node.create_publisher(kind, topic, qos(topic))
            self._node.create_subscription(kind, topic, self._on_planning_scene, qos(topic))

    def remove_collision_objects(self, head: Header) -> None:
        """Remove our objects from the planning scene; the echo of the diff updates the set."""
        if self.collision_objects:
            self._publisher.publish(
                diff_message([], sorted(self.collision_objects), head, self._messages))

    def _on_markers(self, message: MarkerArray) -> None:
        for marker in message.markers:
            if marker.action == Marker.DELETEALL:
                self.markers.clear()
            elif marker.action == Marker.DELETE:
                self.markers.discard((marker.ns, marker.id))
            else:
                self.markers.add((marker.ns, marker.id))

    def _on_labels(self, message: String) -> None:
        try:
            content = json.loads(message.data)
        except ValueError:
            return      # not from our nodes
        if isinstance(content, dict):
            self.labels = content

    def _on_planning_scene(self, message: Any) -> None:
        for thing in message.world.collision_objects:
            if thing.operation == thing.REMOVE:
                self.collision_objects.discard(thing.id)
            elif re.fullmatch(re.escape(topic_token(thing.type.key)) + r'_\d+', thing.id):
                # Named like our objects, after the category in their type: not the user's own.
                self.collision_objects.add(thing.id)
