# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The robot in view: its pixels are set aside in raw frames, or the frame set is refused."""

from collections.abc import Callable, Iterable
from dataclasses import replace
import time
from typing import Any, TYPE_CHECKING

from hooc_perception.core.geometry import transform
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.hidden import hidden_shares, Mesh, with_hidden, without_robot
from hooc_perception.core.types import DepthView, Observation
from hooc_perception.errors import HoocError
from hooc_perception.extras import advice
from hooc_perception.nodes.mask_images import MaskImages
from hooc_perception.nodes.robot_config import RobotConfig
from hooc_perception.nodes.robot_poses import Poses, RobotPoses
from hooc_perception.robot.padding import boxes_of, padded
from hooc_perception.ros.inputs.camera_poses import pose_numbers, TfPoses
from hooc_perception.ros.inputs.joint_states import StateNotYet, StateUnknown
from hooc_perception.ros.inputs.raw_frames import RawFrame
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.qos import qos
import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import String
import trimesh

if TYPE_CHECKING:
    from hooc_perception.robot.description import RobotDescription

# How long a frame set waits for the first joint state after its stamp.
WAIT_S = 0.3


class RobotView:
    """
    Find the robot in raw frames by its URDF, by boxes and by mask images.

    :ivar poses: the RobotPoses.
    """

    def __init__(self, node: StageNode[Any, Any], names: tuple[str, ...], tf: TfPoses,
                 on_state: Callable[[], object] = lambda: None) -> None:
        """
        Listen for a StageNode whose config is a RobotConfig.

        :param names: of the cameras.
        :param on_state: called when a joint state has come.
        :raises HoocError: if the parameters cannot be used.
        """
        self._node, self.poses, self._on_state = node, RobotPoses(node, tf), on_state
        self._robot: RobotDescription | None = None
        self._text = ''                                 # of the URDF that was read last
        self._trouble: StateUnknown | None = None       # why a description cannot be used
        self._padded: tuple[float, dict[str, list[Mesh]]] | None = None
        self._listening = False
        self._until: float | None = None    # monotonic seconds, to wait for a state
        config: RobotConfig = node.config
        # Whether sets are refused without a pose: somebody asked for the mask, or it has worked.
        # A description that merely lies on /robot_description does not stop the chain.
        self._required = bool(config.robot_description or config.robot_boxes
                              or config.robot_pose)
        pose_numbers('robot_pose', config.robot_pose)
        self._boxes: list[trimesh.Trimesh] = _named('robot_boxes', boxes_of, config.robot_boxes)
        self._masks = MaskImages(node, names)
        if config.robot_mask == 'off':
            return
        if config.robot_description:
            self._read(config.robot_description)
        else:
            node.subscription(String, '/robot_description', self._on_description)

    def is_ready(self, frames: Iterable[tuple[str, RawFrame | None]]) -> bool:
        """
        Return whether the robot's state at (camera, frame)s is known, or will not be.

        A state that is still to come is waited for, at most WAIT_S from the first call on.
        """
        now = time.monotonic()
        if any(frame is not None and self._is_coming(frame.stamp_ns, name)
               for name, frame in frames):
            self._until = self._until or now + WAIT_S
            if now < self._until:
                return False
        self._until = None
        return True

    def _is_coming(self, stamp_ns: int, asker: str) -> bool:
        try:
            self._poses(stamp_ns, asker, final=False)
        except StateNotYet:
            return True
        except StateUnknown:
            pass        # `hide` says it
        return False

    def hide(self, frame: RawFrame, asker: str, config: ObserveConfig) -> RawFrame:
        """
        Return a frame whose pixels of the robot have no reading and are `hidden`.

        :param asker: name of its camera.
        :raises StateUnknown: if the robot was somewhere, but nobody says where.
        """
        view = DepthView(frame.camera, frame.depth, frame.hidden)
        mask = self._masks.of(asker, frame.camera)
        if mask is not None:
            view = with_hidden(view, mask)
        try:
            meshes = self._meshes(frame.stamp_ns, asker)
        except StateUnknown as error:
            if self._node.config.robot_unposed == 'refuse' and self._required:
                raise
            self._node.diagnostics.warn('robot', error.code, f'{error}; the frame set is used as '
                                        'it is, and the robot is taken for objects')
            meshes = []
        if meshes:
            self._required = True
            view = without_robot(view, meshes, self._node.config.robot_padding_px, config)
        if view.hidden is frame.hidden:
            return frame
        return replace(frame, depth=view.depth, hidden=view.hidden)

    def check(self, observation: Observation) -> None:
        """Report what the robot hides; StateUnknown if that is too much of the table."""
        if all(view.hidden is None for view in observation.views):
            return
        shares = {view.camera.name: share for view, share in zip(
            observation.views, hidden_shares(observation)) if np.isfinite(share)}
        pixels = sum(int(view.table.sum()) for view in observation.views)
        hidden = sum(int(view.hidden[view.table].sum()) for view in observation.views
                     if view.hidden is not None)
        limit = self._node.config.max_robot_share
        if hidden > limit * pixels:
            raise StateUnknown('robot_hides_too_much', (
                f'the robot hides {hidden / pixels:.0%} of the table, more than max_robot_share '
                f'({limit:.0%}): ' + ', '.join(f'{share:.0%} in {name}' for name, share in
                                               shares.items()) + '; move it aside'))
        self._node.diagnostics.ok('robot', hidden_share=hidden / max(pixels, 1))

    # What is known of the robot.

    def _on_description(self, message: String) -> None:
        """Take the URDF of the topic; what is wrong with it is reported with every frame set."""
        if message.data == self._text:
            return
        try:
            self._read(message.data)
        except HoocError as error:
            self._robot = None
            if isinstance(error.__cause__, ImportError):
                self._node.diagnostics.warn('robot', 'no_urdf_reader', f'{error}; the robot is '
                                            'taken for objects')
                return
            self._trouble = StateUnknown('bad_robot_description', str(error))
            self._node.diagnostics.error('robot', self._trouble.code, str(error))

    def _read(self, text: str) -> None:
        """Read a URDF and listen to its joints; HoocError if it cannot be used."""
        self._text, self._padded = text, None
        try:
            from hooc_perception.robot.description import RobotDescription
        except ImportError as error:
            raise HoocError(f'{advice(error) or error}; it reads robot_description (robot_mask '
                            'off does without)') from error
        self._robot = RobotDescription(text, self._node.config.robot_ignore_links, package_share)
        self._trouble = None
        self._node.diagnostics.ok('robot', name=self._robot.name, links=len(self._robot.shapes))
        if not self._listening:
            self._listening = True
            # Best effort matches every publisher, and an old state is of no use.
            self._node.owned(self._node.destroy_subscription, self._node.create_subscription(
                JointState, '/joint_states', self._node.guarded(self._on_joints),
                qos('/joint_states', reliable=False)))

    def _on_joints(self, message: JointState) -> None:
        self.poses.states.add(message, self._node.now_ns())
        self._on_state()

    # Shapes.

    def _meshes(self, stamp_ns: int, asker: str) -> list[Mesh]:
        """Return the padded meshes in the target frame; StateUnknown as RobotPoses.at."""
        poses = self._poses(stamp_ns, asker, final=True)
        return [(transform(poses[name], vertices), faces)
                for name, meshes in self._shapes().items() for vertices, faces in meshes]

    def _poses(self, stamp_ns: int, asker: str, final: bool) -> Poses:
        """Return the poses of all frames that have a shape; raises as RobotPoses.at."""
        if self._trouble is not None:
            raise self._trouble
        try:
            return self.poses.at(stamp_ns, self._robot, self._shapes(), asker, final)
        except (StateUnknown, StateNotYet):
            raise
        except HoocError as error:
            raise StateUnknown('no_robot_pose', str(error)) from error

    def _shapes(self) -> dict[str, list[Mesh]]:
        """Return {frame: padded meshes}, made anew when the padding changes."""
        config: RobotConfig = self._node.config
        if self._padded is None or self._padded[0] != config.robot_padding_m:
            shapes: dict[str, list[Mesh]] = {}
            if self._robot is not None:
                for name, mesh in self._robot.shapes.items():
                    shapes[name] = padded(mesh, config.robot_padding_m)
            if self._boxes:
                frame = config.robot_boxes_frame or self._node.config.target_frame
                shapes.setdefault(frame, []).extend(
                    mesh for box in self._boxes for mesh in padded(box, config.robot_padding_m))
            self._padded = config.robot_padding_m, shapes
        return self._padded[1]


def package_share(name: str) -> str | None:
    """Return the share folder of an installed ROS package, None if there is none."""
    try:
        from ament_index_python.packages import get_package_share_directory
        return get_package_share_directory(name)
    except (ImportError, LookupError, ValueError):
        return None


def _named(parameter: str, make: Any, value: Any) -> Any:
    """Return make(value); a HoocError names the parameter."""
    try:
        return make(value)
    except (HoocError, TypeError, ValueError) as error:
        raise HoocError(f'parameter {parameter}: {error}') from error
