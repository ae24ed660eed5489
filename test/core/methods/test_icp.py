# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""ICP recovers known transforms, both ways round, and agrees with Open3D."""

from hooc_perception.core.geometry import inverse, transform
from hooc_perception.core.methods.icp import align, nearest, target_cloud
import numpy as np
import open3d
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
import trimesh


def cloud(n, seed=0):
    """Return (points, normals) on an L-shaped block without any symmetry, about 20 cm."""
    block = trimesh.util.concatenate([
        trimesh.creation.box((.2, .06, .04)),
        trimesh.creation.box((.05, .13, .05), trimesh.transformations.translation_matrix(
            (.07, .08, .03)))])
    points, face = trimesh.sample.sample_surface_even(block, n, seed=seed)
    return np.array(points), np.array(block.face_normals[face])


def motion(rng, degrees, metres):
    T = np.eye(4)
    axis = rng.normal(size=3)
    T[:3, :3] = Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)).as_matrix()
    step = rng.normal(size=3)
    T[:3, 3] = metres * step / np.linalg.norm(step)
    return T


def apart(T_a, T_b):
    """Return (degrees, millimetres) between two transforms."""
    D = inverse(T_a) @ T_b
    return np.degrees(Rotation.from_matrix(D[:3, :3]).magnitude()), 1e3 * np.linalg.norm(D[:3, 3])


@pytest.mark.parametrize('where', [.02, .1, .4])
def test_nearest_agrees_with_a_kd_tree(where):
    rng = np.random.default_rng(0)
    points, _ = cloud(1500)
    queries = points[rng.integers(0, len(points), 400)] + rng.normal(0, where, (400, 3))
    expected = cKDTree(points).query(queries)[0]
    found = nearest(target_cloud(points), queries)[1]
    assert np.mean(np.abs(found - expected) < 1e-9) > .98
    assert np.all(found < expected + .002)
    within = nearest(target_cloud(points), queries, .03)
    assert np.array_equal(within[0] >= 0, np.isfinite(within[1]))
    assert np.mean((within[0] >= 0) == (expected <= .03)) > .99


@pytest.mark.parametrize('plane', [False, True])
@pytest.mark.parametrize('swapped', [False, True])
@pytest.mark.parametrize('seed', range(3))
def test_known_transforms_come_back_from_noise(plane, swapped, seed):
    rng = np.random.default_rng(seed)
    (a, na), (b, nb) = cloud(2500, 1), cloud(2500, 2)
    T_true = motion(rng, 70, .3)
    moved, nm = transform(T_true, b), nb @ T_true[:3, :3].T
    moved = moved + rng.normal(0, .001, moved.shape)
    if swapped:
        a, na, moved, nm, T_true = moved, nm, a, na, inverse(T_true)
    # Now moved = T_true @ a, so T_a_moved is the inverse.
    start = inverse(T_true) @ motion(rng, 12, .012)
    result = align(target_cloud(a, na), moved, start, .05, 200, plane)
    degrees, mm = apart(result.T_target_source, inverse(T_true))
    assert result.converged
    assert degrees < .6
    assert mm < 1.5 + 1e3 * np.radians(degrees) * .3
    assert result.pairs == len(moved)
    assert .0005 < result.rms_m < .006


@pytest.mark.parametrize('plane', [False, True])
@pytest.mark.parametrize('seed', range(3))
def test_same_transform_as_open3d(plane, seed):
    rng = np.random.default_rng(seed)
    (a, na), (b, _) = cloud(2500, 1), cloud(900, 2)
    T_true = motion(rng, 50, .1)
    source = transform(inverse(T_true), b + rng.normal(0, .002, b.shape))
    # A partial view and some clutter that only `reach` keeps out.
    source = np.concatenate([source[b[:, 0] > -.03], rng.uniform(-.3, .3, (40, 3))])
    start = T_true @ motion(rng, 8, .01)
    reach = .03

    def o3d_cloud(points, normals=None):
        out = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
        if normals is not None:
            out.normals = open3d.utility.Vector3dVector(normals)
        return out

    registration = open3d.pipelines.registration
    expected = registration.registration_icp(
        o3d_cloud(source), o3d_cloud(a, na), reach, start,
        registration.TransformationEstimationPointToPlane() if plane else
        registration.TransformationEstimationPointToPoint(),
        registration.ICPConvergenceCriteria(1e-12, 1e-12, 300))
    result = align(target_cloud(a, na), source, start, reach, 300, plane, 1e-9)
    degrees, mm = apart(result.T_target_source, expected.transformation)
    assert degrees < .1
    assert mm < .2
    assert result.rms_m == pytest.approx(expected.inlier_rmse, rel=.02)
    assert result.pairs == pytest.approx(len(expected.correspondence_set), abs=3)


def test_too_far_away_to_pair_stays_where_it_was():
    points, normals = cloud(500)
    start = np.eye(4)
    start[:3, 3] = 10
    result = align(target_cloud(points, normals), points, start, .01)
    assert (result.pairs, result.converged) == (0, False)
    assert np.array_equal(result.T_target_source, start)


def test_a_plane_leaves_what_it_cannot_know_alone():
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.uniform(-.1, .1, (800, 2)), np.zeros(800)])
    start = np.eye(4)
    start[:3, 3] = 0, 0, .01
    result = align(target_cloud(flat, np.tile([0, 0, 1.], (800, 1))), flat, start, .05, 20, True)
    assert apart(result.T_target_source, np.eye(4)) == pytest.approx((0, 0), abs=1e-3)
