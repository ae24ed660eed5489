# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Normals, fused field, segments and features against analytic scenes."""

from hooc_perception.core.classification import features
from hooc_perception.core.classification.kernels import projective_field, smoothing
from hooc_perception.core.classification.kernels import segments as forest_segments
from hooc_perception.core.classification.kernels.texture import normal_shape
from hooc_perception.core.geometry import inverse, project, transform
import numpy as np
import pytest


@pytest.fixture(scope='module')
def scene(small):
    """Two boxes that stand apart, seen by three cameras."""
    meshes = [small.box([-0.15, 0.0, 0.05], [0.1, 0.16, 0.1]),
              small.box([0.15, 0.05, 0.03], [0.2, 0.06, 0.06])]
    observation = small.observed(meshes)
    pixels = features.foreground_pixels(observation)
    return observation, pixels, features.surroundings(observation, pixels)


def test_pixels_lie_on_the_boxes_and_normals_face_the_cameras(scene):
    observation, pixels, _ = scene
    assert len(pixels.camera) == sum(v.foreground.sum() for v in observation.views)
    tops = pixels.points[:, 2] > 0.097
    assert tops.sum() > 100
    assert np.median(pixels.normals[tops, 2]) > 0.999
    centres = np.stack([v.camera.T_world_camera[:3, 3] for v in observation.views])
    towards = centres[pixels.camera] - pixels.points
    assert (np.einsum('ij,ij->i', towards, pixels.normals) > 0).all()


def test_field_is_the_largest_difference_of_depth_over_the_views(scene):
    observation, _, around = scene
    rng = np.random.default_rng(0)
    cells = np.column_stack([rng.integers(0, n, 300) for n in around.field.values.shape])
    points = around.field.origin + cells * around.field.cell
    best = np.full(len(points), -projective_field.FIELD_LIMIT - 1.0)
    for view in observation.views:
        local = transform(inverse(view.camera.T_world_camera), points)
        u, v = project(view.camera.K, local)
        c, r = np.floor(u + 0.5).astype(int), np.floor(v + 0.5).astype(int)
        inside = (c >= 0) & (r >= 0) & (c < view.camera.width) & (r < view.camera.height)
        d = np.full(len(points), np.nan)
        d[inside] = view.depth[r[inside], c[inside]]
        q = np.clip((d - local[:, 2]) / projective_field.FIELD_UNIT_M, -120, 120)
        best = np.where(np.isfinite(q), np.maximum(best, q), best)
    got = around.field.values[tuple(cells.T)].astype(float)
    # A projection that falls on the border of two pixels may take either.
    assert np.mean(np.abs(got - best) <= 1.0) > 0.98
    assert (got == -121).any() or (best > -121).all()


def test_marching_measures_the_box_from_inside(scene):
    _, _, around = scene
    width = sum(projective_field.march(around.field, (-0.15, 0.0, 0.09), (s, 0.0, 0.0), 0.004, 40,
                                       False, 12) for s in (-1.0, 1.0))
    assert width == pytest.approx(0.1, abs=0.03)


def test_segments_hold_one_box_each_and_measure_it(scene):
    _, pixels, around = scene
    left = pixels.points[:, 0] < 0
    ids = around.segments.ids[2][around.voxel]
    main = [np.bincount(ids[side]).argmax() for side in (left, ~left)]
    assert main[0] != main[1]
    assert np.mean(ids[left] == main[0]) > 0.9 and np.mean(ids[~left] == main[1]) > 0.9
    length, breadth, height = around.segments.shapes[2, main[1], :3]
    assert (length, breadth) == pytest.approx((0.2, 0.06), abs=0.025)
    assert height == pytest.approx(0.06, abs=0.02)


def test_a_valley_parts_and_a_ridge_joins():
    """Two walls of an L from inside are two segments, from outside one."""
    t = np.arange(0, 0.1, 0.004)
    a, b = np.meshgrid(t, t)
    a, b, zero = a.ravel(), b.ravel(), np.zeros(a.size)
    floor, wall = np.column_stack([a, b, zero]), np.column_stack([zero, b, a])
    points = np.concatenate([floor, wall])
    for sign, expected in ((1.0, 2), (-1.0, 1)):
        normals = sign * np.repeat([[0, 0, 1.0], [1.0, 0, 0]], len(floor), axis=0)
        origin = np.full(3, -0.01)
        voxel, mean, normal, grid = forest_segments.voxelise(points, normals, origin, 0.006,
                                                             (30, 30, 30))
        pairs, weight = forest_segments.edges(mean, normal, grid, origin, 0.006)
        ids = forest_segments.segment(len(mean), pairs, weight,
                                      np.argsort(weight, kind='stable'), 3.0, 12)
        large = np.bincount(ids[voxel]) > 0.2 * len(points)
        assert large.sum() == expected


