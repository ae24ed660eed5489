# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What can be seen to be wrong with a camera from one frame."""

from dataclasses import replace

from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.core.segment import checks as plausible
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

DOWN = Rotation.from_euler('x', 180, degrees=True).as_quat()


def camera(at=(0.0, 0.0, 1.0), rotation=DOWN):
    K = np.array([[300.0, 0, 159.5], [0, 300, 119.5], [0, 0, 1]])
    return Camera('a', 320, 240, K, np.zeros(5), matrix_from_pose(at, rotation))


def depth(metres):
    return np.full((240, 320), metres, np.float32)


@pytest.mark.parametrize('at, rotation, word', [
    ((0, 0, 1), DOWN, None), ((0, 0, -1), DOWN, 'below'), ((0, 0, 1000), DOWN, 'in metres'),
    ((0, 0, 1), [0, 0, 0, 1], 'looks up'),
    ((0.9, 0, 0.3), Rotation.from_euler('y', -90, degrees=True).as_quat(), None)])
def test_poses(at, rotation, word):
    trouble = plausible.pose_trouble(camera(at, rotation))
    assert trouble is None if word is None else word in trouble


@pytest.mark.parametrize('at, metres, word', [
    ((0, 0, 1), 1.0, None), ((0, 0, 1), 1.02, None), ((0, 0, 1), 0.9, 'z = 0.1'),
    ((5, 0, 1), 1.0, 'nothing within'), ((0, 0, 1), np.nan, 'nothing within')])
def test_tables(at, metres, word):
    view = RectifiedView(camera(at), depth(metres))
    trouble = plausible.table_trouble(view, 0.025, 0.8)
    assert trouble is None if word is None else word in trouble


def test_rigs():
    trained = (camera(), replace(camera((1, 0, 1)), name='b'))
    assert plausible.rig_trouble(trained, trained) is None
    near = (camera((0.05, 0, 1)), trained[1])
    assert plausible.rig_trouble(near, trained) is None
    assert '3 cameras' not in plausible.rig_trouble(trained[:1], trained)
    assert 'there are 1' in plausible.rig_trouble(trained[:1], trained)
    assert 'a stands 1.00 m' in plausible.rig_trouble(trained[::-1], (
        trained[0], trained[0])).replace('b stands', 'a stands')
    turned = Rotation.from_euler('xz', [180, 20], degrees=True).as_quat()
    assert '20 degrees' in plausible.rig_trouble((camera(rotation=turned), trained[1]), trained)
    K = camera().K * np.array([[1.5], [1.5], [1]])
    assert 'x 1.50' in plausible.rig_trouble((replace(camera(), K=K), trained[1]), trained)
