# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The robot in view of the ingestion node: masked, or the frame set is refused."""

import importlib.util
from pathlib import Path
import sys

import cv2
from hooc_perception.core.geometry import transform
from hooc_perception.core.render import render_depth
import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('yourdfpy')

from geometry_msgs.msg import TransformStamped  # noqa: E402
from hooc_perception.nodes.ingestion_node import IngestionNode
from hooc_perception.nodes.warm_up import overhead_camera
from hooc_perception.robot.description import RobotDescription
from hooc_perception.ros.messages import conversions as c
from hooc_perception.ros.messages.observations import HIDDEN
from hooc_perception.ros.qos import qos
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import CameraInfo, Image, JointState  # noqa: E402
from std_msgs.msg import Header, String  # noqa: E402

spec = importlib.util.spec_from_file_location('raw_camera', Path(__file__).with_name(
    'raw_camera.py'))
raw_camera = importlib.util.module_from_spec(spec)
spec.loader.exec_module(raw_camera)
S, MS = 10**9, 10**6
# Where the arm stands: its links pass 0.3 m above the table, before the camera.
BASE = [-0.35, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]


class Cell:
    """An ingestion node, a camera above a table, and a robot that the test moves."""

    def __init__(self, bench, urdf, **parameters):
        self.bench, self.urdf, self.camera = bench, urdf, overhead_camera()
        self.node = bench.add(IngestionNode, cameras=['overhead'], max_frame_age_s=0.0,
                              warm_up=False, **parameters)
        make, peer = bench.peer.create_publisher, bench.peer
        name = 'overhead'
        self.images = make(Image, f'{name}/depth/image_raw', qos('<camera>/depth/image_raw'))
        self.infos = make(CameraInfo, f'{name}/depth/camera_info',
                          qos('<camera>/depth/camera_info'))
        self.poses = make(TransformStamped, f'{name}/extrinsics', qos('<camera>/extrinsics'))
        self.joints = make(JointState, '/joint_states', 10)
        self.descriptions = make(String, '/robot_description', qos('/robot_description'))
        self.depth = bench.hear(Image, f'views/{name}/depth_rect',
                                qos('views/<camera>/depth_rect'))
        self.segments = bench.hear(Image, f'views/{name}/segments',
                                   qos('views/<camera>/segments'))
        self.refused = bench.hear(Header, 'views/refused', qos('views/refused'))
        assert self.node.trigger_configure() == TransitionCallbackReturn.SUCCESS, (
            bench.reasons(self.node))
        assert self.node.trigger_activate() == TransitionCallbackReturn.SUCCESS
        assert bench.spin(lambda: self.images.get_subscription_count()
                          and self.infos.get_subscription_count()
                          and self.poses.get_subscription_count()
                          and self.node.count_subscribers(peer.resolve_topic_name(
                              f'views/{name}/segments')))
        self.poses.publish(c.transform_message(
            *c_pose(self.camera.T_world_camera), c.header(0, 'table'), 'overhead_optical'))

    def move(self, stamp_ns, shoulder=0.0, elbow=0.0):
        """Publish a joint state until the node has heard it."""
        message = JointState(header=c.header(stamp_ns, ''), name=['shoulder', 'elbow'],
                             position=[shoulder, elbow])

        def heard():
            history = self.node.work.robot.poses.states._history.get('elbow')
            if history and history[-1][0] == stamp_ns:
                return True
            self.joints.publish(message)
            return False
        assert self.bench.spin(heard)

    def look(self, stamp_ns, shoulder=0.0, elbow=0.0, base=BASE, extra=()):
        """Publish an image of the arm; return (H, W) which link each pixel shows, -1 for none."""
        arm = RobotDescription(self.urdf)
        T = np.eye(4)
        T[:3, 3] = base[:3]
        poses = arm.link_poses({'shoulder': shoulder, 'elbow': elbow})
        meshes = [(transform(T @ poses[name], np.asarray(mesh.vertices)),
                   np.asarray(mesh.faces, np.int32)) for name, mesh in arm.shapes.items()]
        depth, ids = render_depth([*meshes, *extra], self.camera)
        flat = np.where(np.isfinite(depth), depth, self.camera.T_world_camera[2, 3])
        head = c.header(stamp_ns, 'overhead_optical')
        self.infos.publish(c.camera_info_message(self.camera, head))
        self.images.publish(c.depth_message(flat.astype(np.float32), head))
        return ids

    def hidden(self, index=-1):
        """Return the (H, W) mask of the robot in the views of a frame set."""
        return c.labels_from_message(self.segments[index]) & HIDDEN > 0


def c_pose(T):
    from hooc_perception.core.geometry import pose_from_matrix
    return pose_from_matrix(T)


