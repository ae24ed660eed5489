# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scene sets whose world is not a table's: `world_frame: unknown`."""

from hooc_perception.core.geometry import back_project, matrix_from_pose, pose_from_matrix
from hooc_perception.core.types import Camera
from hooc_perception.io.scenes.scene_set import (
    load_scene_set,
    NewScene,
    TrueObject,
    write_scene_set,
)
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

K = np.array([[70.0, 0, 39.5], [0, 70, 29.5], [0, 0, 1]])


@pytest.fixture(scope='module')
def scene(tmp_path_factory):
    """Return a scene whose world is its camera's frame, 0.8 m above an empty slanted view."""
    T_table_camera = matrix_from_pose([0, -0.6, 0.8], Rotation.from_euler('x', -2.45).as_quat())
    camera = Camera('c', 80, 60, K, np.zeros(5), T_table_camera)
    ones = back_project(np.ones((60, 80)), camera)
    depth = 0.8 / (0.8 - ones[..., 2])
    depth[28:32, 38:42] -= 0.06
    T_camera_object = np.linalg.inv(T_table_camera) @ matrix_from_pose([0, 0, 0.05], [0, 0, 0, 1])
    truth = TrueObject('box', *pose_from_matrix(T_camera_object), np.full(3, 0.1))
    folder = tmp_path_factory.mktemp('set')
    path = write_scene_set(
        folder, 'lost', {'box': trimesh.creation.box((0.1, 0.1, 0.1))},
        [Camera('c', 80, 60, K, np.zeros(5), np.eye(4))], [NewScene('s', (depth,), (truth,))],
        world_frame='unknown')
    loaded = load_scene_set(path)
    assert loaded.world_frame == 'table'
    np.testing.assert_array_equal(loaded.cameras[0].T_world_camera,
                                  loaded.scenes[0].cameras[0].T_world_camera)
    return loaded.scenes[0]


def test_cameras_and_truth_are_moved_into_the_table_frame(scene):
    camera, = scene.cameras
    assert camera.T_world_camera[2, 3] == pytest.approx(0.8, abs=0.003)
    true, = scene.truth
    assert true.translation[2] == pytest.approx(0.05, abs=0.003)
    up = Rotation.from_quat(true.rotation_xyzw).apply([0, 0, 1])
    np.testing.assert_allclose(up, [0, 0, 1], atol=0.005)


def test_the_images_come_with_the_moved_cameras(scene):
    view, = scene.depth()
    points = back_project(view.depth, view.camera)
    assert np.median(points[..., 2]) == pytest.approx(0, abs=0.001)
