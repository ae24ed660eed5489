# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""BOP's pose errors against slow direct computations."""

from dataclasses import replace

from hooc_perception.core.geometry import inverse, transform
from hooc_perception.core.render import render_depth
from hooc_perception.core.symmetry import symmetry_rotations
from hooc_perception.core.types import RectifiedView
from hooc_perception.evaluation.errors import diameter, mspd, mssd, vsd
from hooc_perception.evaluation.matching import PosedObject
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


def some_pose(model, rng, spread=0.05):
    return PosedObject(model.name, rng.normal(size=3) * spread,
                       Rotation.random(None, rng).as_quat(),
                       model.extents * rng.uniform(0.7, 1.4, 3))


def world(pose, model, points):
    R = Rotation.from_quat(pose.rotation_xyzw).as_matrix()
    return (points * pose.size / model.extents) @ R.T + pose.translation


def test_mssd_is_the_minimum_over_symmetries_of_the_largest_gap(models):
    rng = np.random.default_rng(0)
    for name in ('box', 'can'):
        model = models[name]
        for _ in range(5):
            est, true = some_pose(model, rng), some_pose(model, rng)
            expected = min(
                np.linalg.norm(world(est, model, model.vertices)
                               - world(true, model, model.vertices @ S.T), axis=1).max()
                for S in symmetry_rotations(model.symmetry))
            assert mssd(est, true, model) == pytest.approx(expected, rel=1e-9)


def test_mssd_of_a_shift_is_the_shift(models):
    model = models['box']
    true = some_pose(model, np.random.default_rng(1))
    est = replace(true, translation=true.translation + [0.01, -0.02, 0.02])
    assert mssd(est, true, model) == pytest.approx(0.03)


def test_mssd_knows_a_turned_box_and_a_box_with_swapped_sides(models):
    box = replace(models['box'], symmetry=np.array([2, 2, 4]))
    true = PosedObject('box', np.zeros(3), np.array([0, 0, 0, 1.0]), np.array([.2, .1, .05]))
    swapped = PosedObject('box', np.zeros(3), Rotation.from_euler('z', np.pi / 2).as_quat(),
                          np.array([.1, .2, .05]))
    # The generic box is no square, so its own corners must meet: scale them to a square first.
    box = replace(box, extents=np.full(3, 0.1), vertices=box.vertices / box.extents * 0.1)
    assert mssd(swapped, true, box) == pytest.approx(0, abs=1e-9)
    assert mssd(replace(swapped, size=true.size), true, box) > 0.04


def test_ball_counts_its_centre_only(models):
    ball = replace(models['ball'], symmetry=np.zeros(3, np.int32))
    true = PosedObject('ball', np.zeros(3), np.array([0, 0, 0, 1.0]), ball.extents)
    est = PosedObject('ball', np.array([0.01, 0, 0]), Rotation.from_euler('x', 1).as_quat(),
                      ball.extents)
    assert mssd(est, true, ball) == pytest.approx(0.01, rel=1e-6)


def test_mspd_is_the_largest_pixel_gap(models, tiny):
    rng, model, camera = np.random.default_rng(2), models['can'], tiny.cameras[0]

    def pixels(points):
        p = transform(inverse(camera.T_world_camera), points)
        return p[:, :2] / p[:, 2:] * [camera.K[0, 0], camera.K[1, 1]]

    for _ in range(4):
        est, true = some_pose(model, rng), some_pose(model, rng)
        expected = min(
            np.linalg.norm(pixels(world(est, model, model.vertices))
                           - pixels(world(true, model, model.vertices @ S.T)), axis=1).max()
            for S in symmetry_rotations(model.symmetry))
        assert mspd(est, true, model, camera) == pytest.approx(expected, rel=1e-9)


def test_mspd_behind_the_camera_is_infinite(models, tiny):
    camera, model = tiny.cameras[0], models['ball']
    true = PosedObject('ball', np.zeros(3), np.array([0, 0, 0, 1.0]), model.extents)
    behind = replace(true, translation=2 * camera.T_world_camera[:3, 3])
    assert mspd(behind, true, model, camera) == np.inf


def test_vsd_agrees_with_the_definition_pixel_by_pixel(models, tiny, make_mesh):
    camera, model = tiny.cameras[0], models['box']
    true = PosedObject('box', np.array([0, 0, 0.03]), np.array([0, 0, 0, 1.0]), model.extents)
    est = replace(true, translation=np.array([0.02, 0.01, 0.035]))
    screen = PosedObject('ball', np.array([0.06, 0.02, 0.11]), np.array([0, 0, 0, 1.0]),
                         models['ball'].extents)
    depth = render_depth([make_mesh(true), make_mesh(screen)], camera)[0]
    depth[::7] = np.nan
    depth[~np.isfinite(depth)] = np.nan
    taus = [0.05, 0.1, 0.3]
    got = vsd(est, true, model, RectifiedView(camera, depth), taus)

    d_est, d_true = (render_depth([make_mesh(p)], camera)[0] for p in (est, true))
    union, costs = 0, np.zeros(len(taus))
    for v in range(camera.height):
        for u in range(camera.width):
            ray = np.linalg.norm([(u - 79.5) / 150, (v - 59.5) / 150, 1])
            e, t, m = d_est[v, u] * ray, d_true[v, u] * ray, depth[v, u] * ray
            free = np.isnan(m)
            seen_t = np.isfinite(t) and (free or t - m <= 0.015)
            seen_e = np.isfinite(e) and (free or e - m <= 0.015 or seen_t)
            if seen_t or seen_e:
                union += 1
                costs += [not (seen_t and seen_e) or abs(e - t) / diameter(true, model) >= tau
                          for tau in taus]
    np.testing.assert_allclose(got, costs / union, atol=2e-3)
    assert 0.1 < got[0] and got[2] < got[0]
    np.testing.assert_array_equal(vsd(true, true, model, RectifiedView(camera, depth), taus), 0)


def test_vsd_is_one_where_neither_is_in_sight(models, tiny):
    camera, model = tiny.cameras[0], models['ball']
    away = PosedObject('ball', np.array([50.0, 0, 0]), np.array([0, 0, 0, 1.0]), model.extents)
    view = RectifiedView(camera, np.full((camera.height, camera.width), np.nan, np.float32))
    np.testing.assert_array_equal(vsd(away, away, model, view, [0.1, 0.5]), 1)


def test_diameter_of_a_box_is_its_diagonal(models):
    model = models['box']
    pose = PosedObject('box', np.zeros(3), np.array([0, 0, 0, 1.0]), np.array([0.3, 0.4, 1.2]))
    assert diameter(pose, model) == pytest.approx(1.3)
