# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Things of no category in training scenes."""

from dataclasses import replace

from hooc_perception.core.segment.observe import observe
from hooc_perception.objects.derive import derive
from hooc_perception.synthesis import strangers
from hooc_perception.synthesis.rigs import ring
from hooc_perception.synthesis.scatter import ScatterConfig
from hooc_perception.synthesis.settle import settled_models
from hooc_perception.synthesis.strangers import STRANGER, Strangers
from hooc_perception.synthesis.training_scenes import training_scene, TrainingConfig
import numpy as np
import pytest
import trimesh

CONFIG = TrainingConfig(arrangement='settled', rig='given', strangers=4,
                        scatter=ScatterConfig(objects_low=2, objects_high=3, repeats=2))


@pytest.fixture(scope='module')
def models():
    """Return the generic models of a box and a ball."""
    rng = np.random.default_rng(0)
    return (derive('box', trimesh.creation.box((0.1, 0.06, 0.08)), rng, 100, 50),
            derive('ball', trimesh.creation.icosphere(2, 0.04), rng, 100, 50))


@pytest.mark.parametrize('k', range(len(strangers.MAKERS)))
def test_every_kind_of_shape_is_solid_and_of_the_size_of_things(k):
    mesh, pieces = strangers._procedural(k)
    assert strangers.SMALLEST_M * 0.99 < mesh.extents.max() < strangers.LARGEST_M * 1.01
    np.testing.assert_allclose(mesh.bounds.mean(0), 0, atol=1e-9)
    assert len(mesh.split(only_watertight=True)) >= 1
    every = np.concatenate(pieces)
    # Physics sees what the cameras see.
    np.testing.assert_allclose([every.min(0), every.max(0)], mesh.bounds, atol=0.01)


def test_shapes_differ_and_are_the_same_for_a_seed():
    maker = Strangers(['box'])
    bodies = [maker.body(np.random.default_rng(k), 1.0) for k in (1, 2, 1)]
    assert all(body.category == STRANGER and body.pieces for body in bodies)
    np.testing.assert_array_equal(bodies[0].vertices, bodies[2].vertices)
    assert bodies[0].vertices.shape != bodies[1].vertices.shape or not np.allclose(
        bodies[0].vertices, bodies[1].vertices)


def test_members_of_the_own_families_are_no_strangers():
    assert 'teacup' not in Strangers(['mug', 'teacup'])._families
    assert 'teacup' in Strangers(['plate'])._families


def test_their_pixels_are_background(models):
    cameras, seen = ring(np.random.default_rng(0), 2), 0
    for k in range(6):
        scene = training_scene(models, cameras, np.random.default_rng(k), CONFIG)
        alone = [o for o in scene.objects if o.category == STRANGER]
        seen += len(alone)
        assert {int(c) for labels in scene.labels for c in np.unique(labels)} <= {
            0, *(o.category for o in scene.objects)}
        # By themselves they stand out of the table, without a class.
        by_themselves = training_scene(models, cameras, np.random.default_rng(k), CONFIG,
                                       objects=alone)
        assert not any(labels.any() for labels in by_themselves.labels)
        if alone:
            views = observe(by_themselves.views).views
            assert sum(int(view.foreground.sum()) for view in views) > 50
    assert seen > 3


def test_without_strangers_scenes_are_as_they_were(models):
    plain = [settled_models(models, np.random.default_rng(3), CONFIG.scatter, 1.0)
             for _ in range(2)]
    asked = settled_models(models, np.random.default_rng(3), CONFIG.scatter, 1.0, strangers=0)
    assert [o.category for o in plain[0]] == [o.category for o in asked]
    for a, b in zip(plain[0], asked):
        np.testing.assert_array_equal(a.translation, b.translation)
    other = replace(CONFIG, strangers=0)
    assert all(o.category for o in training_scene(
        models, ring(np.random.default_rng(0), 1), np.random.default_rng(1), other).objects)
