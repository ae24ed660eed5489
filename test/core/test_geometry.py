# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Transforms and projection against scipy and OpenCV, and the stages' random numbers."""

from dataclasses import replace

import cv2
from hooc_perception.core import geometry
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

RNG = np.random.default_rng(3)
POSES = [(RNG.normal(size=3), Rotation.random(None, RNG).as_quat()) for _ in range(6)]
POSES.append((np.zeros(3), np.array([0, 0, 0, 1.0])))


@pytest.mark.parametrize('translation, quaternion', POSES)
def test_pose_to_matrix_and_back(translation, quaternion):
    T = geometry.matrix_from_pose(translation, quaternion)
    point = np.array([0.3, -0.2, 0.5])
    expected = Rotation.from_quat(quaternion).apply(point) + translation
    np.testing.assert_allclose((T @ np.append(point, 1))[:3], expected, atol=1e-12)
    back, q = geometry.pose_from_matrix(T)
    np.testing.assert_allclose(back, translation)
    assert q[3] >= 0
    np.testing.assert_allclose(q * np.sign(q @ quaternion), quaternion, atol=1e-12)
    back[:] = 9
    np.testing.assert_allclose(T[:3, 3], translation)


@pytest.mark.parametrize('translation, quaternion', POSES)
def test_inverse_and_transform(translation, quaternion):
    T = geometry.matrix_from_pose(translation, quaternion)
    np.testing.assert_allclose(geometry.inverse(T), np.linalg.inv(T), atol=1e-12)
    points = RNG.normal(size=(50, 3))
    moved = geometry.transform(T, points)
    np.testing.assert_allclose(moved, Rotation.from_quat(quaternion).apply(points) + translation)
    np.testing.assert_allclose(geometry.transform(geometry.inverse(T), moved), points, atol=1e-12)


def test_projection_is_opencvs():
    K = np.array([[365.1, 0, 257.3], [0, 364.0, 208.6], [0, 0, 1]])
    points = RNG.uniform([-0.5, -0.5, 0.4], [0.5, 0.5, 3.0], (40, 3))
    expected = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, np.zeros(5))[0][:, 0]
    np.testing.assert_allclose(np.column_stack(geometry.project(K, points)), expected)


def test_rays_go_through_pixel_centres_and_points_come_back(desk):
    camera = desk.cameras[1]
    depth = RNG.uniform(0.4, 2.0, (camera.height, camera.width))
    depth[5, 7] = np.nan
    world = geometry.back_project(depth, camera)
    assert world.shape == (camera.height, camera.width, 3)
    assert np.isnan(world[5, 7]).all()
    seen = np.isfinite(depth)
    points = geometry.transform(geometry.inverse(camera.T_world_camera), world[seen])
    u, v = geometry.project(camera.K, points)
    rows, columns = np.nonzero(seen)
    np.testing.assert_allclose(u, columns, atol=1e-8)
    np.testing.assert_allclose(v, rows, atol=1e-8)
    np.testing.assert_allclose(points[:, 2], depth[seen])


def test_posed_vertices_have_the_size_that_was_asked_for(things):
    model, size = things[0], np.array([0.2, 0.05, 0.11])
    vertices = geometry.posed_vertices(model, [1.0, 2.0, 3.0], [0, 0, np.sin(.35), np.cos(.35)],
                                       size)
    local = Rotation.from_rotvec([0, 0, -0.7]).apply(vertices - [1.0, 2.0, 3.0])
    np.testing.assert_allclose(np.ptp(local, axis=0), size)
    np.testing.assert_allclose(local.max(0) + local.min(0), 0, atol=1e-12)
    flat = replace(model, vertices=model.vertices * [1, 1, 0], extents=model.extents * [1, 1, 0])
    assert np.isfinite(geometry.posed_vertices(flat, np.zeros(3), [0, 0, 0, 1.0], size)).all()


def test_stages_draw_numbers_of_their_own():
    def draws(*key):
        return geometry.stage_rng(*key).random(4).tolist()

    assert draws(0, 'propose') == draws(0, 'propose')
    assert draws(0, 'propose', 1) == draws(np.int64(0), 'propose', np.int32(1))
    keys = [(0, 'propose'), (1, 'propose'), (0, 'parse'), (0, 'propose', 1), (0, 'propose', 2)]
    assert len({tuple(draws(*key)) for key in keys}) == len(keys)
