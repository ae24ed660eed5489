# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

from hooc_perception.core.geometry import back_project
from hooc_perception.errors import HoocError
from hooc_perception.synthesis.scatter import ScatterConfig
from hooc_perception.synthesis.sensor import SensorConfig
from hooc_perception.synthesis.training_scenes import (
    BEST,
    PAPER,
    training_scene,
    training_scenes,
    TrainingConfig,
)
import numpy as np
import pytest

SMALL = ScatterConfig(objects_low=3, objects_high=6)


@pytest.fixture(scope='module')
def scene(models, cameras):
    """Return one scattered scene without sensor errors."""
    config = TrainingConfig(scatter=SMALL, sensor=SensorConfig(model='none'),
                            calibration_rad=0.0, calibration_m=0.0)
    return training_scene(models, cameras, np.random.default_rng(0), config)


def test_labels_name_the_object_that_a_pixel_shows(scene, models):
    for view, labels in zip(scene.views, scene.labels):
        assert view.depth.dtype == np.float32 and labels.dtype == np.uint8
        assert view.depth.shape == labels.shape == (424, 512)
        points = back_project(view.depth, view.camera)
        assert labels.any()
        for o in scene.objects:
            mine = points[labels == o.category]
            low, high = o.vertices_world.min(axis=0), o.vertices_world.max(axis=0)
            assert np.all((mine > low - 2e-3) & (mine < high + 2e-3))
            # And nothing inside its box's core is called background.
            middle, half = (low + high) / 2, (high - low) / 2
            core = np.all(np.abs(points - middle) < 0.3 * half, axis=-1) & np.isfinite(view.depth)
            assert not (core & (labels == 0) & (points[..., 2] > 0.005)).any()


def test_the_table_lies_at_zero_and_has_an_end(scene):
    points = back_project(scene.views[0].depth, scene.views[0].camera)
    background = points[(scene.labels[0] == 0) & np.isfinite(scene.views[0].depth)]
    table = np.abs(background[:, 2]) < 1e-4
    assert table.sum() > 20000
    # Past the table's corner and before the nearest wall, nothing is at its height.
    radius = np.linalg.norm(background[table][:, :2], axis=1)
    assert not ((radius > 1.45) & (radius < 1.6)).any()


def test_scene_k_depends_on_seed_and_k_alone(models, cameras):
    config = replace(PAPER, scatter=SMALL)
    nine = list(training_scenes(models, cameras, config, seed=3, n=9))
    two = list(training_scenes(models, cameras, config, seed=3, n=2))
    for a, b in zip(two, nine):
        for x, y in zip(a.views, b.views):
            np.testing.assert_array_equal(x.depth, y.depth)
    other = next(training_scenes(models, cameras, config, seed=3, n=1, stage='leaves'))
    assert not np.array_equal(other.views[0].depth, nine[0].views[0].depth, equal_nan=True)


def test_processes_do_not_change_the_scenes(models, cameras):
    config = replace(PAPER, scatter=SMALL)
    one = list(training_scenes(models, cameras, config, seed=1, n=10))
    two = list(training_scenes(models, cameras, config, seed=1, n=10, jobs=2))
    assert len(one) == len(two) == 10
    for a, b in zip(one, two):
        for x, y in zip(a.labels, b.labels):
            np.testing.assert_array_equal(x, y)


def test_renders_share_an_arrangement_but_not_the_rig(models, cameras):
    config = replace(BEST, scatter=SMALL, renders=2)
    a, b, c = training_scenes(models, cameras, config, seed=0, n=3)
    assert len(a.objects) == len(b.objects)
    for x, y in zip(a.objects, b.objects):
        np.testing.assert_array_equal(x.vertices_world, y.vertices_world)
    assert not np.allclose(a.views[0].camera.T_world_camera, b.views[0].camera.T_world_camera)
    assert not np.array_equal(a.objects[0].vertices_world, c.objects[0].vertices_world)


def test_random_rigs_have_the_number_of_cameras_asked_for(models, cameras):
    config = TrainingConfig(scatter=SMALL, rig='random', cameras_low=1, cameras_high=3)
    counts = {len(s.views) for s in training_scenes(models, cameras, config, n=12)}
    assert counts == {1, 2, 3}


def test_random_rigs_look_at_the_objects(models, cameras):
    config = TrainingConfig(scatter=SMALL, rig='random')
    for s in training_scenes(models, cameras, config, n=6):
        assert all((labels > 0).sum() > 200 for labels in s.labels)


def test_reshaped_scatter_departs_from_the_models(models, cameras):
    config = TrainingConfig(scatter=SMALL, reshape_strength=1.0)
    s = training_scene(models, cameras, np.random.default_rng(0), config)
    ratio = [o.size / models[o.category - 1].extents for o in s.objects]
    assert np.std(ratio) > 0.05


def test_cameras_are_written_a_little_wrong(models, cameras):
    config = TrainingConfig(scatter=SMALL, calibration_m=0.01)
    s = training_scene(models, cameras, np.random.default_rng(0), config)
    off = np.linalg.norm(s.views[0].camera.T_world_camera[:3, 3]
                         - cameras[0].T_world_camera[:3, 3])
    assert 0.001 < off < 0.06


def test_no_cameras_are_refused(models):
    with pytest.raises(HoocError, match='at least one camera'):
        training_scene(models, (), np.random.default_rng(0))
