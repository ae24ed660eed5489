# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Raw images of several cameras -> frame sets of rectified views; every loss is reported."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from geometry_msgs.msg import TransformStamped
from hooc_perception.core.arrays import UInt8Array
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.rectify import rectified_numbers, rectify
from hooc_perception.core.types import Camera, RectifiedView
from hooc_perception.errors import HoocError
from hooc_perception.io.frame_sets import EXPLAINED, FrameSet, FrameSets, SILENT
from hooc_perception.nodes.ingestion_config import IngestionConfig
from hooc_perception.nodes.robot_view import RobotView
from hooc_perception.nodes.warm_up import overhead_camera
from hooc_perception.ros.inputs.image_notes import ImageNotes
from hooc_perception.ros.inputs.joint_states import StateUnknown
from hooc_perception.ros.inputs.raw_frames import FrameRefused, RawFrame, RawFrames
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import nanoseconds
import numpy as np
from sensor_msgs.msg import CameraInfo, Image

# So many frames per camera in a row that fit no others are no accident.
MANY_APART = 4
_WHY_LOST = {True: 'nothing usable comes from it',
             False: 'its stamps are too far from those of the other cameras (max_set_spread_s); '
                    'synchronise the clocks'}


class Assembly:
    """
    Decode raw images and put them together to frame sets.

    :ivar sets: the FrameSets of RawFrame.
    :ivar frames: {camera: RawFrames}, which decode and fuse.
    """

    def __init__(self, node: StageNode[IngestionConfig, Any], names: Sequence[str],
                 robot: RobotView,
                 stated: Mapping[str, Callable[[], ImageNotes]]) -> None:
        """
        Assemble for a StageNode.

        :param robot: sets the robot aside.
        :param stated: {camera: returns what the user states of its images}.
        :raises HoocError: if there are fewer cameras than `min_cameras`.
        """
        self._node, self._names, self._robot = node, tuple(names), robot
        if node.config.min_cameras > len(self._names):
            raise HoocError(self._too_few())
        self.sets: FrameSets[RawFrame] = FrameSets(self._names, node.config)
        self.frames = {name: RawFrames(name, stated[name]) for name in self._names}
        self._apart = 0     # frames that were dropped as `spread` since the last set

    def add(self, name: str, image: Image, info: CameraInfo, transform: TransformStamped,
            observe_config: ObserveConfig) -> str | None:
        """
        Take in one raw image with its calibration and pose.

        :param observe_config: how the image will be observed.
        :return: the reason if this image or another one was dropped, see FrameSets.add.
        """
        config, frames = self._node.config, self.frames[name]
        self.sets.config = config
        try:
            frame = frames.decode(image, info, transform, observe_config)
        except FrameRefused as error:
            self._node.diagnostics.error(name, error.code, f'{error}; the image is dropped')
            return error.code
        lost = self.sets.lost.get(name)
        reason = self.sets.add(name, nanoseconds(image.header.stamp), frame, self._node.now_ns())
        if reason == 'time_jump':
            for other in self.frames.values():
                other.forget()
        if reason in (None, 'superseded', 'time_jump'):
            if lost:
                frames.forget()
            self._remember(name, frame, observe_config)
            if reason != 'time_jump' and name not in self.sets.lost:
                self._node.diagnostics.ok(name)
        return reason

    def _remember(self, name: str, frame: RawFrame, config: ObserveConfig) -> None:
        """Keep a frame for fusion, without the robot: it moves, and should not become a median."""
        frames, fuse = self.frames[name], self._node.config.fuse_frames
        if fuse > 1:
            try:
                frame = self._robot.hide(frame, name, config)
            except StateUnknown:        # reported when its frame set is refused
                frames.forget()
                return
        frames.remember(frame.depth, fuse)

    def take(self) -> FrameSet[RawFrame] | None:
        """Return the next frame set, None while there is none."""
        self.sets.config = self._node.config
        frame_set = self.sets.take(self._node.now_ns())
        if frame_set is not None:
            self._apart = 0
        return frame_set

    def views(self, frame_set: FrameSet[RawFrame], config: ObserveConfig
              ) -> tuple[list[RectifiedView], list[UInt8Array | None]]:
        """
        Rectify a frame set; a lost camera is represented by a view without readings.

        :return: (views in camera order; per camera the (H, W) number of readings that each
            pixel is fused from, None if nothing was fused).
        :raises StateUnknown: if nobody says where the robot was.
        """
        views, counts = [], []
        for name, frame in zip(self._names, frame_set.frames):
            if frame is None:
                views.append(blind_view(name, self.frames[name].camera))
                counts.append(None)
                continue
            frame = self._robot.hide(frame, name, config)
            view, count = self.frames[name].view(frame)
            views.append(rectify(view, config))
            counts.append(None if count is None else rectified_numbers(count, view.camera))
        return views, counts

    def report(self) -> None:
        """Report what was dropped since the last report, and which cameras are left out."""
        drops = self.sets.new_drops()
        self._apart += sum(n for (_, reason), n in drops.items() if reason == 'spread')
        # Free-running cameras lose a frame now and then until the next set; no set is a problem.
        fits = self._apart <= MANY_APART * len(self._names)
        for (name, reason), number in drops.items():
            if reason in EXPLAINED and not (reason == 'spread' and fits):
                self._node.diagnostics.warn(name, reason,
                                            f'a frame is dropped: {EXPLAINED[reason]}')
            else:
                self._node.diagnostics.count(name, reason, number)
        self._report_lost()

    def _report_lost(self) -> None:
        lost, least = self.sets.lost, self._node.config.min_cameras
        left, diagnostics = len(self._names) - len(lost), self._node.diagnostics
        sentence = '; '.join(f'{name} is left out: {_WHY_LOST[reason == SILENT]}'
                             for name, reason in sorted(lost.items()))
        if least > len(self._names):
            diagnostics.error('views', 'too_few_cameras', self._too_few())
        elif left < least:
            diagnostics.error('views', 'too_few_cameras', f'{sentence}; {left} of '
                              f'{len(self._names)} cameras are too few (min_cameras)')
        elif lost:
            diagnostics.warn('views', 'fewer_cameras', f'{sentence}; going on with {left} of '
                             f'{len(self._names)} until it returns')

    def _too_few(self) -> str:
        """Return why no set can ever go out."""
        return (f'min_cameras is {self._node.config.min_cameras}, but the parameter cameras names '
                f'only {len(self._names)} ({", ".join(self._names)}), so no frame set would ever '
                'be sent; lower min_cameras')


def blind_view(name: str, camera: Camera | None) -> RectifiedView:
    """
    Return the RectifiedView without readings of a camera that is not there.

    :param camera: as it was last seen, None if it never was.
    """
    camera = camera or replace(overhead_camera(), name=name)
    nothing = np.full((camera.height, camera.width), np.nan, np.float32)
    return RectifiedView(replace(camera, D=np.zeros(len(camera.D))), nothing)
