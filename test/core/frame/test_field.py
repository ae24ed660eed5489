# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The fused cloud and its field against plain numpy and scipy."""

from hooc_perception.core.frame.field import build_field, fuse_cloud
from hooc_perception.core.frame.kernels import field as kernel
from hooc_perception.core.geometry import back_project, inverse, project, transform
from hooc_perception.core.types import PixelProbabilities
import numpy as np
import pytest
from scipy.spatial import cKDTree


@pytest.fixture(scope='module')
def cloud(desk):
    """Return the desk's Cloud."""
    return fuse_cloud(desk.observation, desk.probabilities)


@pytest.fixture(scope='module')
def field(desk, cloud):
    """Return the desk's Field, coarse for speed."""
    return build_field(desk.observation, cloud, voxel_m=0.007, truncation_m=0.02)


def centres(field):
    """Return (X, Y, Z, 3) world centres of the voxels."""
    index = np.stack(np.meshgrid(*map(np.arange, field.data.shape[:3]), indexing='ij'), -1)
    return field.origin + (index + 0.5) * field.voxel


def normal_by_eigh(points, valid, at, eye, radius, gate):
    """Return (normal towards `eye` or None, gap between the two smallest eigenvalues)."""
    v, u = at
    window = np.s_[max(0, v - radius):v + radius + 1, max(0, u - radius):u + radius + 1]
    near = points[window][valid[window]]
    near = near[np.linalg.norm(near - points[at], axis=1) <= gate]
    if len(near) < 6:
        return None, 0
    values, vectors = np.linalg.eigh(np.cov(near.T))
    normal = vectors[:, 0]
    return normal * np.sign(normal @ (eye - points[at])), (values[1] - values[0]) / values[2]


@pytest.mark.parametrize('k', range(3))
def test_normals_are_those_of_eigh_on_the_neighbourhood(desk, k):
    view = desk.observation.views[k]
    points, eye = back_project(view.depth, view.camera), view.camera.T_world_camera[:3, 3]
    normals = kernel.normals_of_view(points, view.foreground, eye, 3, 0.025)
    compared = 0
    for at in map(tuple, np.argwhere(view.foreground)[::3]):
        expected, gap = normal_by_eigh(points, view.foreground, at, eye, 3, 0.025)
        if expected is None:
            assert np.isnan(normals[at]).all()
        elif gap > 0.02:
            assert abs(normals[at] @ expected) > 1 - 1e-5
            # A normal square to the line of sight may point to either side.
            sight = (eye - points[at]) / np.linalg.norm(eye - points[at])
            assert normals[at] @ expected > 0 or abs(expected @ sight) < 1e-5
            compared += 1
    assert compared > 400
    assert np.isnan(normals[~view.foreground]).all()


def test_too_few_neighbours_give_no_normal():
    points = np.zeros((9, 9, 3))
    points[..., :2] = np.stack(np.meshgrid(np.arange(9), np.arange(9)), -1) * 0.004
    valid = np.zeros((9, 9), bool)
    valid[4, 2:7] = True
    eye = np.array([0.0, 0, 1.0])
    assert np.isnan(kernel.normals_of_view(points, valid, eye, 3, 0.1)).all()
    valid[5, 2:7] = True
    np.testing.assert_allclose(kernel.normals_of_view(points, valid, eye, 3, 0.1)[valid],
                               np.tile([0, 0, 1.0], (10, 1)), atol=1e-6)
    # The gate is a distance in space: with all but one neighbour out of reach, there is none.
    assert np.isnan(kernel.normals_of_view(points, valid, eye, 3, 0.005)).all()


def test_points_of_the_cloud_are_means_of_their_pixels(desk, cloud):
    n = len(cloud.points)
    total, p, count = np.zeros((n, 3)), np.zeros((n, len(desk.models) + 1)), np.zeros(n)
    listed = {(int(c), int(u), int(v)): row for c, (u, v), row in
              zip(desk.probabilities.camera, desk.probabilities.uv, desk.probabilities.p)}
    for k, (view, row, normals) in enumerate(
            zip(desk.observation.views, cloud.row, cloud.view_normals, strict=True)):
        xyz = back_project(view.depth, view.camera)
        np.testing.assert_array_equal(row >= 0, view.foreground & np.isfinite(normals[..., 0]))
        for v, u in np.argwhere(row >= 0):
            i = row[v, u]
            total[i] += xyz[v, u]
            p[i] += listed[k, u, v] / 255
            count[i] += 1
    assert count.min() >= 1
    np.testing.assert_allclose(cloud.points, total / count[:, None], atol=1e-9)
    np.testing.assert_allclose(cloud.p, p / count[:, None], atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1, atol=1e-6)