def test_features_are_finite_and_do_not_depend_on_where_north_is(scene, small):
    _, pixels, around = scene
    probes = features.draw_probes(np.random.default_rng(1), 20)
    rows = np.arange(0, len(pixels.camera), 37)
    x = features.pixel_features(pixels, around, probes, rows)
    assert x.shape == (len(rows), features.feature_count(20)) and np.isfinite(x).all()
    # The same scene, cameras and all, turned by a quarter: x' = -y, y' = x.
    meshes = [small.box([0.0, -0.15, 0.05], [0.16, 0.1, 0.1]),
              small.box([-0.05, 0.15, 0.03], [0.06, 0.2, 0.06])]
    turned = small.observed(meshes, small.rig(start=0.3 + np.pi / 2))
    other = features.foreground_pixels(turned)
    y = features.pixel_features(other, features.surroundings(turned, other), probes,
                                np.arange(0, len(other.camera), 37))
    # The grid falls differently, so single values move; their distribution hardly does.
    spread = x.std(0) + 1e-3
    assert np.median(np.abs(x.mean(0) - y.mean(0)) / spread) < 0.05


def test_probes_reach_from_one_to_twentyfive_centimetres():
    probes = features.draw_probes(np.random.default_rng(0), 400)
    assert set(np.unique(probes[:, 0])) == {0.0, 1.0}
    relative = probes[probes[:, 1] == 0]
    radius = np.linalg.norm(relative[:, 2:], axis=1)
    assert radius.min() >= 0.01 and radius.max() <= 0.25
    assert (probes[probes[:, 1] == 1, 4] > 0).all()


def test_thinned_pixels_take_a_neighbour_of_their_own_surface(scene):
    _, pixels, _ = scene
    rows, donor = smoothing.thin(pixels.camera, pixels.uv, pixels.points, 2)
    assert len(rows) < 0.5 * len(donor)
    speaks = rows[donor]
    assert (donor[rows] == np.arange(len(rows))).all()
    assert (pixels.camera[speaks] == pixels.camera).all()
    assert np.linalg.norm(pixels.points[speaks] - pixels.points, axis=1).max() < 0.015
    everyone, same = smoothing.thin(pixels.camera, pixels.uv, pixels.points, 1)
    assert (everyone[same] == np.arange(len(donor))).all()


def spread_edge_by_edge(p, voxel, n_voxels, pairs, weight, steps):
    """Return what `smoothing.spread` does, in plain Python."""
    own, count = np.zeros((n_voxels, p.shape[1])), np.bincount(voxel, minlength=n_voxels)
    np.add.at(own, voxel, p)
    own /= np.maximum(count, 1)[:, None]
    now, known = own.copy(), count > 0
    for _ in range(steps):
        new, total = own.copy(), (count > 0).astype(float)
        for (a, b), w in zip(pairs, weight):
            for here, there in ((a, b), (b, a)):
                new[here] += known[there] * w * now[there]
                total[here] += known[there] * w
        reached = total > 1e-6
        now[reached] = new[reached] / total[reached, None]
        known = known | reached
    now[~known, 0] = 1
    return now


def test_probabilities_spread_as_edge_by_edge():
    rng = np.random.default_rng(2)
    n = 60
    pairs = np.array([(a, b) for a in range(n - 10) for b in range(a + 1, min(a + 4, n - 10))])
    weight = rng.choice([0.0, 0.3, 1.0], len(pairs)).astype(np.float32)
    voxel = rng.integers(0, n // 2, 40)
    p = rng.dirichlet(np.ones(5), 40).astype(np.float32)
    for steps in (0, 1, 7):
        np.testing.assert_allclose(
            smoothing.spread(p, voxel, n, pairs.astype(np.int32), weight, steps),
            spread_edge_by_edge(p, voxel, n, pairs, weight, steps), atol=1e-5)


def test_probabilities_spread_along_edges_and_stop_at_cuts():
    pairs = np.array([[0, 1], [1, 2], [2, 3]], np.int32)
    weight = np.array([1.0, 1.0, 0.0], np.float32)
    p = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], np.float32)
    out = smoothing.spread(p, np.array([0, 3]), 5, pairs, weight, 30)
    np.testing.assert_allclose(out[:3], np.tile(p[0], (3, 1)), atol=1e-5)
    np.testing.assert_allclose(out[3], p[1], atol=1e-5)
    # Nobody knows anything of the last voxel: background.
    np.testing.assert_allclose(out[4], [1, 0, 0])


@pytest.mark.parametrize('n', [1, 2, 3, 8])
def test_the_shape_of_a_bundle_of_normals_is_as_lapack_says(n):
    rng = np.random.default_rng(n)
    for _ in range(50):
        normals = rng.normal(size=(n, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        moment, out = normals.T @ normals / n, np.empty(4)
        normal_shape(moment[np.triu_indices(3)], out)
        values, vectors = np.linalg.eigh(moment)
        assert np.allclose(out[:2], values[:2], atol=1e-9)
        if values[2] - values[1] > 1e-3:
            assert out[3] == pytest.approx(abs(vectors[2, 2]), abs=1e-6)
        if values[1] - values[0] > 1e-3:
            assert out[2] == pytest.approx(abs(vectors[2, 0]), abs=1e-6)
    flat, out = np.array([1.0, 0, 0, 0, 0, 0]), np.empty(4)
    normal_shape(flat, out)
    assert np.allclose(out[[0, 1, 3]], 0), 'one direction alone has no second'
