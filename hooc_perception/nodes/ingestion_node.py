# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 1: raw depth images of N cameras -> observed frame sets."""

from collections.abc import Sequence
from functools import partial
import sys
import time
from typing import Any

from geometry_msgs.msg import TransformStamped
from hooc_perception.chain import INGESTION
from hooc_perception.core.extrinsics.residual import pair_residuals
from hooc_perception.core.incremental.watch import watch, Watched
from hooc_perception.core.segment.checks import table_trouble
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.segment.table import (
    in_table_frame,
    measured,
    radius_m,
    Table,
    TableTracker,
)
from hooc_perception.core.types import DepthView, Observation, RectifiedView
from hooc_perception.errors import HoocError
from hooc_perception.io.frame_sets import FrameSet
from hooc_perception.nodes.assembly import Assembly
from hooc_perception.nodes.ingestion_config import IngestionConfig
from hooc_perception.nodes.model import camera_names
from hooc_perception.nodes.pace import Pace
from hooc_perception.nodes.rig_health import RigHealth
from hooc_perception.nodes.robot_view import RobotView
from hooc_perception.nodes.warm_up import overhead_camera
from hooc_perception.ros.health.playback import Playback
from hooc_perception.ros.inputs.camera_input import CameraInput
from hooc_perception.ros.inputs.camera_poses import PoseParameters, TfPoses
from hooc_perception.ros.inputs.camera_topics import CameraTopics, TopicParameters
from hooc_perception.ros.inputs.image_notes import ImageParameters
from hooc_perception.ros.inputs.joint_states import StateUnknown
from hooc_perception.ros.inputs.raw_frames import RawFrame
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import header
from hooc_perception.ros.outputs.table_output import TableOutput
from hooc_perception.ros.outputs.view_output import ViewOutput
import numpy as np
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header


class IngestionNode(StageNode[IngestionConfig, 'Ingestion']):
    """Assemble frame sets, observe them, publish views/*."""

    CONFIG = IngestionConfig

    def __init__(self, **kwargs: Any) -> None:
        """Declare parameters."""
        super().__init__(INGESTION, **kwargs)
        self.poses, self.topics = PoseParameters(self), TopicParameters(self)
        self.images = ImageParameters(self)

    @property
    def observe_config(self) -> ObserveConfig:
        """Return the parameters of stage 1 as they are now."""
        return self.parameters.get('observe', ObserveConfig)

    def configure(self) -> 'Ingestion':
        """Build the assembly and the endpoints of every camera."""
        return Ingestion(self)

    def activate(self) -> None:
        """Begin to listen."""
        self.work.begin()


