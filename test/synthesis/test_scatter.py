# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
from hooc_perception.core.types import GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.objects.manifold import to_manifold
from hooc_perception.synthesis.scatter import inside, scatter, ScatterConfig, Scatterer
import numpy as np
import pytest
import trimesh


def solids(objects):
    """Return the manifold3d solids of placed objects."""
    return [to_manifold(trimesh.Trimesh(o.vertices_world, o.faces, process=False))
            for o in objects]


def test_scattered_objects_stand_on_the_table_and_share_no_volume(models):
    config = ScatterConfig(objects_low=5, objects_high=6, size_spread=0.1, repeats=1)
    scatterer = Scatterer(models, config)
    for seed in range(12):
        objects = scatterer.scene(np.random.default_rng(seed))
        parts = solids(objects)
        for i, a in enumerate(parts):
            assert objects[i].vertices_world[:, 2].min() == pytest.approx(0, abs=1e-9)
            for b in parts[:i]:
                # manifold3d computes the common solid exactly, independently of fcl.
                assert (a ^ b).volume() < 1e-10


def test_upright_objects_keep_their_axes_and_repeat_only_if_told(models):
    objects = Scatterer(models, ScatterConfig(objects_low=6, objects_high=6)).scene(
        np.random.default_rng(0))
    assert len({o.category for o in objects}) == len(objects) >= 5
    for o in objects:
        extent = np.ptp(o.vertices_world[:, 2])
        assert extent == pytest.approx(models[o.category - 1].extents[2])
    many = Scatterer(models, ScatterConfig(objects_low=14, objects_high=14, repeats=3)).scene(
        np.random.default_rng(0))
    counts = np.bincount([o.category for o in many])
    assert counts.max() in (2, 3)


def test_resting_poses_turn_objects_over(models):
    config = ScatterConfig(objects_low=6, objects_high=6, pose='resting')
    scatterer = Scatterer(models, config)
    heights = {np.round(np.ptp(o.vertices_world[:, 2]), 3) for seed in range(30)
               for o in scatterer.scene(np.random.default_rng(seed)) if o.category == 1}
    assert len(heights) > 1
    assert all(np.min(np.abs(models[0].extents - h)) < 2e-3 for h in heights)


def test_vertices_size_and_pose_agree(models):
    config = ScatterConfig(objects_low=5, objects_high=5, size_spread=0.2)
    for o in scatter(models, np.random.default_rng(1), config):
        R = trimesh.transformations.quaternion_matrix(o.rotation_xyzw[[3, 0, 1, 2]])[:3, :3]
        in_model = (o.vertices_world - o.translation) @ R
        np.testing.assert_allclose(in_model.max(axis=0), o.size / 2, atol=1e-9)
        np.testing.assert_allclose(in_model.min(axis=0), -o.size / 2, atol=1e-9)


def test_crowding_brings_objects_together(models):
    def spread(crowding):
        s = Scatterer(models, ScatterConfig(objects_low=6, objects_high=6, crowding=crowding))
        return np.mean([np.std([o.translation[:2] for o in s.scene(np.random.default_rng(i))])
                        for i in range(20)])
    assert spread(0.9) < 0.7 * spread(0.1)


def test_a_thing_wholly_inside_another_overlaps_it(models):
    big, small = trimesh.creation.box((1, 1, 1)), trimesh.creation.icosphere(2, 0.1)
    none = np.zeros((0, 3), np.float32)
    pair = tuple(GenericModel(n, np.array(m.vertices), np.array(m.faces, np.int32), m.extents,
                              none, none, none, m.volume, np.zeros((0, 4)), np.zeros(0),
                              np.ones(3, np.int32)) for n, m in (('big', big), ('small', small)))
    config = ScatterConfig(objects_low=2, objects_high=2, crowding=1.5, tries=1)
    apart = 0
    for seed in range(60):
        objects = scatter(pair, np.random.default_rng(seed), config)
        if len(objects) == 2:
            box, ball = sorted(objects, key=lambda o: o.category)
            R = trimesh.transformations.quaternion_matrix(box.rotation_xyzw[[3, 0, 1, 2]])[:3, :3]
            assert np.abs((ball.translation - box.translation) @ R).max() > 0.5
            apart += 1
    assert apart > 3


def test_inside_agrees_with_trimesh():
    mesh = trimesh.creation.annulus(0.3, 0.5, 0.4)
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (300, 3))
    faces = mesh.faces.astype(np.int32)
    got = [inside(p, np.array(mesh.vertices), faces) for p in points]
    radius = np.hypot(points[:, 0], points[:, 1])
    clear = (np.abs(radius - 0.3) > 0.01) & (np.abs(radius - 0.5) > 0.01)
    expected = (radius > 0.3) & (radius < 0.5) & (np.abs(points[:, 2]) < 0.2)
    np.testing.assert_array_equal(np.array(got)[clear], expected[clear])


def test_the_same_seed_gives_the_same_scene(models):
    a, b = (scatter(models, np.random.default_rng(5)) for _ in range(2))
    assert len(a) == len(b)
    for x, y in zip(a, b):
        np.testing.assert_array_equal(x.vertices_world, y.vertices_world)


def test_bad_requests_are_refused(models):
    with pytest.raises(HoocError, match='at least one model'):
        scatter((), np.random.default_rng(0))
    with pytest.raises(HoocError, match='objects_low is 9'):
        Scatterer(models, ScatterConfig(objects_low=9, objects_high=3))
