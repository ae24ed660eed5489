# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where the links of the robot are: by joint states, by tf, or nobody says it."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('yourdfpy')

from hooc_perception.nodes.robot_config import RobotConfig  # noqa: E402
from hooc_perception.nodes.robot_poses import RobotPoses
from hooc_perception.robot.description import RobotDescription
from hooc_perception.ros.inputs.camera_poses import PoseNotYet
from hooc_perception.ros.inputs.joint_states import StateNotYet, StateUnknown
from hooc_perception.ros.messages.conversions import header, transform_message
from sensor_msgs.msg import JointState  # noqa: E402

S, LINKS = 10**9, ('base_link', 'upper', 'lower', 'tool')


class Tf:
    """Knows the height of frames above the target frame, from some stamp on not yet."""

    def __init__(self, until=np.inf, **heights):
        self.until, self.heights = until, heights

    def lookup(self, target, source, stamp, asker):
        if source not in self.heights:
            return None
        if stamp.sec * S + stamp.nanosec > self.until:
            raise PoseNotYet('not yet')
        return transform_message([0.0, 0.0, self.heights[source]], [0.0, 0.0, 0.0, 1.0],
                                 header(0, target), source)


def poses_of(tf, joints=True, target='table', **config):
    values = {'target_frame': target, **RobotConfig().values(), **config}
    made = RobotPoses(SimpleNamespace(config=SimpleNamespace(**values)), tf)
    if joints:
        made.states.add(JointState(header=header(S, ''), name=['shoulder', 'elbow'],
                                   position=[0.3, 0.4]), 0)
    return made


@pytest.fixture
def arm(arm_urdf):
    return RobotDescription(arm_urdf)


def test_joint_states_win_and_tf_says_where_the_root_is(arm):
    made = poses_of(Tf(base_link=0.5, upper=9.0))
    got = made.at(S, arm, LINKS, 'a', False)
    own = arm.link_poses({'shoulder': 0.3, 'elbow': 0.4})
    for name in LINKS:
        np.testing.assert_allclose(got[name][:3, 3], own[name][:3, 3] + [0, 0, 0.5], atol=1e-9)


def test_without_joint_states_tf_gives_every_link(arm):
    heights = dict(zip(LINKS, (0.1, 0.2, 0.3, 0.4)))
    got = poses_of(Tf(**heights), joints=False).at(S, arm, LINKS, 'a', False)
    assert {name: got[name][2, 3] for name in LINKS} == heights
    del heights['tool']
    with pytest.raises(StateUnknown, match='position of shoulder, elbow') as caught:
        poses_of(Tf(**heights), joints=False).at(S, arm, LINKS, 'a', True)
    assert caught.value.code == 'no_joint_state'


def test_a_target_frame_on_the_robot_needs_no_tf(arm):
    got = poses_of(Tf(), target='upper').at(S, arm, LINKS, 'a', False)
    np.testing.assert_allclose(got['upper'], np.eye(4), atol=1e-9)
    np.testing.assert_allclose(got['base_link'][2, 3], -0.3, atol=1e-9)


def test_transforms_that_are_still_to_come_are_waited_for(arm):
    made = poses_of(Tf(until=S - 1, base_link=0.5))
    with pytest.raises(StateNotYet):
        made.at(S, arm, LINKS, 'a', False)
    with pytest.raises(StateUnknown, match='synchronise the clocks') as caught:
        made.at(S, arm, LINKS, 'a', True)
    assert caught.value.code == 'old_robot_pose'


def test_frames_of_boxes_may_be_links_or_frames_of_tf(arm):
    made = poses_of(Tf(base_link=0.0, gripper=0.7))
    got = made.at(S, arm, ['tool', 'gripper', 'table'], 'a', False)
    assert got['gripper'][2, 3] == 0.7 and got['tool'][2, 3] == pytest.approx(0.3)
    np.testing.assert_array_equal(got['table'], np.eye(4))
    with pytest.raises(StateUnknown, match='robot_boxes_frame'):
        made.at(S, None, ['nowhere'], 'a', False)


def test_floating_joints_need_tf(arm_urdf):
    floating = RobotDescription(arm_urdf.replace('name="wrist" type="fixed"',
                                                 'name="wrist" type="floating"'))
    heights = dict(zip(LINKS, (0.1, 0.2, 0.3, 0.4)))
    got = poses_of(Tf(**heights)).at(S, floating, LINKS, 'a', False)
    assert got['tool'][2, 3] == 0.4
    with pytest.raises(Exception, match='floating'):
        poses_of(Tf()).at(S, floating, LINKS, 'a', True)
