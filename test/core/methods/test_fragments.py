# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Candidates from fragments of a small rendered scene with known poses."""

from dataclasses import replace

from hooc_perception.core.geometry import posed_vertices
from hooc_perception.core.methods.fragments import FragmentConfig, propose_fragments, scene_arrays
from hooc_perception.core.methods.icp import model_cloud
from hooc_perception.core.methods.kernels import fragments as kernels
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import (
    Camera,
    Candidates,
    Observation,
    ObservedView,
    PixelProbabilities,
)
from hooc_perception.errors import HoocError
from hooc_perception.objects.derive import derive
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
import trimesh

BRACKET = trimesh.util.concatenate([
    trimesh.creation.box((.2, .05, .04)),
    trimesh.creation.box((.04, .12, .06), trimesh.transformations.translation_matrix(
        (.08, .05, .01)))])
MODELS = tuple(derive(name, mesh, np.random.default_rng(0)) for name, mesh in (
    ('bracket', BRACKET), ('ball', trimesh.creation.icosphere(3, .05)),
    ('can', trimesh.creation.cylinder(.03, .1))))
CONFIG = FragmentConfig(draws=60)
TRUTH = Candidates(
    np.array([1, 2], np.uint16), np.array([[-.08, .02, .04], [.16, -.05, .05]]),
    Rotation.from_rotvec([[0, 0, 1.1], [0, 0, 0]]).as_quat(),
    np.array([MODELS[0].extents * 1.1, MODELS[1].extents * .9], np.float32),
    np.ones(2, np.float32))


def camera_at(eye, width=200, height=160):
    z = -np.asarray(eye, float) / np.linalg.norm(eye)
    x = np.cross(z, [0, 0, 1])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], 1)
    T[:3, 3] = eye
    K = np.array([[180., 0, (width - 1) / 2], [0, 180, (height - 1) / 2], [0, 0, 1]])
    return Camera('c', width, height, K, np.zeros(5), T)