def box(centre, size):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                      [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], np.int32)
    return np.asarray(centre) + 0.5 * corners * size, faces


def test_the_arm_is_masked_where_it_was_at_the_stamp_of_the_image(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, robot_description=arm_urdf, robot_pose=BASE)
    cell.move(S, shoulder=0.0)
    ids = cell.look(S + 50 * MS, shoulder=0.2, extra=[box([0.1, 0.05, 0.45], [0.03, 0.03, 0.03])])
    bench.rest(0.1)
    assert not cell.depth, 'the state at that stamp was still to come'
    cell.move(S + 100 * MS, shoulder=0.4)
    assert bench.spin(lambda: cell.depth and cell.segments)
    robot, in_front = (ids >= 0) & (ids < 4), ids == 4
    assert robot.sum() > 1000 and in_front.sum() > 10
    assert cell.hidden()[robot].all() and not cell.hidden()[in_front].any()
    depth = c.depth_from_message(cell.depth[0])
    assert np.isnan(depth[robot]).all() and np.isfinite(depth[in_front]).all()
    foreground = c.labels_from_message(cell.segments[0]) & 1 > 0
    assert foreground[in_front].any() and not foreground[robot].any()
    assert cell.hidden().sum() < 2.5 * robot.sum()


def test_the_description_may_come_by_topic_and_the_state_in_parts(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, robot_pose=BASE)
    ids = cell.look(S)
    assert bench.spin(lambda: cell.segments)
    assert not cell.hidden().any(), 'no robot is known yet'
    cell.descriptions.publish(String(data=arm_urdf))
    assert bench.spin(cell.joints.get_subscription_count)
    for name in ('shoulder', 'elbow'):
        cell.joints.publish(JointState(header=c.header(2 * S, ''), name=[name], position=[0.0]))
    assert bench.spin(lambda: len(cell.node.work.robot.poses.states.names) == 2)
    ids = cell.look(2 * S)
    assert bench.spin(lambda: len(cell.segments) == 2)
    assert cell.hidden()[ids >= 0].all()


def test_without_joint_states_frame_sets_are_refused(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, robot_description=arm_urdf, robot_pose=BASE)
    for i in (1, 2):
        cell.look(i * S)
        assert bench.spin(lambda: len(cell.refused) == i)
    code, sentence = bench.reasons(cell.node)['robot']
    assert code == 'no_joint_state' and 'shoulder, elbow' in sentence and 'dropped' in sentence
    assert cell.node.diagnostics._counts['robot', 'no_joint_state'] == 2 and not cell.depth
    (result,) = cell.node.set_parameters([Parameter('robot_unposed', value='accept')])
    assert result.successful
    cell.look(3 * S)
    assert bench.spin(lambda: cell.segments)
    assert not cell.hidden().any()
    assert bench.reasons(cell.node)['robot'][0] == 'no_joint_state'


def test_a_description_that_lies_on_the_topic_does_not_stop_the_chain(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, target_frame='table')
    cell.descriptions.publish(String(data=arm_urdf))
    assert bench.spin(cell.joints.get_subscription_count)
    cell.look(S)
    assert bench.spin(lambda: cell.segments)
    assert not cell.hidden().any() and not cell.refused
    code, sentence = bench.reasons(cell.node)['robot']
    assert code.startswith('no_') and 'taken for objects' in sentence


def test_without_a_reader_of_urdf_the_topic_is_a_warning(bench, arm_urdf, monkeypatch):
    monkeypatch.setitem(sys.modules, 'hooc_perception.robot.description', None)
    cell = Cell(bench, arm_urdf)
    cell.descriptions.publish(String(data=arm_urdf))
    assert bench.spin(lambda: bench.reasons(cell.node).get('robot', ('',))[0] == 'no_urdf_reader')
    cell.look(S)
    assert bench.spin(lambda: cell.segments)
    assert not cell.refused


def test_a_joint_state_that_is_too_old_is_not_used(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, robot_description=arm_urdf, robot_pose=BASE)
    cell.move(S)
    cell.look(S + 200 * MS)
    assert bench.spin(lambda: bench.reasons(cell.node).get('robot', ('',))[0]
                      == 'old_joint_state')
    assert bench.spin(lambda: cell.refused) and not cell.depth


def test_nobody_says_where_the_robot_stands(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, robot_description=arm_urdf)
    cell.move(S)
    cell.look(S)
    assert bench.spin(lambda: cell.refused)
    code, sentence = bench.reasons(cell.node)['robot']
    assert code == 'no_robot_pose' and 'base_link' in sentence and 'robot_pose' in sentence


