# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A tf2 frame per object."""

from typing import Any

from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import transform_message
from hooc_perception.ros.outputs.adapters.guard import messages_of
from hooc_perception.ros.outputs.detected import DetectedScene


class ObjectFrames:
    """Publish T_target_object of every object on /tf, once per result, with its stamp."""

    def __init__(self, node: StageNode) -> None:
        """Create the publisher; HoocError without tf2_msgs."""
        self._messages = messages_of('tf2_msgs', 'publish_tf')
        self._publisher = node.publisher(self._messages.TFMessage, '/tf')

    def publish(self, scene: DetectedScene) -> None:
        """Publish the frames of a result."""
        if scene.objects:
            self._publisher.publish(frames_message(scene, self._messages))

    def clear(self, stamp_ns: int, frame: str) -> None:
        """
        Do nothing: tf2 cannot remove a frame.

        A lookup of the latest transform still returns that of an object that is gone, at its
        last stamp; look frames up at the stamp of a result instead.
        """


def frames_message(scene: DetectedScene, messages: Any) -> Any:
    """Return the TFMessage of a result; the target frame is the parent of all objects."""
    return messages.TFMessage(transforms=[
        transform_message(o.translation, o.rotation_xyzw, scene.header, o.name)
        for o in scene.objects])
