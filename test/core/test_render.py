# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The renderer against Open3D's ray casting and against planes worked out by hand."""

from dataclasses import replace

from hooc_perception.core.geometry import inverse, rays, transform
from hooc_perception.core.kernels.raster import draw, NEAR_M
from hooc_perception.core.render import is_closed, projected, render_depth, render_patch
import numpy as np
import open3d
import pytest
from scipy.spatial.transform import Rotation

TILTS = [[0.3, -0.2, 0.1], [1.2, 0.4, -2.0], [-0.7, 2.1, 0.9]]


@pytest.fixture(scope='module')
def cluttered(things):
    """Return posed meshes in odd poses, in part before one another and out of the picture."""
    rng = np.random.default_rng(7)
    meshes = []
    for i in range(9):
        model = things[i % 3]
        R = Rotation.random(None, rng).as_matrix()
        at = rng.uniform([-0.3, -0.3, 0.0], [0.3, 0.3, 0.25])
        meshes.append((model.vertices * rng.uniform(0.7, 1.6, 3) @ R.T + at, model.faces))
    return meshes


def cast(meshes, camera):
    """Return (depth, ids) of posed meshes by Open3D, inf and -1 where nothing is hit."""
    scene = open3d.t.geometry.RaycastingScene()
    for vertices, faces in meshes:
        scene.add_triangles(np.asarray(vertices, np.float32), np.asarray(faces, np.uint32))
    # Directions with z = 1 in the camera: the distance along them is the depth.
    directions = rays(camera.K, camera.height, camera.width) @ camera.T_world_camera[:3, :3].T
    origins = np.broadcast_to(camera.T_world_camera[:3, 3], directions.shape)
    hit = scene.cast_rays(np.concatenate([origins, directions], -1).astype(np.float32))
    ids = hit['geometry_ids'].numpy().astype(np.int64)
    return hit['t_hit'].numpy(), np.where(ids == scene.INVALID_ID, -1, ids)


@pytest.mark.parametrize('k', range(3))
def test_depth_and_coverage_are_those_of_ray_casting(desk, cluttered, k):
    camera = desk.cameras[k]
    depth, ids = render_depth(cluttered, camera)
    expected, expected_ids = cast(cluttered, camera)
    shown = np.isfinite(expected)
    assert 0.2 < shown.mean() < 0.9
    np.testing.assert_array_equal(np.isfinite(depth), shown)
    off = np.abs(depth[shown] - expected[shown])
    # At grazing rays Open3D's float32 loses some micrometres.
    assert np.quantile(off, 0.999) < 1e-6
    assert off.max() < 1e-5
    np.testing.assert_array_equal(ids, expected_ids)
    assert depth.dtype == np.float32


def test_depth_of_a_tilted_triangle_is_that_of_its_plane(desk):
    camera = desk.cameras[0]
    corners = np.array([[-0.1, -0.12, 0.5], [0.12, -0.05, 0.9], [0.0, 0.11, 0.7]])
    world = transform(camera.T_world_camera, corners)
    depth, _ = render_depth([(world, np.array([[0, 1, 2]], np.int32))], camera)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    plane = normal @ corners[0] / (rays(camera.K, *depth.shape) @ normal)
    covered = np.isfinite(depth)
    assert covered.sum() > 500
    np.testing.assert_allclose(depth[covered], plane[covered], rtol=1e-6)


def test_both_sides_are_drawn(desk, cluttered):
    flipped = [(v, np.ascontiguousarray(f[:, ::-1])) for v, f in cluttered]
    np.testing.assert_allclose(render_depth(flipped, desk.cameras[0])[0],
                               render_depth(cluttered, desk.cameras[0])[0], rtol=1e-6)


def test_the_nearest_wins_whatever_the_order(desk, cluttered):
    depth, ids = render_depth(cluttered, desk.cameras[1])
    depth_back, ids_back = render_depth(cluttered[::-1], desk.cameras[1])
    np.testing.assert_array_equal(depth, depth_back)
    np.testing.assert_array_equal(ids, np.where(ids_back < 0, -1, len(cluttered) - 1 - ids_back))


