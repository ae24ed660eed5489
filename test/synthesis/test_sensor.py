# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

from hooc_perception.core.geometry import rays
from hooc_perception.errors import HoocError
from hooc_perception.synthesis import sensor_kernels
from hooc_perception.synthesis.sensor import (
    KINECT_V1,
    miscalibrated,
    randomised,
    sense,
    SensorConfig,
    smooth_field,
)
import numpy as np
import pytest

NOTHING_BUT_NOISE = SensorConfig(drift_m=0.0, random_dropout=0.0, signal_floor=0.0,
                                 quantum_m=0.0)
MIDDLE = np.s_[150:270, 190:320]


def wall(z=1.0):
    """Return (depth, ids) of a frontal plane at z metres."""
    return np.full((424, 512), z, np.float32), np.full((424, 512), -1, np.int32)


def tilted(camera, angle):
    """Return clean depth of a plane through (0, 0, 1), turned about x by `angle` radians."""
    ray = rays(camera.K, 424, 512)
    normal = np.array([0, np.sin(angle), np.cos(angle)])
    depth = normal[2] / (ray @ normal)
    return np.where((depth > 0) & (depth < 4), depth, np.inf).astype(np.float32)


def step(camera):
    """Return (depth, ids) of a square at 0.8 m (id 0) before a wall at 1.2 m."""
    depth, ids = wall(1.2)
    depth[150:250, 200:300] = 0.8
    ids[150:250, 200:300] = 0
    return depth, ids


def test_axial_noise_grows_as_fankhauser_measured(camera):
    for z in (0.8, 1.0, 2.0, 3.0):
        depth, ids = wall(z)
        out, _ = sense(depth, ids, camera, np.random.default_rng(0), NOTHING_BUT_NOISE)
        # The published fit, in millimetres, for a frontal surface.
        expected = 1.5 - 0.5 * z + 0.3 * z * z
        assert 1e3 * np.std(out[MIDDLE]) == pytest.approx(expected, rel=0.15)
        assert np.mean(out[MIDDLE]) == pytest.approx(z, abs=1e-4)


def test_grazing_surfaces_are_noisier(camera):
    spread = []
    for angle in (0.0, 1.0, 1.35):
        depth = tilted(camera, angle)
        out, _ = sense(depth, wall()[1], camera, np.random.default_rng(0), NOTHING_BUT_NOISE)
        error = (out - depth)[200:224, 200:300]
        spread.append(np.nanstd(error))
    assert spread[0] < spread[1] < spread[2]


def test_incidence_is_that_of_the_plane(camera):
    for angle in (0.0, 0.6, 1.1):
        depth = tilted(camera, angle)
        got = sensor_kernels.incidence(depth, 366.0, 366.0, 255.5, 211.5)
        ray = rays(camera.K, 424, 512)
        normal = np.array([0, np.sin(angle), np.cos(angle)])
        expected = np.abs(ray @ normal) / np.linalg.norm(ray, axis=-1)
        near = np.s_[180:240, 10:500]
        np.testing.assert_allclose(got[near], expected[near], atol=0.02)


def test_normals_take_the_place_of_slopes(camera):
    depth, ids = wall()
    normals = np.zeros((424, 512, 3))
    normals[..., 1:] = -np.sin(1.45), -np.cos(1.45)
    grazing, _ = sense(depth, ids, camera, np.random.default_rng(0), NOTHING_BUT_NOISE,
                       normals=normals)
    frontal, _ = sense(depth, ids, camera, np.random.default_rng(0), NOTHING_BUT_NOISE)
    assert np.nanstd(grazing[MIDDLE]) > 1.5 * np.nanstd(frontal[MIDDLE])


def test_readings_are_whole_millimetres_inside_the_range(camera):
    depth, ids = wall()
    depth[:50], depth[50:100], depth[100:150] = np.inf, 0.3, 5.0
    out, _ = sense(depth, ids, camera, np.random.default_rng(0))
    assert np.isnan(out[:145]).all()
    lost = np.isnan(out[160:]).mean()
    assert 0.004 < lost < 0.012
    counts = out[160:][~np.isnan(out[160:])] * 1000
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-3)


def test_far_grazing_surfaces_lose_readings(camera):
    depth, ids = wall(4.0)
    normals = np.zeros((424, 512, 3))
    normals[..., 1:] = -np.sin(1.3), -np.cos(1.3)
    out, _ = sense(depth, ids, camera, np.random.default_rng(0), normals=normals)
    assert np.isnan(out).mean() > 0.3


def test_flying_pixels_stand_between_the_surfaces_and_at_edges_only(camera):
    depth, ids = step(camera)
    out, seen = sense(depth, ids, camera, np.random.default_rng(0))
    between = (out > 0.84) & (out < 1.16)
    assert 30 < between.sum() < 800
    rows, cols = np.nonzero(between)
    gap = np.max([150 - rows, rows - 249, 200 - cols, cols - 299], axis=0)
    assert np.abs(gap).max() <= 4
    without, _ = sense(depth, ids, camera, np.random.default_rng(0), replace(
        SensorConfig(), flying=0.0))
    assert not ((without > 0.84) & (without < 1.16)).any()


