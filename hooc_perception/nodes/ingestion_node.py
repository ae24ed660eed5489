# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 1, first half: raw depth images of N cameras -> rectified frame sets."""

from dataclasses import dataclass, replace
import sys
import time

from geometry_msgs.msg import PoseArray
from hooc_perception.chain import INGESTION, STAGES_OF
from hooc_perception.core.config import param
from hooc_perception.core.segment.checks import table_trouble
from hooc_perception.core.segment.rectify import rectified_numbers, rectify
from hooc_perception.core.types import DepthView, RectifiedView
from hooc_perception.errors import HoocError
from hooc_perception.io.frame_sets import EXPLAINED, FrameSetConfig, FrameSets, SILENT
from hooc_perception.nodes.model import camera_names
from hooc_perception.nodes.warm_up import overhead_camera
from hooc_perception.ros.inputs.camera_input import CameraInput
from hooc_perception.ros.inputs.camera_poses import PoseParameters, TfPoses
from hooc_perception.ros.inputs.raw_frames import FrameRefused, RawFrames
from hooc_perception.ros.inputs.view_topics import ViewOutput
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_node import StageConfig, StageNode
from hooc_perception.ros.messages.conversions import nanoseconds
import numpy as np
from std_msgs.msg import Header

# The table does not come and go: it is looked for at most so often.
LOOK_FOR_TABLE_S = 5.0


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
    fuse_frames: int = param(
        1, 'Median of the last so many frames of each camera, against noise, for scenes that '
        'stand still; an odd number is best. Where the depth changes it begins anew. 1 = off.',
        '', 1, 30, runtime=True)
    explain_after_s: float = param(
        3.0, 'A camera from which nothing comes is explained after this time, and again while '
        'it stays silent; 0 = never.', 's', 0.0, 3600.0, runtime=True)