def test_the_target_frame_may_be_a_link(bench, arm_urdf):
    """With target_frame = base_link, forward kinematics is enough."""
    cell = Cell(bench, arm_urdf, robot_description=arm_urdf, target_frame='base_link')
    cell.poses.publish(c.transform_message(
        *c_pose(cell.camera.T_world_camera), c.header(0, 'base_link'), 'overhead_optical'))
    cell.move(S, 1.0)
    ids = cell.look(S, 1.0, base=[0.0, 0.0, 0.0])
    assert bench.spin(lambda: cell.segments)
    assert (ids >= 0).sum() > 500 and cell.hidden()[ids >= 0].all()


def test_a_robot_that_hides_too_much_refuses_the_set(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, robot_description=arm_urdf, robot_pose=BASE,
                max_robot_share=0.02)
    cell.move(S)
    cell.look(S)
    assert bench.spin(lambda: cell.refused)
    code, sentence = bench.reasons(cell.node)['robot']
    assert code == 'robot_hides_too_much' and '% in overhead' in sentence and not cell.depth
    cell.node.set_parameters([Parameter('max_robot_share', value=0.9)])
    cell.move(2 * S)
    cell.look(2 * S)
    assert bench.spin(lambda: cell.depth)


def test_boxes_and_mask_images_need_no_urdf(bench, arm_urdf, tmp_path):
    camera = overhead_camera()
    mask = np.zeros((camera.height, camera.width), np.uint8)
    mask[:10] = 255
    cv2.imwrite(str(tmp_path / 'mask.png'), mask)
    cell = Cell(bench, arm_urdf, robot_boxes=[-0.4, -0.05, 0.2, 0.3, 0.05, 0.4],
                **{'mask_image.overhead': str(tmp_path / 'mask.png')})
    ids = cell.look(S)
    assert bench.spin(lambda: cell.segments)
    hidden = cell.hidden()
    assert hidden[:10].all() and not hidden[-10:].any()
    v, u = np.nonzero(ids == 1)     # the upper arm lies inside of the box
    assert len(v) > 300 and hidden[v, u].all()


def test_a_mask_of_another_size_is_named(bench, arm_urdf, tmp_path):
    cv2.imwrite(str(tmp_path / 'mask.png'), np.zeros((7, 9), np.uint8))
    cell = Cell(bench, arm_urdf, **{'mask_image.overhead': str(tmp_path / 'mask.png')})
    cell.look(S)
    assert bench.spin(lambda: cell.refused)
    code, sentence = bench.reasons(cell.node)['robot']
    assert code == 'bad_mask_image' and '9 x 7' in sentence


@pytest.mark.parametrize('parameters, word', [
    ({'robot_description': '<sdf/>'}, 'not <robot>'), ({'robot_pose': [1.0]}, 'robot_pose'),
    ({'robot_boxes': [1.0, 2.0]}, 'robot_boxes'),
    ({'mask_image.overhead': '/nowhere.png'}, 'does not exist')])
def test_bad_parameters_are_named_while_configuring(bench, parameters, word):
    node = bench.add(IngestionNode, cameras=['overhead'], warm_up=False, **parameters)
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert word in bench.reasons(node)['node'][1]


def test_a_bad_description_from_the_topic_refuses_sets_until_a_good_one_comes(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, robot_pose=BASE)
    cell.descriptions.publish(String(data='<robot'))
    assert bench.spin(lambda: bench.reasons(cell.node).get('robot', ('',))[0]
                      == 'bad_robot_description')
    cell.look(S)
    assert bench.spin(lambda: cell.refused)
    cell.descriptions.publish(String(data=arm_urdf))
    cell.move(2 * S)
    cell.look(2 * S)
    assert bench.spin(lambda: cell.segments)
    assert cell.hidden().any()


def test_masking_may_be_switched_off(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, robot_mask='off', robot_description=arm_urdf)
    cell.look(S)
    assert bench.spin(lambda: cell.segments)
    assert not cell.hidden().any()


def test_the_arm_does_not_become_part_of_a_median(bench, arm_urdf):
    cell = Cell(bench, arm_urdf, robot_description=arm_urdf, robot_pose=BASE, fuse_frames=5)
    for i in range(1, 4):
        cell.move(i * S, shoulder=0.5)
        cell.look(i * S, shoulder=0.5)
        assert bench.spin(lambda: len(cell.segments) == i)
    hidden = cell.hidden()
    assert hidden.any()
    depth = c.depth_from_message(cell.depth[-1])
    assert np.isnan(depth[hidden]).all()
    assert np.nanmax(np.abs(depth - cell.camera.T_world_camera[2, 3])) < 0.01, 'only table is left'
