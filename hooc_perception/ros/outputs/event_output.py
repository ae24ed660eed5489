# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The topic objects/events: what happened to the objects from one result to the next."""

from collections.abc import Sequence
import json
from typing import Any

from hooc_perception.core.parsing.events import Event
from hooc_perception.ros.lifecycle.stage_node import StageNode
from std_msgs.msg import String


class EventOutput:
    """Publish events as JSON; a late subscriber gets the last ones."""

    def __init__(self, node: StageNode[Any, Any]) -> None:
        """Create the publisher."""
        self._node = node
        self._events = node.publisher(String, 'objects/events')

    def publish(self, stamp_ns: int, events: Sequence[Event]) -> None:
        """Publish the events of one result; nothing where nothing happened."""
        if events:
            self._events.publish(String(data=events_json(
                stamp_ns, self._node.config.target_frame, events)))


def events_json(stamp_ns: int, frame: str, events: Sequence[Event]) -> str:
    """Return the text of `objects/events`."""
    return json.dumps({'format': 'hooc-events/1', 'stamp_ns': stamp_ns, 'frame': frame,
                       'events': [event.to_dict() for event in events]})