@pytest.fixture(scope='module')
def scene():
    """Return (observation, probabilities): three noisy views, two pixels in three known."""
    rng = np.random.default_rng(0)
    table = (np.array([[-1., -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]),
             np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    meshes = [table] + [(posed_vertices(MODELS[c - 1], TRUTH.translation[j],
                                        TRUTH.rotation_xyzw[j], TRUTH.size[j]),
                         MODELS[c - 1].faces) for j, c in enumerate(TRUTH.category)]
    views, rows, p = [], [], []
    for i, angle in enumerate(np.radians([0, 120, 240])):
        camera = camera_at((.7 * np.cos(angle), .7 * np.sin(angle), .6))
        depth, ids = render_depth(meshes, camera)
        background = render_depth([table], camera)[0]
        depth = (depth + rng.normal(0, .002, depth.shape)).astype(np.float32)
        depth[~np.isfinite(depth) | (rng.random(depth.shape) < .02)] = np.nan
        background[~np.isfinite(background)] = np.nan
        foreground = (ids > 0) & np.isfinite(depth)
        views.append(ObservedView(camera, depth, background, foreground, ids == 0))
        v, u = np.nonzero(foreground)
        label = np.append(0, TRUTH.category)[ids[v, u]]
        wrong = rng.random(len(u)) < 1 / 3
        label[wrong] = rng.integers(0, 3, wrong.sum())
        own = np.full((len(u), 4), 20, np.uint8)
        own[:, 3] = 0
        own[np.arange(len(u)), label] = 180
        rows.append(np.stack([np.full(len(u), i), u, v], 1))
        p.append(own)
    rows = np.concatenate(rows)
    return Observation(tuple(views), .002), PixelProbabilities(
        rows[:, 0].astype(np.uint8), rows[:, 1:].astype(np.uint16), np.concatenate(p))


@pytest.fixture(scope='module')
def pool(scene):
    return propose_fragments(*scene, MODELS, CONFIG, np.random.default_rng(1))


def surface(objects, i):
    model = MODELS[objects.category[i] - 1]
    scaled = replace(model, vertices=model.surface_points.astype(float))
    return posed_vertices(scaled, objects.translation[i], objects.rotation_xyzw[i],
                          objects.size[i])


def test_the_objects_are_found_in_place(pool):
    for j, c in enumerate(TRUTH.category):
        mine = np.flatnonzero(pool.category == c)
        centre = np.linalg.norm(pool.translation[mine] - TRUTH.translation[j], axis=1)
        assert centre.min() < .012
        # Surfaces agree too, which for the bracket takes the right rotation.
        gaps = [np.mean(cKDTree(surface(TRUTH, j)).query(surface(pool, k))[0]) for k in mine]
        assert min(gaps) < .006


def test_five_each_best_first_none_of_what_nobody_sees(pool):
    assert np.array_equal(pool.category, [1] * 5 + [2] * 5)
    assert np.all(np.diff(pool.score[:5]) <= 0)
    assert np.all(np.diff(pool.score[5:]) <= 0)
    assert np.all((pool.score > .5) & (pool.score <= 1))
    assert np.allclose(np.linalg.norm(pool.rotation_xyzw, axis=1), 1)


def test_sizes_are_fixed_multiples_of_the_model_within_the_range(pool):
    scale = pool.size / np.array([MODELS[c - 1].extents for c in pool.category])
    assert np.allclose(scale, scale[:, :1], rtol=1e-5)
    assert scale.min() >= CONFIG.size_low
    assert scale.max() <= CONFIG.size_high
    assert len(np.unique(scale[:, 0])) > 5


def test_same_seed_same_candidates(scene, pool):
    again = propose_fragments(*scene, MODELS, CONFIG, np.random.default_rng(1))
    other = propose_fragments(*scene, MODELS, CONFIG, np.random.default_rng(2))
    for name in ('category', 'translation', 'rotation_xyzw', 'size', 'score'):
        assert np.array_equal(getattr(pool, name), getattr(again, name))
    assert not np.array_equal(pool.translation, other.translation)


def test_icp_is_what_brings_them_there(scene, pool):
    config = replace(CONFIG, coarse_passes=0, fine_passes=0)
    raw = propose_fragments(*scene, MODELS, config, np.random.default_rng(1))
    assert pool.score[:5].min() > raw.score[:5].max()


def residuals(scene, translation, scale, visible=None):
    """Return (forward, backward) of the ball at a place and scale against its true fragment."""
    parts = scene_arrays(*scene)
    images = parts.images
    fragment = parts.points[np.linalg.norm(parts.points - TRUTH.translation[1], axis=1) < .06]
    if visible is not None:
        images = images._replace(depth=np.where(visible, images.depth, .3).astype('f4'))
    rules = kernels.Rules(.0, .0, 48, 0, 0, 20, 128, truncation_m=.02, score_step=4)
    return kernels.disagreement(
        fragment, len(fragment), model_cloud(MODELS[1]),
        kernels.Pose(scale, np.eye(3), np.asarray(translation)), rules, images)


def test_both_residuals_are_small_at_the_truth_and_each_rises_for_its_own_fault(scene):
    truth = TRUTH.translation[1]
    forward, backward = residuals(scene, truth, .9)
    # Noise of 2 mm over 20 mm; two views glance along the ball's far side.
    assert forward < .15
    assert backward < .25
    small_forward, small_backward = residuals(scene, truth, .4)
    assert small_forward > .9
    # Inside of the true ball the small one is hidden and cannot contradict anything.
    assert small_backward == 1.0
    big_forward, big_backward = residuals(scene, truth, 1.8)
    assert big_forward > .9
    assert big_backward > .9
    beside_forward, beside_backward = residuals(scene, truth + [0, 0, .3], .9)
    assert beside_forward == 1.0
    assert beside_backward == 1.0


def test_what_something_nearer_hides_is_not_held_against_the_model(scene):
    first_view = np.arange(3 * 200 * 160) < 200 * 160
    forward, backward = residuals(scene, TRUTH.translation[1], .9, first_view)
    assert forward < .15
    assert backward < .25
    assert residuals(scene, TRUTH.translation[1], .9, np.zeros_like(first_view))[1] == 1.0


def test_nothing_listed_and_fragments_too_small_give_nothing(scene):
    observation, probabilities = scene
    none = PixelProbabilities(*(a[:0] for a in (probabilities.camera, probabilities.uv,
                                                probabilities.p)))
    assert len(propose_fragments(observation, none, MODELS, CONFIG, np.random.default_rng(0))) == 0
    few = PixelProbabilities(*(a[:12] for a in (probabilities.camera, probabilities.uv,
                                                probabilities.p)))
    assert len(propose_fragments(observation, few, MODELS, CONFIG, np.random.default_rng(0))) == 0


def test_bad_parameters_are_named():
    with pytest.raises(HoocError, match='draws'):
        FragmentConfig(draws=0)