def test_the_cloud_lies_on_the_objects_and_faces_outward(desk, cloud):
    ball, can = desk.truth.translation[1], desk.truth.translation[2]
    out = cloud.points - ball
    near = np.linalg.norm(out, axis=1) < 0.055
    assert near.sum() > 200
    radius = np.linalg.norm(out[near], axis=1)
    assert abs(np.median(radius) - 0.04) < 0.001
    assert np.median(np.einsum('ij,ij->i', out[near] / radius[:, None],
                               cloud.normals[near])) > 0.98
    top = (np.hypot(*(cloud.points - can)[:, :2].T) < 0.02) & (cloud.points[:, 2] > 0.115)
    assert np.median(cloud.normals[top][:, 2]) > 0.98


def test_both_sides_of_a_sheet_are_kept_apart(small, desk):
    sheet = small.box([0, 0, 0.06], [0.12, 0.001, 0.12])
    observation = small.observed([sheet], desk.cameras)
    none = PixelProbabilities(np.zeros(0, np.uint8), np.zeros((0, 2), np.uint16),
                              np.zeros((0, 4), np.uint8))
    cloud = fuse_cloud(observation, none)
    wall = (cloud.points[:, 2] > 0.03) & (cloud.points[:, 2] < 0.1) & (
        np.abs(cloud.points[:, 0]) < 0.045)
    assert (cloud.normals[wall][:, 1] > 0.9).sum() > 50
    assert (cloud.normals[wall][:, 1] < -0.9).sum() > 50
    assert np.mean(np.abs(cloud.normals[wall][:, 1]) > 0.9) > 0.95
    assert not cloud.p.any()


def test_nothing_seen_gives_an_empty_cloud(empty_desk):
    cloud = fuse_cloud(empty_desk.observation, empty_desk.probabilities)
    assert cloud.points.shape == cloud.normals.shape == (0, 3)
    assert all((row == -1).all() for row in cloud.row)


def test_distance_and_normals_are_those_of_the_nearest_point(cloud, field):
    at = centres(field)
    distance, nearest = cKDTree(cloud.points).query(at.reshape(-1, 3), k=2)
    distance, nearest = (x.reshape(*at.shape[:3], 2) for x in (distance, nearest))
    stored = field.data[..., 0].astype(int)
    expected = np.where(distance[..., 0] < field.truncation,
                        255 * distance[..., 0] / field.truncation, 255)
    assert np.abs(stored - np.floor(expected)).max() <= 1
    near = (distance[..., 0] < field.truncation - 1e-6) & (np.ptp(distance, axis=-1) > 1e-6)
    normal = (field.data[..., 2:5].astype(float) - 128) / 127
    off = np.abs(normal - cloud.normals[nearest[..., 0]])[near]
    assert near.sum() > 1000
    assert off.max() <= 0.5 / 127 + 1e-6


def test_free_evidence_is_that_of_a_plain_projection(desk, field):
    margin, full = 0.012, 0.02
    points = centres(field).reshape(-1, 3)
    expected = np.zeros(len(points))
    unsure = np.zeros(len(points), bool)
    for view in desk.observation.views:
        local = transform(inverse(view.camera.T_world_camera), points)
        u, v = project(view.camera.K, local)
        column, row = np.floor(u + 0.5).astype(int), np.floor(v + 0.5).astype(int)
        unsure |= (np.abs(u % 1 - 0.5) < 1e-9) | (np.abs(v % 1 - 0.5) < 1e-9)
        inside = (local[:, 2] > 0.05) & (column >= 0) & (row >= 0)
        inside &= (column < view.camera.width) & (row < view.camera.height)
        measured = np.full(len(points), np.nan)
        measured[inside] = view.depth[row[inside], column[inside]]
        evidence = np.nan_to_num((measured - local[:, 2] - margin) / full)
        expected = np.maximum(expected, np.floor(255 * np.clip(evidence, 0, 1)))
    stored = field.data[..., 1].ravel()
    assert 0.05 < (stored > 0).mean() < 0.95
    assert np.abs(stored - expected)[~unsure].max() <= 1


def test_inside_the_objects_nothing_is_free_and_above_them_all_is(desk, field):
    at = centres(field)
    free = field.data[..., 1]
    for centre, radius in ((desk.truth.translation[1], 0.035), (desk.truth.translation[2], 0.025)):
        inside = np.linalg.norm(at - centre, axis=-1) < radius
        assert inside.sum() > 50
        assert free[inside].max() == 0
    above = np.linalg.norm(at - [-0.08, 0.05, 0.11], axis=-1) < 0.02
    assert above.sum() > 50
    assert free[above].min() == 255