def test_patches_are_what_a_full_image_shows_of_one_mesh(desk, cluttered):
    camera, cut = desk.cameras[2], 0
    for vertices, faces in cluttered:
        pixels, depth = render_patch(vertices, faces, camera)
        full = render_depth([(vertices, faces)], camera)[0].ravel()
        np.testing.assert_array_equal(pixels, np.flatnonzero(np.isfinite(full)))
        np.testing.assert_array_equal(depth, full[pixels])
        u, v, _ = projected(vertices, camera).T
        cut += bool(len(pixels)) and bool(min(u.min(), v.min()) < 0 or u.max() > camera.width
                                          or v.max() > camera.height)
    assert cut, 'none of the meshes crosses the border of the image'


@pytest.mark.parametrize('at', [[0, 0, -1.0], [3.0, 0, 0.7], [0, -3.0, 0.7]])
def test_what_is_behind_or_beside_the_camera_is_not_drawn(desk, things, at):
    camera = desk.cameras[0]
    mesh = transform(camera.T_world_camera, things[0].vertices + at), things[0].faces
    assert not np.isfinite(render_depth([mesh], camera)[0]).any()
    assert len(render_patch(*mesh, camera)[0]) == 0


def test_triangles_that_reach_to_the_lens_are_left_out_and_others_stay(desk):
    camera = desk.cameras[0]
    corners = np.array([[-0.1, -0.1, 0.6], [0.1, -0.1, 0.6], [0.1, 0.1, 0.6], [0, 0, NEAR_M / 2]])
    world = transform(camera.T_world_camera, corners)
    faces = np.array([[0, 1, 2], [0, 1, 3]], np.int32)
    depth, _ = render_depth([(world, faces)], camera)
    only, _ = render_depth([(world, faces[:1])], camera)
    np.testing.assert_array_equal(depth, only)
    assert np.isfinite(only).any()


@pytest.mark.parametrize('tilt', TILTS)
def test_the_picture_depends_on_the_relative_pose_alone(desk, cluttered, tilt):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(tilt).as_matrix(), [0.4, -1.0, 2.0]
    camera = desk.cameras[0]
    moved = replace(camera, T_world_camera=T @ camera.T_world_camera)
    depth, _ = render_depth(cluttered, camera)
    again, _ = render_depth([(transform(T, v), f) for v, f in cluttered], moved)
    same = np.isfinite(depth) & np.isfinite(again)
    assert same.sum() >= 0.999 * np.isfinite(depth).sum()
    assert np.abs(depth[same] - again[same]).max() < 1e-5
    np.testing.assert_allclose(inverse(moved.T_world_camera) @ moved.T_world_camera, np.eye(4),
                               atol=1e-12)


def drawn(vertices, faces, camera, only_facing=False):
    """Return (depth, face) images of one posed mesh."""
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    face = np.full(depth.shape, -1, np.int32)
    draw(projected(vertices, camera), faces, -1, 0, 0, depth, face, only_facing)
    return depth, face


def test_faces_turned_away_from_the_camera_change_no_picture_of_a_closed_mesh(desk, cluttered):
    for vertices, faces in cluttered:
        for camera in desk.cameras:
            depth, face = drawn(vertices, faces, camera)
            depth_2, face_2 = drawn(vertices, faces, camera, True)
            np.testing.assert_array_equal(depth, depth_2)
            np.testing.assert_array_equal(face, face_2)
    _, backs = drawn(vertices, faces[:, ::-1].copy(), camera)
    assert (backs >= 0).any() and (drawn(vertices, faces[:, ::-1].copy(), camera, True)[1]
                                   != backs).any()


def test_a_mesh_is_closed_where_every_edge_has_its_counterpart_and_each_part_faces_outwards(
        things):
    model = things[0]
    assert all(is_closed(m) for m in things)
    n = len(model.vertices)
    far = np.concatenate([model.vertices, model.vertices + 1.0])
    twice = np.concatenate([model.faces, model.faces + n]).astype(np.int32)
    inverted = np.concatenate([model.faces, model.faces[:, ::-1] + n]).astype(np.int32)
    assert is_closed(replace(model, vertices=far, faces=twice))
    for name, bad in (('open', replace(model, faces=model.faces[1:])),
                      ('wound inwards', replace(model, faces=model.faces[:, ::-1])),
                      ('one part inwards', replace(model, vertices=far, faces=inverted)),
                      ('one face turned over', replace(model, faces=np.concatenate(
                          [model.faces[:1, ::-1], model.faces[1:]]))),
                      ('no face', replace(model, faces=model.faces[:0]))):
        assert not is_closed(bad), name
