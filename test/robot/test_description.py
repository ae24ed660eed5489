# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A URDF becomes shapes and link poses; what cannot be read is named."""

from hooc_perception.errors import HoocError
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

pytest.importorskip('yourdfpy')

from hooc_perception.robot.description import RobotDescription  # noqa: E402


def with_tool(urdf, geometry):
    """Return the URDF with another shape of its tool."""
    return urdf.replace('<sphere radius="0.04"/>', geometry)


def turn_z(angle):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler('z', angle).as_matrix()
    return T


def shift(x, y, z):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def test_shapes_lie_in_the_frames_of_their_links(arm_urdf):
    arm = RobotDescription(arm_urdf)
    assert (arm.name, arm.root, arm.joints) == ('arm', 'base_link', ('shoulder', 'elbow'))
    assert sorted(arm.shapes) == ['base_link', 'lower', 'tool', 'upper']
    np.testing.assert_allclose(arm.shapes['upper'].bounds, [[0, -.03, -.03], [.3, .03, .03]],
                               atol=1e-9)
    np.testing.assert_allclose(arm.shapes['lower'].bounds, [[0, -.03, -.03], [.25, .03, .03]],
                               atol=1e-3)


@pytest.mark.parametrize('shoulder, elbow', [(0.0, 0.0), (0.7, -1.2), (4.0, 0.3)])
def test_forward_kinematics(arm_urdf, shoulder, elbow):
    poses = RobotDescription(arm_urdf).link_poses(
        {'shoulder': shoulder, 'elbow': elbow, 'of_another_robot': 1.0})
    upper = shift(0, 0, 0.3) @ turn_z(shoulder)
    lower = upper @ shift(0.3, 0, 0) @ turn_z(elbow)
    tool = lower @ shift(0.25 + 0.02 + 0.1 * elbow, 0, 0)
    for name, T in (('base_link', np.eye(4)), ('upper', upper), ('lower', lower), ('tool', tool)):
        np.testing.assert_allclose(poses[name], T, atol=1e-6)


def test_a_missing_joint_is_named(arm_urdf):
    with pytest.raises(HoocError, match='position of elbow is not known'):
        RobotDescription(arm_urdf).link_poses({'shoulder': 0.0})
    floating = arm_urdf.replace('name="wrist" type="fixed"', 'name="wrist" type="floating"')
    with pytest.raises(HoocError, match='wrist .* is floating'):
        RobotDescription(floating).link_poses({'shoulder': 0.0, 'elbow': 0.0})


@pytest.mark.parametrize('scheme', ['file', 'package', ''])
def test_meshes_are_found_and_scaled(arm_urdf, tmp_path, scheme):
    trimesh.creation.box((20, 40, 60)).export(tmp_path / 'tool.stl')
    name = {'file': f'file://{tmp_path}/tool.stl', 'package': 'package://my_robot/tool.stl',
            '': f'{tmp_path}/tool.stl'}[scheme]
    urdf = with_tool(arm_urdf, f'<mesh filename="{name}" scale=".001 .001 .001"/>')
    arm = RobotDescription(urdf, find_package={'my_robot': str(tmp_path)}.get)
    np.testing.assert_allclose(arm.shapes['tool'].extents, (0.02, 0.04, 0.06), atol=1e-6)


def test_a_missing_mesh_falls_back_on_the_collision_shape(arm_urdf):
    missing = with_tool(arm_urdf, '<mesh filename="package://nowhere/tool.dae"/>')
    with pytest.raises(HoocError, match='link tool: .*package nowhere, which is not installed'):
        RobotDescription(missing)
    assert 'tool' not in RobotDescription(missing, ignore=['tool']).shapes
    simpler = missing.replace('tool.dae"/></geometry></visual>', 'tool.dae"/></geometry></visual>'
                              '<collision><geometry><box size="1 2 3"/></geometry></collision>')
    np.testing.assert_allclose(RobotDescription(simpler).shapes['tool'].extents, (1, 2, 3))


@pytest.mark.parametrize('text, word', [
    ('', 'not XML'), ('<sdf/>', '<sdf>, not <robot>'), ('<robot name="x"/>', 'no root link'),
    ('<robot name="x" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arm/></robot>', 'run xacro'),
    ('<robot name="x"><link name="a"/><joint name="j" type="fixed"><parent link="a"/>'
     '<child link="b"/></joint></robot>', 'cannot be read as URDF')])
def test_what_is_no_urdf_is_named(text, word):
    with pytest.raises(HoocError, match=word):
        RobotDescription(text)


def test_unknown_links_to_ignore_are_named(arm_urdf):
    with pytest.raises(HoocError, match="no link 'tol'.*upper"):
        RobotDescription(arm_urdf, ignore=['tol'])
