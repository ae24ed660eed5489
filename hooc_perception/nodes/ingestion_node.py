# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 1, first half: raw depth images of N cameras -> rectified frame sets."""

from dataclasses import dataclass
import sys

from geometry_msgs.msg import PoseArray
from hooc_perception.core.config import param
from hooc_perception.core.observe import rectify
from hooc_perception.core.types import DepthView
from hooc_perception.errors import HoocError
from hooc_perception.nodes.model import camera_names
from hooc_perception.nodes.warm_up import overhead_camera
from hooc_perception.ros.camera_input import CameraInput, declared_pose, TfPoses
from hooc_perception.ros.conversions import camera_from_messages, depth_from_message, nanoseconds
from hooc_perception.ros.frame_sets import EXPLAINED, FrameSetConfig, FrameSets
from hooc_perception.ros.spin import run_node
from hooc_perception.ros.stage_node import StageConfig, StageNode
from hooc_perception.ros.view_topics import ViewOutput
import numpy as np


@dataclass(frozen=True)
class IngestionConfig(FrameSetConfig, StageConfig):
    """Parameters of the ingestion node."""

    image_reliability: str = param(
        'auto', 'auto asks for reliable images only if every publisher offers it.',
        choices=('auto', 'reliable', 'best_effort'))
    wait_for_answer_s: float = param(
        20.0, 'While somebody publishes objects/poses, the next frame set goes out when the '
        'last one is answered, so that the chain always works on the newest; after this time '
        'it goes out anyway. 0 never waits.', 's', 0.0, 600.0, runtime=True)


class IngestionNode(StageNode):
    """Assemble frame sets, undistort, publish views/*."""

    def __init__(self, **kwargs):
        """Declare parameters."""
        super().__init__('ingestion_node', IngestionConfig(), ('observe',), **kwargs)

    def configure(self):
        """Build the assembly and the endpoints of every camera."""
        self.names = camera_names(self.config)
        if self.config.warm_up:
            rectify(DepthView(overhead_camera(), np.ones((120, 160), np.float32)))
        self.sets = FrameSets(self.names, self.config)
        self.sent = None            # (stamp, node time) of the set that is not answered yet
        self.output = ViewOutput(self, self.names)
        self.subscription(PoseArray, 'objects/poses', self.on_answer)
        tf = TfPoses(self)
        self.inputs = [CameraInput(self, name, declared_pose(self, name), tf, self.on_frame)
                       for name in self.names]
        self.owned(self.destroy_timer, self.create_timer(0.5, self.on_timer))

    def on_frame(self, name, image, info, transform):
        """Take one calibrated raw image; send a set when one is complete."""
        self.sets.config = self.config
        reason = self.sets.add(name, nanoseconds(image.header.stamp), (image, info, transform),
                               self.now_ns())
        if reason == 'time_jump':
            self.sent = None
        if reason is None:
            self.diagnostics.ok(name)
        self.send_if_complete()

    def on_answer(self, message):
        """Note that the chain is free again."""
        if self.sent and nanoseconds(message.header.stamp) >= self.sent[0]:
            self.sent = None
            self.send_if_complete()

    def on_timer(self):
        """Look after what no message triggers."""
        if self.active:
            for camera in self.inputs:
                camera.adapt_reliability()
            self.send_if_complete()

    def send_if_complete(self):
        """Publish the next frame set if there is one and the chain is free for it."""
        frame_set = None if self.chain_is_busy() else self.sets.take(self.now_ns())
        for (name, reason), number in self.sets.new_drops().items():
            if reason in EXPLAINED:
                self.diagnostics.warn(name, reason, f'a frame is dropped: {EXPLAINED[reason]}')
            else:
                self.diagnostics.count(name, reason, number)
        if frame_set is None:
            return
        try:
            views = [rectify(DepthView(camera_from_messages(name, info, transform),
                                       depth_from_message(image)), self.parameters['observe'])
                     for name, (image, info, transform) in zip(self.names, frame_set.frames)]
        except HoocError as error:
            self.diagnostics.error('views', 'unusable_frame', f'{error}; the set is dropped')
            return
        self.sent = (frame_set.stamp_ns, self.now_ns())
        frames = [image.header.frame_id or f'{name}_optical_frame'
                  for name, (image, _, _) in zip(self.names, frame_set.frames)]
        self.output.publish(frame_set.stamp_ns, self.config.target_frame, views, frames)
        self.diagnostics.ok('views', stamp_ns=frame_set.stamp_ns)

    def chain_is_busy(self):
        """Return whether the last set still waits for its answer."""
        wait = self.config.wait_for_answer_s
        if not (self.sent and wait and self.count_publishers('objects/poses')):
            return False
        if self.now_ns() - self.sent[1] < wait * 1e9:
            return True
        self.diagnostics.warn('chain', 'no_answer', f'no objects came for a frame set within '
                              f'{wait:g} s; going on with the next')
        self.sent = None
        return False


def main(args=None):
    """Run the node; return the exit code."""
    return run_node(IngestionNode, args)


if __name__ == '__main__':
    sys.exit(main())
