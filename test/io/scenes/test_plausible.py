# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes whose poses or depth cannot be meant are refused; the sentence says what is meant."""

from dataclasses import replace

from hooc_perception.core.geometry import inverse, matrix_from_pose, pose_from_matrix, rays
from hooc_perception.core.segment.checks import aim_trouble, table_trouble
from hooc_perception.core.segment.observe import observe, require_table
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.scene_set import load_scene_set, NewScene, write_scene_set
import numpy as np
import pytest
import trimesh

K = np.array([[180, 0, 79.5], [0, 180, 59.5], [0, 0, 1.0]])


def camera(name, azimuth, height=0.8, roll=1.0):
    """Return a Camera that looks at the origin from above; `roll` -1 is upside down."""
    eye = np.array([0.8 * np.cos(azimuth), 0.8 * np.sin(azimuth), height])
    forward = -eye / np.linalg.norm(eye)
    right = roll * np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    T = np.eye(4)
    T[:3] = np.column_stack([right, np.cross(forward, right), forward, eye])
    return Camera(name, 160, 120, K, np.zeros(5), T)


CAMERAS = tuple(camera(f'kinect{i}', 0.4 + 2.1 * i) for i in range(3))


def table(seen_by, top=0.0):
    """Return the (H, W) depth of a table."""
    T = seen_by.T_world_camera
    depth = (top - T[2, 3]) / (rays(seen_by.K, seen_by.height, seen_by.width) @ T[2, :3])
    noise = np.random.default_rng(0).normal(0, 0.001, depth.shape)
    return np.where((depth > 0) & (depth < 3), depth + noise, np.nan).astype(np.float32)


def with_pose(known, change):
    """Return a camera with another translation and quaternion, as a file would state them."""
    return replace(known, T_world_camera=matrix_from_pose(*change(*pose_from_matrix(
        known.T_world_camera))))


def written(path, cameras=CAMERAS, stated=CAMERAS, own=False, **kwargs):
    """Write a set that is seen by `cameras` and states others; return its path."""
    depth = tuple(table(c) for c in cameras)
    scenes = [NewScene('sound', depth), NewScene('odd', depth, cameras=stated)] if own else [
        NewScene('one', depth)]
    return write_scene_set(path / 'set', 'small', {'box': trimesh.creation.box((0.1,) * 3)},
                           cameras if own else stated, scenes, **kwargs)


MISTAKES = [
    (lambda t, q: (1000 * t, q), 'in millimetres; give it in metres'),
    (lambda t, q: (100 * t, q), 'in centimetres'), (lambda t, q: (t / 0.0254, q), 'in inches'),
    (lambda t, q: (t, q[[3, 0, 1, 2]]), 'w, x, y, z'),
    (lambda t, q: (t, q[[3, 2, 1, 0]]), 'kinect')]


@pytest.mark.parametrize('change, words', MISTAKES)
@pytest.mark.parametrize('with_scenes', [True, False])
def test_poses_that_cannot_be_meant_are_refused_when_loading(tmp_path, change, words, with_scenes):
    path = written(tmp_path, stated=[with_pose(c, change) for c in CAMERAS])
    with pytest.raises(HoocError, match='cameras.yaml: camera kinect') as caught:
        load_scene_set(path, with_scenes)
    assert words in str(caught.value) and ';' in str(caught.value)


def test_a_scene_with_odd_cameras_of_its_own_does_not_stop_the_others(tmp_path):
    path = written(tmp_path, stated=tuple(with_pose(c, MISTAKES[0][0]) for c in CAMERAS), own=True)
    odd, sound = load_scene_set(path).scenes
    assert len(sound.depth()) == 3
    with pytest.raises(HoocError, match='odd: camera kinect0: .* millimetres'):
        odd.depth()


@pytest.mark.parametrize('right, wrong', [
    (0.001, 0.0001), (0.001, 0.01), (0.001, 0.00025), (0.0001, 0.001), (0.0005, 0.001)])
def test_depth_units_that_are_wrong_are_named(tmp_path, right, wrong):
    path = written(tmp_path, depth_unit=right)
    file = path / 'dataset.yaml'
    assert f'depth_unit: {right}' in file.read_text()
    file.write_text(file.read_text().replace(f'depth_unit: {right}', f'depth_unit: {wrong}'))
    with pytest.raises(HoocError) as caught:
        load_scene_set(path).scenes[0].depth()
    for word in ('depth_unit', f'{right:g} m and not {wrong:g} m', 'dataset.yaml'):
        assert word in str(caught.value)


@pytest.mark.parametrize('wrong', [0.1, 1e-6])
def test_distances_that_no_camera_measures_need_no_table(tmp_path, wrong):
    path = written(tmp_path, world_frame='unknown', depth_unit=0.001)
    file = path / 'dataset.yaml'
    file.write_text(file.read_text().replace('depth_unit: 0.001', f'depth_unit: {wrong:f}'))
    with pytest.raises(HoocError, match='depth_unit'):
        load_scene_set(path).scenes[0].depth()


def test_a_camera_upside_down_and_one_from_straight_above_are_sound(tmp_path):
    above = replace(CAMERAS[0], T_world_camera=np.diag([1.0, -1, -1, 1]) + np.array(
        [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1.2], [0, 0, 0, 0]]))
    for sound in (camera('a', 1.0, roll=-1.0), camera('b', 0.5, height=0.25), above):
        assert aim_trouble(sound) is None
        assert table_trouble(rectify(DepthView(sound, table(sound))), 0.025, 0.8) is None


def test_an_inverted_transform_is_named():
    low = camera('a', 0.5, height=0.5)
    low.T_world_camera[:3, 3] += low.T_world_camera[:3, 0] * 0.3
    trouble = aim_trouble(replace(low, T_world_camera=inverse(low.T_world_camera)))
    assert trouble and 'inverted' in trouble


def test_a_plane_that_only_cuts_z_0_is_no_table():
    seen = camera('a', 0.0)
    turned = seen.T_world_camera.copy()
    c, s = np.cos(0.6), np.sin(0.6)
    turned[:3] = np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ turned[:3]
    view = rectify(DepthView(replace(seen, T_world_camera=turned), table(seen)))
    assert 'not level (it is tilted by 3' in table_trouble(view, 0.025, 0.8)


def test_one_camera_without_table_is_a_warning_and_all_are_an_error():
    off = replace(CAMERAS[1], T_world_camera=CAMERAS[1].T_world_camera + np.array(
        [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0.2], [0, 0, 0, 0]]))
    views = [DepthView(CAMERAS[0], table(CAMERAS[0])), DepthView(off, table(CAMERAS[1]))]
    seen = require_table(observe([rectify(v) for v in views]))
    assert len(seen.troubles) == 1 and 'camera kinect1: ' in seen.troubles[0]
    assert 'z = 0.2' in seen.troubles[0]
    with pytest.raises(HoocError, match='camera kinect1: .* z = 0.2'):
        require_table(observe([rectify(views[1])]))