def test_ids_name_the_surface_that_was_read(camera):
    depth, ids = step(camera)
    config = replace(NOTHING_BUT_NOISE, flying=0.0, edge_dropout=0.0, lateral_px=0.8)
    out, seen = sense(depth, ids, camera, np.random.default_rng(0), config)
    assert (seen != ids).sum() > 20
    np.testing.assert_array_equal(seen == 0, out < 1.0)


def test_glass_is_read_too_far_by_another_amount_in_every_view(camera):
    depth, ids = step(camera)
    inner = np.s_[160:240, 210:290]
    shifts = []
    for seed in range(6):
        out, _ = sense(depth, ids, camera, np.random.default_rng(seed), translucent_ids=(0,))
        assert 0.25 < np.isnan(out[inner]).mean() < 0.5
        shifts.append(np.nanmedian(out[inner]) - 0.8)
        assert abs(np.nanmedian(out[300:]) - 1.2) < 0.004
    assert min(shifts) > 0.005 and max(shifts) < 0.05
    assert np.std(shifts) > 0.003


def test_glass_is_not_read_behind_what_stands_behind_it(camera):
    depth, ids = step(camera)
    behind = np.full_like(depth, 0.805)
    out, _ = sense(depth, ids, camera, np.random.default_rng(1), translucent_ids=(0,),
                   behind=behind)
    assert np.nanmedian(out[160:240, 210:290]) < 0.8065


def test_structured_light_shadow_falls_left(camera):
    depth, ids = step(camera)
    out, _ = sense(depth, ids, camera, np.random.default_rng(0), KINECT_V1)
    rows = slice(170, 230)
    # The shadow is baseline * focal length * (1 / near - 1 / far) pixels wide.
    width = 0.075 * 366 * (1 / 0.8 - 1 / 1.2)
    left = np.isnan(out[rows, 200 - int(width) + 2:198]).mean()
    right = np.isnan(out[rows, 302:310]).mean()
    assert left > 0.9 and right < 0.1


def test_structured_light_steps_grow_with_the_square_of_distance(camera):
    steps = []
    for z in (1.0, 2.0):
        depth, ids = wall(z)
        config = replace(KINECT_V1, quantum_m=0.0, drift_m=0.0)
        out, _ = sense(depth, ids, camera, np.random.default_rng(0), config)
        steps.append(np.median(np.diff(np.unique(out[~np.isnan(out)]))))
    assert steps[0] == pytest.approx(0.00285, rel=0.1)
    assert steps[1] / steps[0] == pytest.approx(4.0, rel=0.15)


def test_same_generator_state_gives_the_same_view(camera):
    depth, ids = step(camera)
    first = sense(depth, ids, camera, np.random.default_rng(3))[0]
    np.testing.assert_array_equal(first, sense(depth, ids, camera, np.random.default_rng(3))[0])
    other = sense(depth, ids, camera, np.random.default_rng(4))[0]
    assert not np.array_equal(first, other, equal_nan=True)


def test_no_sensor_passes_depth_through(camera):
    depth, ids = step(camera)
    depth[0] = np.inf
    out, seen = sense(depth, ids, camera, np.random.default_rng(0), SensorConfig(model='none'))
    assert np.isnan(out[0]).all()
    np.testing.assert_array_equal(out[1:], depth[1:])
    np.testing.assert_array_equal(seen, ids)


def test_smooth_field_is_smooth_and_of_unit_variance():
    fields = np.array([smooth_field((106, 128), np.random.default_rng(i)) for i in range(60)])
    assert fields.std() == pytest.approx(1.0, rel=0.25)
    assert np.abs(np.diff(fields, axis=2)).max() < 0.3


def test_miscalibration_has_the_size_that_was_asked_for(cameras):
    rng = np.random.default_rng(0)
    moved = [miscalibrated(cameras[0], rng, 0.01, 0.02) for _ in range(300)]
    shift = np.array([m.T_world_camera[:3, 3] for m in moved]) - cameras[0].T_world_camera[:3, 3]
    assert shift.std() == pytest.approx(0.02, rel=0.15)
    turn = [cameras[0].T_world_camera[:3, :3].T @ m.T_world_camera[:3, :3] for m in moved]
    angle = np.array([np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1)) for R in turn])
    assert np.sqrt(np.mean(angle ** 2) / 3) == pytest.approx(0.01, rel=0.15)


def test_randomised_sensors_differ_and_some_are_structured_light():
    rng = np.random.default_rng(0)
    drawn = [randomised(SensorConfig(), rng) for _ in range(100)]
    assert 2 <= sum(c.model == 'kinect_v1' for c in drawn) <= 25
    assert np.std([c.noise_scale for c in drawn]) > 0.1


def test_shapes_that_differ_are_refused(camera):
    with pytest.raises(HoocError, match='same camera'):
        sense(np.ones((4, 5), np.float32), np.ones((5, 4), np.int32), camera,
              np.random.default_rng(0))
