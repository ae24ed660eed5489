# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The table frame of rendered scenes in which the true one is known."""

from hooc_perception.core.geometry import inverse
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.table_frame import estimate_table_frame
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

K = np.array([[180.0, 0, 99.5], [0, 180, 74.5], [0, 0, 1]])


def looking_at(eye, target):
    """Return T_world_camera of an upright camera."""
    z = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.stack([x, np.cross(z, x), z], 1), eye
    return T


def box(extents, centre):
    mesh = trimesh.creation.box(extents)
    return mesh.vertices + centre, mesh.faces.astype(np.int32)


def views(eyes, meshes, rng, T_source_world=None):
    """Return noisy DepthViews whose poses are in another frame than the table's."""
    T_source_world = np.eye(4) if T_source_world is None else T_source_world
    result = []
    for i, eye in enumerate(eyes):
        camera = Camera(f'c{i}', 200, 150, K, np.zeros(5), looking_at(eye, (0, 0, 0)))
        depth, _ = render_depth(meshes, camera)
        depth[~np.isfinite(depth)] = np.nan
        depth += rng.normal(0, 0.001, depth.shape)
        source = Camera(f'c{i}', 200, 150, K, np.zeros(5), T_source_world @ camera.T_world_camera)
        result.append(DepthView(source, depth.astype(np.float32)))
    return result


TABLE = box((1.2, 1.0, 0.05), (0, 0, -0.025))
OBJECTS = [box((0.1, 0.1, 0.15), (0.15, 0.1, 0.075)), box((0.2, 0.1, 0.06), (0.05, -0.1, 0.03))]
FLOOR = box((4, 4, 0.01), (0, 0, -0.75))
WALL = box((4, 0.05, 3), (0, 1.2, 0))


def assert_table(plane, T_source_world, centre=(0.083, -0.033)):
    """Assert height within 2 mm, tilt within 0.5 degrees, the middle of the footprints."""
    T_table_world = plane.T_table_source @ T_source_world
    np.testing.assert_allclose(T_table_world[:3, 2], [0, 0, 1], atol=0.009)
    origin = inverse(T_table_world)[:3, 3]
    assert abs(origin[2]) < 0.002
    np.testing.assert_allclose(origin[:2], centre, atol=0.05)


@pytest.mark.parametrize('around', [[], [FLOOR], [FLOOR, WALL]], ids=['table', 'floor', 'wall'])
@pytest.mark.parametrize('eyes', [[(0, -0.9, 0.7)], [(0, -0.9, 0.7), (0.8, 0.5, 0.6)]],
                         ids=['one', 'two'])
def test_table_below_objects_is_found(eyes, around):
    rng = np.random.default_rng(1)
    T_source_world = np.eye(4)
    T_source_world[:3, :3] = Rotation.from_rotvec([0.8, -1.2, 0.3]).as_matrix()
    T_source_world[:3, 3] = [0.3, -0.7, 2.0]
    plane = estimate_table_frame(
        views(eyes, [TABLE, *OBJECTS, *around], rng, T_source_world), 's')
    assert_table(plane, T_source_world)
    assert plane.residual_m < 0.003
    assert 0.2 < plane.inlier_share < 1


def test_larger_wall_does_not_pass_for_the_table():
    wall = box((4, 0.05, 1.2), (0, 0.35, 0))
    seen = views([(0, -1.1, 0.35)], [TABLE, *OBJECTS, wall], np.random.default_rng(2))
    assert_table(estimate_table_frame(seen, 's'), np.eye(4))


def test_same_views_same_frame():
    rng = np.random.default_rng(3)
    seen = views([(0, -0.9, 0.7)], [TABLE, *OBJECTS, FLOOR], rng)
    first, second = (estimate_table_frame(seen, 's').T_table_source for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_x_points_right_in_the_first_image():
    seen = views([(0, -0.9, 0.7)], [TABLE, *OBJECTS], np.random.default_rng(4))
    right = seen[0].camera.T_world_camera[:3, 0]
    T = estimate_table_frame(seen, 's').T_table_source
    np.testing.assert_allclose(T[:3, :3] @ right, [1, 0, 0], atol=0.02)


def test_distortion_is_undone():
    view = views([(0, -0.9, 0.7)], [TABLE], np.random.default_rng(5))[0]
    bent = Camera('c', 200, 150, K, np.array([0.3, 0, 0, 0, 0]), view.camera.T_world_camera)
    straight = estimate_table_frame([view], 's').residual_m
    assert estimate_table_frame([DepthView(bent, view.depth)], 's').residual_m > 1.5 * straight


def test_empty_table_has_its_origin_on_the_table():
    seen = views([(0, -0.9, 0.7)], [TABLE], np.random.default_rng(6))
    assert_table(estimate_table_frame(seen, 's'), np.eye(4), centre=(0, 0))


def test_no_plane_is_an_error_that_names_the_scene():
    camera = Camera('c', 200, 150, K, np.zeros(5), np.eye(4))
    scattered = np.random.default_rng(7).uniform(0.5, 3, (150, 200)).astype(np.float32)
    for depth in (scattered, np.full((150, 200), np.nan, np.float32)):
        with pytest.raises(HoocError, match='scene s9'):
            estimate_table_frame([DepthView(camera, depth)], 's9')
