# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where the links of the robot were at a stamp: by forward kinematics, or by tf."""

from collections.abc import Iterable
from typing import Any, TYPE_CHECKING

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import inverse, matrix_from_pose
from hooc_perception.nodes.robot_config import RobotConfig
from hooc_perception.ros.inputs.camera_poses import PoseNotYet, TfPoses
from hooc_perception.ros.inputs.joint_states import JointStates, StateNotYet, StateUnknown
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import pose_of_transform, time_message
import numpy as np

if TYPE_CHECKING:
    from hooc_perception.robot.description import RobotDescription

Poses = dict[str, Float64Array]


class RobotPoses:
    """
    Poses of links and frames in the target frame at any stamp of the last moments.

    Joint states win over tf: their stamps are the robot's own.

    :ivar states: the JointStates that were heard.
    """

    def __init__(self, node: StageNode[Any, Any], tf: TfPoses) -> None:
        """Look up frames in the TfPoses of a StageNode whose config is a RobotConfig."""
        self._node, self._tf, self.states = node, tf, JointStates()

    def at(self, stamp_ns: int, robot: 'RobotDescription | None', frames: Iterable[str],
           asker: str, final: bool) -> Poses:
        """
        Return {frame: T_target_frame (4, 4)}.

        :param robot: whose links may be among the frames.
        :param asker: name of the camera whose image has that stamp.
        :param final: take the last joint state if none after the stamp has come.
        :raises StateNotYet: if that is still to come.
        :raises StateUnknown: if nobody says it; with the reason and its fix.
        """
        target = self._node.config.target_frame
        links = [name for name in frames if robot is not None and name in robot.links]
        poses: Poses = {target: np.eye(4)}
        if robot is not None and links:
            poses.update(self._links(stamp_ns, robot, links, asker, final))
        for name in frames:
            if name not in poses:
                poses[name] = self._frame(name, stamp_ns, asker, final)
        return poses

    def _links(self, stamp_ns: int, robot: 'RobotDescription', links: list[str], asker: str,
               final: bool) -> Poses:
        """Return the poses of links of the robot."""
        if not set(robot.joints) <= self.states.names or robot.unposable:
            found = {name: self._by_tf(name, stamp_ns, asker, final) for name in links}
            known = {name: T for name, T in found.items() if T is not None}
            if len(known) == len(links):
                return known
            if robot.unposable:
                robot.link_poses({})        # says that only tf can help
        config: RobotConfig = self._node.config
        positions = self.states.at(stamp_ns, robot.joints, int(config.robot_state_age_s * 1e9),
                                   final)
        T_root_links = robot.link_poses(positions)
        T = self._root(T_root_links, robot.root, stamp_ns, asker, final)
        return {name: T @ T_root_links[name] for name in links}

    def _root(self, T_root_links: Poses, root: str, stamp_ns: int, asker: str,
              final: bool) -> Float64Array:
        """Return T_target_root."""
        config, target = self._node.config, self._node.config.target_frame
        if config.robot_pose:
            return matrix_from_pose(config.robot_pose[:3], config.robot_pose[3:])
        if target in T_root_links:
            return inverse(T_root_links[target])
        T = self._by_tf(root, stamp_ns, asker, final)
        if T is None:
            raise StateUnknown('no_robot_pose', f'nobody says where {root}, the root link of the '
                               f'robot, stands in {target}: set robot_pose, or publish that on '
                               '/tf or /tf_static')
        return T

    def _frame(self, name: str, stamp_ns: int, asker: str, final: bool) -> Float64Array:
        """Return T_target_frame of a frame that is no link."""
        T = self._by_tf(name, stamp_ns, asker, final)
        if T is None:
            raise StateUnknown('no_robot_pose', f'nobody says where {name} (robot_boxes_frame) is '
                               f'in {self._node.config.target_frame}: publish that on /tf, or '
                               'correct the name')
        return T

    def _by_tf(self, name: str, stamp_ns: int, asker: str, final: bool) -> Float64Array | None:
        """Return T_target_frame by tf, None if tf knows nothing of it."""
        try:
            found = self._tf.lookup(self._node.config.target_frame, name, time_message(stamp_ns),
                                    asker)
        except PoseNotYet as error:
            if final:
                raise StateUnknown('old_robot_pose', f'/tf does not say where {name} was at the '
                                   'stamp of the image; synchronise the clocks, and publish tf '
                                   'at least as often as the images') from error
            raise StateNotYet(str(error)) from error
        return None if found is None else matrix_from_pose(*pose_of_transform(found))
