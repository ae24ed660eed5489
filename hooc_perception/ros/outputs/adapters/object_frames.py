# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""tf2: a frame for every object."""

from hooc_perception.ros.messages.conversions import transform_message
from hooc_perception.ros.outputs.adapters.guard import messages_of


class ObjectFrames:
    """Send T_target_object of every object on /tf, once an answer, with its stamp."""

    def __init__(self, node):
        """Create the publisher on a StageNode; HoocError without tf2_msgs."""
        self._messages = messages_of('tf2_msgs', 'publish_tf')
        self._publisher = node.publisher(self._messages.TFMessage, '/tf')

    def publish(self, scene):
        """Send the frames of a DetectedScene."""
        if scene.objects:
            self._publisher.publish(frames_message(scene, self._messages))

    def clear(self, stamp_ns, frame):
        """
        Do nothing: tf2 has no way to take a frame back.

        The frame of an object that is gone stays to be found at its last stamp, also by who
        asks for the latest; look it up at the stamp of an answer instead.
        """


def frames_message(scene, messages):
    """Return the TFMessage of a DetectedScene: the target frame is the parent of all objects."""
    return messages.TFMessage(transforms=[
        transform_message(o.translation, o.rotation_xyzw, scene.header, o.name)
        for o in scene.objects])
