# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the robot in view."""

from dataclasses import dataclass

from hooc_perception.core.config import Config, param


@dataclass(frozen=True)
class RobotConfig(Config):
    """How the robot is found in depth images, and what happens where it hides the scene."""

    robot_mask: str = param(
        'auto', 'auto masks the robot if its description is known, by parameter or from '
        '/robot_description; off never does.', choices=('auto', 'off'))
    robot_description: str = param(
        '', 'The text of the URDF, as robot_state_publisher gets it; empty = the latched topic '
        '/robot_description.')
    robot_ignore_links: tuple[str, ...] = param(
        (), 'Links that are not masked, such as a table or a wall that the URDF models, or a link '
        'whose mesh is not installed here.')
    robot_pose: tuple[float, ...] = param(
        (), 'Pose of the root link of the URDF in the target frame: x y z qx qy qz qw; empty = '
        'by the URDF if target_frame is one of its links, else by tf; metres.')
    robot_boxes: tuple[float, ...] = param(
        (), 'Boxes that are masked like links: per box the smallest x y z and the largest x y z, '
        'in robot_boxes_frame; metres.')
    robot_boxes_frame: str = param(
        '', 'Frame of robot_boxes: a link of the URDF or a frame of tf; empty = target_frame.')
    robot_padding_m: float = param(
        0.02, 'The robot grows by this much on all sides before it is masked: the error of its '
        'pose, of its shape and of the depth.', 'm', 0.0, 0.3, runtime=True)
    robot_padding_px: int = param(
        2, 'The outline of the mask grows by this many pixels more, for blurred depth edges.',
        'px', 0, 50, runtime=True)
    robot_state_age_s: float = param(
        0.1, 'The nearest joint state may be this far from the stamp of an image.', 's',
        0.0, 60.0, runtime=True)
    robot_unposed: str = param(
        'refuse', 'What happens to a frame set while nobody says where the robot is: refuse drops '
        'it with a reason, once the robot has been masked or where robot_description or '
        'robot_pose is given; accept uses it as it is, and the robot is taken for objects.',
        choices=('refuse', 'accept'), runtime=True)
    max_robot_share: float = param(
        0.5, 'A frame set is refused if the robot hides more than this share of the table, over '
        'all views together.', '', 0.0, 1.0, runtime=True)