class Ingestion:
    """
    The work of a configured ingestion node.

    :ivar assembly: the Assembly of frame sets.
    :ivar robot: the RobotView that sets the robot aside.
    :ivar pace: the Pace at which they are sent.
    :ivar output: the ViewOutput that they are sent by.
    :ivar inputs: one CameraInput per camera.
    :ivar number: of the sets that were sent.
    """

    def __init__(self, node: IngestionNode) -> None:
        """Build everything on the node."""
        self._node, self._names = node, camera_names(node)
        self._tf = TfPoses(node)
        self.robot = RobotView(node, self._names, self._tf, self._on_robot_state)
        for name in self._names:
            node.poses.declare(name)
            node.topics.declare(name)
            node.images.declare(name)
        topics = self._topics()
        self.assembly = Assembly(node, self._names, self.robot, {
            name: partial(node.images.notes, name, node.resolve_topic_name(t.image))
            for name, t in topics.items()})
        # A set that waits for the state of the robot at its stamps.
        self._held: FrameSet[RawFrame] | None = None
        if node.config.warm_up:
            flat = DepthView(overhead_camera(), np.ones((120, 160), np.float32))
            pair_residuals(observe([rectify(flat, node.observe_config)] * 2,
                                   node.observe_config))
        # What earlier frame sets have shown; None = nothing.
        self._watched: Watched | None = None
        self.number = 0            # of sets that were sent
        self.output = ViewOutput(node, self._names)
        self._table, self._table_output = TableTracker(), TableOutput(node)
        self._refused = node.publisher(Header, 'views/refused')
        self.pace = Pace(node, self._send_if_complete)
        self._rig_health = RigHealth(node)
        self._playback = Playback(node)
        self.inputs = [CameraInput(node, name, t, node.poses, self._tf, self._on_frame)
                       for name, t in topics.items()]
        node.steady_timer(0.5, self._on_timer)

    def _topics(self) -> dict[str, CameraTopics]:
        """Return the topics of each camera; HoocError if two cameras have the same images."""
        node = self._node
        topics = {name: node.topics.topics(name, node.config.camera_driver)
                  for name in self._names}
        cameras = {t.image: name for name, t in topics.items()}
        for name, t in topics.items():
            if cameras[t.image] != name:
                raise HoocError(f'the cameras {name} and {cameras[t.image]} have the same images, '
                                f'{t.image}; set image_topic.{name}')
        return topics

    def begin(self) -> None:
        """Begin to listen; what was heard before does not count."""
        self.assembly.sets.clear()
        self.pace.forget()
        self._held = self._watched = None
        for camera in self.inputs:
            camera.begin()

    def _on_frame(self, name: str, image: Image, info: CameraInfo,
                  transform: TransformStamped) -> None:
        """Take in one calibrated raw image; send a set if one is complete."""
        reason = self.assembly.add(name, image, info, transform,
                                   self._node.observe_config)
        if reason == 'time_jump':
            self._watched = None
            self.pace.forget()
            self._tf.clear()
        self._send_if_complete()

    def _on_timer(self) -> None:
        """Do what no message triggers."""
        if self._node.active:
            for camera in self.inputs:
                camera.adapt_reliability()
                self._explain(camera)
            self._send_if_complete()

    def _explain(self, camera: CameraInput) -> None:
        """Report why a camera is silent, if it is."""
        patience = self._node.config.explain_after_s
        if not patience:
            return
        if self._playback.ended_since(camera.heard):
            self._node.diagnostics.state(camera.name, 'bag_ended', 'the bag has been played')
            return
        silent_s = time.monotonic() - camera.heard
        trouble = camera.silence() if silent_s > patience else camera.info_silence()
        if trouble and time.monotonic() - self._node.since > patience:
            self._node.diagnostics.warn(camera.name, *trouble)

    def _send_if_complete(self) -> None:
        """Publish the next frame set if there is one and the chain is free for it."""
        busy = self.pace.is_busy(self._node.config.wait_for_answer_s)
        frame_set = self._held or (None if busy else self.assembly.take())
        self.assembly.report()
        if frame_set is not None:
            ready = self.robot.is_ready(zip(self._names, frame_set.frames))
            self._held = None if ready else frame_set
            if ready:
                self._send(frame_set)

    def _on_robot_state(self) -> None:
        """Send the set that waited for it."""
        if self._held is not None and self._node.active:
            self._send_if_complete()

    def _send(self, frame_set: FrameSet[RawFrame]) -> None:
        """Observe a frame set and publish it, or refuse it."""
        node, head = self._node, header(frame_set.stamp_ns, self._node.config.target_frame)
        start, code = time.monotonic(), 'unusable_frame'
        try:
            views, counts = self.assembly.views(frame_set, node.observe_config)
            code = 'refused'
            table = self._table.update(views, node.observe_config)
            observation = self._observed(views, table)
            self.robot.check(observation)
        except HoocError as error:
            thing, code = (('robot', error.code) if isinstance(error, StateUnknown)
                           else ('views', code))
            node.diagnostics.error(thing, code, f'{error}; the set is dropped')
            self._refused.publish(head)
            return
        except Exception:
            self._refused.publish(head)
            raise
        self.pace.sent(frame_set.stamp_ns)
        frames = [(frame and frame.frame_id) or f'{name}_optical_frame'
                  for name, frame in zip(self._names, frame_set.frames)]
        self.output.publish(head, observation, views, frames, counts)
        self.number += 1
        node.diagnostics.ok(
            'views', stamp_ns=frame_set.stamp_ns, sets=self.number,
            cameras=sum(frame is not None for frame in frame_set.frames),
            seconds=time.monotonic() - start)
        self._report_table(table, views, frame_set, head)
        self._rig_health.check(observation)

    def _observed(self, views: Sequence[RectifiedView], table: Table) -> Observation:
        """Return the observation of a frame set, with the readings of those before it."""
        config, T = self._node.observe_config, table.T_target_table
        if not self._node.config.incremental:
            self._watched = None
            return observe(views, config, T)
        self._watched = watch(views, self._watched, config, T)
        return self._watched.observation

    def _report_table(self, table: Table, views: Sequence[RectifiedView],
                      frame_set: FrameSet[RawFrame], head: Header) -> None:
        """Publish where the table is, if it moved and now and then; name who does not see it."""
        config, output = self._node.observe_config, self._table_output
        if not output.due and not output.moved(table):
            return
        output.publish(measured(table, views, config) if output.due else table, head)
        troubles = {view.camera.name: table_trouble(view, config.table_band_m, radius_m(config))
                    for view, frame in zip(in_table_frame(views, table.T_target_table),
                                           frame_set.frames) if frame is not None}
        for name, trouble in troubles.items():
            if trouble:
                self._node.diagnostics.warn(name, 'no_table', trouble)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return the exit code."""
    return run_node(IngestionNode, args)


if __name__ == '__main__':
    sys.exit(main())
