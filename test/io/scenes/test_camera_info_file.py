# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The calibration files of ROS as cameras.yaml, or named there."""

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.camera_files import load_cameras
import numpy as np
import pytest

CALIBRATION = """image_width: 640
image_height: 480
camera_name: front/depth
camera_matrix:
  rows: 3
  cols: 3
  data: [600, 0, 321, 0, 601, 239, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.2, 0.001, 0.002, 0.05]
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [600, 0, 321, 0, 0, 601, 239, 0, 0, 0, 1, 0]}
"""
ECHO = """header:
  stamp: {sec: 1, nanosec: 2}
  frame_id: depth
height: 480
width: 640
distortion_model: plumb_bob
d: [0.1, -0.2, 0.001, 0.002, 0.05]
k: [600.0, 0.0, 321.0, 0.0, 601.0, 239.0, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [600.0, 0.0, 321.0, 0.0, 0.0, 601.0, 239.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi: {x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false}
---
"""
POSE = 'world_from_camera: {translation: [0, 0, 1], rotation_xyzw: [1, 0, 0, 0]}\n'


def written(folder, text, name='cameras.yaml'):
    file = folder / name
    file.write_text(text)
    return file


def assert_right(camera):
    assert (camera.width, camera.height, camera.distortion_model) == (640, 480, 'plumb_bob')
    np.testing.assert_array_equal(camera.K, [[600, 0, 321], [0, 601, 239], [0, 0, 1]])
    np.testing.assert_array_equal(camera.D, [0.1, -0.2, 0.001, 0.002, 0.05])
    assert camera.T_world_camera[2, 3] == 1


@pytest.mark.parametrize('text, name', [
    (CALIBRATION, 'front_depth'), (ECHO.replace('---\n', ''), 'camera'),
    (ECHO.replace('---\n', '').replace('\nd:', '\nD:').replace('\nk:', '\nK:')
     .replace('\nr:', '\nR:').replace('\np:', '\nP:'), 'camera')])
def test_a_file_of_ros_describes_one_camera(tmp_path, text, name):
    (key, camera), = load_cameras(written(tmp_path, text + POSE)).items()
    assert key == camera.name == name
    assert_right(camera)


def test_an_entry_may_hold_or_name_a_file_of_ros(tmp_path):
    written(tmp_path, ECHO, 'right.yaml')
    left = ''.join(f'  {row}\n' for row in (CALIBRATION + POSE).splitlines())
    cameras = load_cameras(written(tmp_path, f'left:\n{left}right:\n  camera_info: right.yaml\n'
                                   f'  {POSE}'))
    assert list(cameras) == ['left', 'right']
    for camera in cameras.values():
        assert_right(camera)


def test_a_pose_is_needed_unless_the_camera_is_the_world(tmp_path):
    file = written(tmp_path, CALIBRATION)
    with pytest.raises(HoocError, match='world_from_camera is missing; add it .*no pose'):
        load_cameras(file)
    np.testing.assert_array_equal(load_cameras(file, posed=False)['front_depth'].T_world_camera,
                                  np.eye(4))


@pytest.mark.parametrize('text, words', [
    (CALIBRATION.replace('camera_matrix', 'camera_matrx') + POSE, 'camera_matrix meant'),
    (CALIBRATION.replace('  rows: 1\n', '  rws: 1\n') + POSE, 'rows meant'),
    (ECHO.replace('---\n', '').replace('binning_x: 0', 'binning_x: 2') + POSE, 'binning'),
    (ECHO.replace('---\n', '').replace('x_offset: 0', 'x_offset: 8') + POSE, 'roi'),
    (CALIBRATION.replace('plumb_bob', 'equidistant') + POSE, 'equidistant'),
    ('left: {camera_info: nothing.yaml}\n', 'nothing.yaml'),
    ('left: {camera_info: ../other.yaml}\n', 'leaves'),
    ('left: {camera_info: cameras.yaml}\n', 'neither a calibration')])
def test_what_cannot_be_meant_is_refused(tmp_path, text, words):
    with pytest.raises(HoocError, match=words) as caught:
        load_cameras(written(tmp_path, text))
    assert ';' in str(caught.value)