class IngestionNode(StageNode):
    """Assemble frame sets, undistort, publish views/*."""

    def __init__(self, **kwargs):
        """Declare parameters."""
        super().__init__(INGESTION, IngestionConfig(), STAGES_OF[INGESTION], **kwargs)
        self.poses = PoseParameters(self)

    def configure(self):
        """Build the assembly and the endpoints of every camera."""
        self.names = camera_names(self)
        if self.config.min_cameras > len(self.names):
            raise HoocError(self.too_few())
        if self.config.warm_up:
            rectify(DepthView(overhead_camera(), np.ones((120, 160), np.float32)))
        self.sets = FrameSets(self.names, self.config)
        self.frames = {name: RawFrames(name) for name in self.names}
        self.sent = None            # (stamp, monotonic s) of the set that is not answered yet
        self.number = 0             # of sets that went out
        self.table_seen = -LOOK_FOR_TABLE_S
        self.output = ViewOutput(self, self.names)
        self.subscription(PoseArray, 'objects/poses', self.on_answer)
        self.subscription(Header, 'views/refused', self.on_refused)
        for name in self.names:
            self.poses.declare(name)
        self.tf = TfPoses(self)
        self.inputs = [CameraInput(self, name, self.poses, self.tf, self.on_frame)
                       for name in self.names]
        self.steady_timer(0.5, self.on_timer)

    def activate(self):
        """Begin to listen; what was heard before does not count."""
        self.sets.clear()
        self.sent = None
        for camera in self.inputs:
            camera.begin()

    def on_frame(self, name, image, info, transform):
        """Take one calibrated raw image; send a set when one is complete."""
        self.sets.config = self.config
        frames = self.frames[name]
        try:
            frame = frames.decode(image, info, transform, self.parameters['observe'].max_depth_m)
        except FrameRefused as error:
            self.diagnostics.error(name, error.code, f'{error}; the image is dropped')
            self.send_if_complete()
            return
        lost = self.sets.lost.get(name)
        reason = self.sets.add(name, nanoseconds(image.header.stamp), frame, self.now_ns())
        if reason == 'time_jump':
            self.sent = None
            self.tf.clear()
            for other in self.frames.values():
                other.forget()
        if reason in (None, 'superseded', 'time_jump'):
            if lost:
                frames.forget()
            frames.remember(frame.depth, self.config.fuse_frames)
            if reason != 'time_jump' and name not in self.sets.lost:
                self.diagnostics.ok(name)
        self.send_if_complete()

    def on_answer(self, message):
        """Note that the chain is free again."""
        if self.sent and nanoseconds(message.header.stamp) >= self.sent[0]:
            self.sent = None
            self.diagnostics.ok('chain')
            self.send_if_complete()

    def on_refused(self, message):
        """Note that the last set will not be answered; the stage that refused it says why."""
        if self.sent and nanoseconds(message.stamp) == self.sent[0]:
            self.sent = None
            self.diagnostics.count('chain', 'refused')
            self.send_if_complete()

    def on_timer(self):
        """Look after what no message triggers."""
        if self.active:
            self.sets.config = self.config
            for camera in self.inputs:
                camera.adapt_reliability()
                self.explain(camera)
            self.send_if_complete()

    def explain(self, camera):
        """Say why nothing comes of a camera, if so."""
        patience = self.config.explain_after_s
        if not patience:
            return
        silent_s = time.monotonic() - camera.heard
        trouble = camera.silence() if silent_s > patience else camera.info_silence()
        if trouble and time.monotonic() - self.since > patience:
            self.diagnostics.warn(camera.name, *trouble)

    def send_if_complete(self):
        """Publish the next frame set if there is one and the chain is free for it."""
        frame_set = None if self.chain_is_busy() else self.sets.take(self.now_ns())
        for (name, reason), number in self.sets.new_drops().items():
            if reason in EXPLAINED:
                self.diagnostics.warn(name, reason, f'a frame is dropped: {EXPLAINED[reason]}')
            else:
                self.diagnostics.count(name, reason, number)
        self.tell_of_lost()
        if frame_set is None:
            return
        try:
            views, counts = self.rectified(frame_set)
        except HoocError as error:
            self.diagnostics.error('views', 'unusable_frame', f'{error}; the set is dropped')
            return
        self.sent = (frame_set.stamp_ns, time.monotonic())
        frames = [(frame and frame.frame_id) or f'{name}_optical_frame'
                  for name, frame in zip(self.names, frame_set.frames)]
        self.output.publish(frame_set.stamp_ns, self.config.target_frame, views, frames, counts)
        self.number += 1
        there = sum(frame is not None for frame in frame_set.frames)
        self.diagnostics.ok('views', stamp_ns=frame_set.stamp_ns, sets=self.number, cameras=there)
        self.look_for_table(views, frame_set)

    def rectified(self, frame_set):
        """Return the RectifiedViews of a set, a blind one for each lost camera, and counts."""
        views, counts = [], []
        for name, frame in zip(self.names, frame_set.frames):
            if frame is None:
                views.append(blind_view(name, self.frames[name].camera))
                counts.append(None)
                continue
            view, count = self.frames[name].view(frame)
            views.append(rectify(view, self.parameters['observe']))
            counts.append(count if count is None else rectified_numbers(count, view.camera))
        return views, counts

    def tell_of_lost(self):
        """Say which cameras the sets go without, and where too few are left for any set."""
        lost = self.sets.lost
        left = len(self.names) - len(lost)
        why = {True: 'nothing usable comes from it', False: 'its stamps are too far from those '
               'of the other cameras (max_set_spread_s); synchronise the clocks'}
        sentence = '; '.join(f'{name} is left out: {why[reason == SILENT]}'
                             for name, reason in sorted(lost.items()))
        if self.config.min_cameras > len(self.names):
            self.diagnostics.error('views', 'too_few_cameras', self.too_few())
        elif left < self.config.min_cameras:
            self.diagnostics.error('views', 'too_few_cameras', f'{sentence}; {left} of '
                                   f'{len(self.names)} cameras are too few (min_cameras)')
        elif lost:
            self.diagnostics.warn('views', 'fewer_cameras', f'{sentence}; going on with {left} '
                                  f'of {len(self.names)} until it returns')

    def too_few(self):
        """Return why no set can ever go out."""
        return (f'min_cameras is {self.config.min_cameras}, but the parameter cameras names only '
                f'{len(self.names)} ({", ".join(self.names)}), so no frame set would ever go out; '
                'lower min_cameras')

    def look_for_table(self, views, frame_set):
        """Say now and then which cameras do not see the table where it should be."""
        if time.monotonic() - self.table_seen < LOOK_FOR_TABLE_S:
            return
        self.table_seen = time.monotonic()
        config = self.parameters['observe']
        troubles = {view.camera.name: table_trouble(view, config.table_band_m,
                                                    config.workspace_radius_m)
                    for view, frame in zip(views, frame_set.frames) if frame is not None}
        for name, trouble in troubles.items():
            if trouble:
                self.diagnostics.warn(name, 'no_table', trouble)

    def chain_is_busy(self):
        """Return whether the last set still waits for its answer."""
        wait = self.config.wait_for_answer_s
        if not (self.sent and wait and self.count_publishers('objects/poses')):
            return False
        # Not by the node's clock: that may be set back, or stand still.
        if time.monotonic() - self.sent[1] < wait:
            return True
        self.diagnostics.warn('chain', 'no_answer', f'no objects came for a frame set within '
                              f'{wait:g} s; is a later node at work for longer, or '
                              'not active, or parsing disabled? going on with the next')
        self.sent = None
        return False


def blind_view(name, camera):
    """Return the RectifiedView without readings of a camera that is not there."""
    camera = camera or replace(overhead_camera(), name=name)
    nothing = np.full((camera.height, camera.width), np.nan, np.float32)
    return RectifiedView(replace(camera, D=np.zeros(len(camera.D))), nothing)


def main(args=None):
    """Run the node; return the exit code."""
    return run_node(IngestionNode, args)


if __name__ == '__main__':
    sys.exit(main())
