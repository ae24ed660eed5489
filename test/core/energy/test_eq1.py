# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Eq. 1 by hand on four pixels, and against a dense numpy composition of rendered scenes."""

from hooc_perception.core.energy.eq1 import energy_of, Eq1
from hooc_perception.core.geometry import posed_vertices
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import (
    Camera,
    Candidates,
    Observation,
    ObservedView,
    PixelProbabilities,
)
from hooc_perception.objects.derive import derive
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

MODELS = tuple(derive(name, mesh, np.random.default_rng(0)) for name, mesh in (
    ('box', trimesh.creation.box((.12, .08, .06))), ('ball', trimesh.creation.icosphere(3, .04)),
    ('rod', trimesh.creation.cylinder(.01, .2))))


def placed(*rows):
    """Return Candidates from rows (class id, translation, rotation vector, size)."""
    if not rows:
        return Candidates.empty()
    category, t, r, size = zip(*rows)
    return Candidates(np.array(category, np.uint16), np.array(t, float),
                      Rotation.from_rotvec(np.array(r, float)).as_quat(),
                      np.array(size, np.float32), np.zeros(len(rows), np.float32))


def four_pixels(depth, background, listed, p):
    """Return (observation, probabilities) of a 4 x 1 camera that looks down from 1 m."""
    camera = Camera('c', 4, 1, np.array([[10., 0, 1.5], [0, 10, 0], [0, 0, 1]]), np.zeros(5),
                    np.array([[1., 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 1], [0, 0, 0, 1]]))
    view = ObservedView(camera, np.array([depth], np.float32), np.array([background], np.float32),
                        np.zeros((1, 4), bool), np.ones((1, 4), bool))
    uv = np.array([[u, 0] for u in listed], np.uint16).reshape(-1, 2)
    return (Observation((view,), .002),
            PixelProbabilities(np.zeros(len(listed), np.uint8), uv,
                               np.array(p, np.uint8).reshape(len(listed), 4)))


def test_four_pixels_by_hand():
    # Pixel centres lie at x = -.15, -.05, .05, .15 times the depth. The box covers pixels 1 and 2
    # at .94 m; 0 is the table; 3 has no reading and does not count.
    observation, probabilities = four_pixels(
        [1.0, .96, .5, np.nan], [1.0, 1.0, 1.0, 1.0], [1, 2], [[51, 204, 0, 0], [255, 0, 0, 0]])
    box = placed((1, (0, 0, .03), (0, 0, 0), (.12, .08, .06)))
    empty = energy_of(observation, probabilities, placed(), MODELS)
    assert empty.depth == pytest.approx((0 + .4 + 1) / 3)
    assert empty.probability == pytest.approx((0 + .8 + 0) / 3)
    assert empty.overlap == 0
    with_box = energy_of(observation, probabilities, box, MODELS)
    assert with_box.depth == pytest.approx((0 + .2 + 1) / 3, abs=1e-6)
    assert with_box.probability == pytest.approx((0 + .2 + 1) / 3)
    assert with_box.overlap == 0
    # The right class: the same box under the name of a ball is a miss in both pixels.
    other = placed((2, (0, 0, .03), (0, 0, 0), (.12, .12, .12)))
    assert energy_of(observation, probabilities, other, MODELS).probability == (
        pytest.approx((0 + 1 + 1) / 3))


def test_unknown_background_costs_no_depth_and_a_nearer_background_hides():
    observation, probabilities = four_pixels(
        [1.0, .96, .5, 1.0], [1.0, np.nan, .5, 1.0], [], [])
    box = placed((1, (0, 0, .03), (0, 0, 0), (.12, .08, .06)))
    empty = energy_of(observation, probabilities, placed(), MODELS)
    assert (empty.depth, empty.probability) == (0, 0)
    with_box = energy_of(observation, probabilities, box, MODELS)
    assert with_box.depth == pytest.approx(.2 / 4, abs=1e-6)
    assert with_box.probability == pytest.approx(1 / 4)


def test_two_copies_in_one_place_overlap_wholly():
    observation, probabilities = four_pixels([1.0] * 4, [1.0] * 4, [], [])
    box = (1, (0, 0, .03), (0, 0, 0), (.12, .08, .06))
    far = (2, (1, 1, .04), (0, 0, 0), (.08, .08, .08))
    assert energy_of(observation, probabilities, placed(box, box, far), MODELS).overlap == (
        pytest.approx(2 / 3))


def test_no_reading_anywhere_is_no_energy():
    observation, probabilities = four_pixels([np.nan] * 4, [1.0] * 4, [], [])
    box = placed((1, (0, 0, .03), (0, 0, 0), (.12, .08, .06)))
    assert energy_of(observation, probabilities, box, MODELS).total == 0


def camera_at(eye, width=96, height=80):
    """Return a camera at `eye` that looks at the table's centre."""
    z = -np.asarray(eye, float) / np.linalg.norm(eye)
    x = np.cross(z, [0, 0, 1])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], 1)
    T[:3, 3] = eye
    K = np.array([[90., 0, (width - 1) / 2], [0, 90, (height - 1) / 2], [0, 0, 1]])
    return Camera('c', width, height, K, np.zeros(5), T)


def rendered(rng):
    """Return (observation, probabilities, pool) of a noisy scene in two views."""
    def some(n):
        return placed(*[(c, np.append(rng.uniform(-.15, .15, 2), .04), rng.normal(size=3),
                         MODELS[c - 1].extents * rng.uniform(.8, 1.2))
                        for c in rng.integers(1, 4, n)])

    truth, pool = some(5), some(12)
    table = (np.array([[-1., -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]),
             np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    views, rows = [], []
    for i, eye in enumerate([(.7, .1, .6), (-.5, .5, .7)]):
        camera = camera_at(eye)
        meshes = [(posed_vertices(MODELS[c - 1], truth.translation[j], truth.rotation_xyzw[j],
                                  truth.size[j]), MODELS[c - 1].faces)
                  for j, c in enumerate(truth.category)]
        depth, ids = render_depth([table, *meshes], camera)
        background = render_depth([table], camera)[0]
        background[~np.isfinite(background)] = np.nan
        background[rng.random(background.shape) < .05] = np.nan
        depth[~np.isfinite(depth)] = np.nan
        depth[rng.random(depth.shape) < .05] = np.nan
        views.append(ObservedView(camera, depth + np.float32(.003) * rng.normal(
            size=depth.shape).astype(np.float32), background, ids > 0, ids >= 0))
        v, u = np.nonzero((ids > 0) & np.isfinite(depth))
        rows.append(np.stack([np.full(len(u), i), u, v], 1))
    rows = np.concatenate(rows)
    p = rng.dirichlet(np.ones(4), len(rows)) * 255
    return (Observation(tuple(views), .003),
            PixelProbabilities(rows[:, 0].astype(np.uint8), rows[:, 1:].astype(np.uint16),
                               p.astype(np.uint8)), pool.extended(truth))


def reference(observation, probabilities, objects):
    """Return (depth, probability) of Eq. 1, image by image, with dense arrays."""
    depth_sum = miss_sum = count = 0
    for i, view in enumerate(observation.views):
        meshes = [(posed_vertices(MODELS[c - 1], objects.translation[k],
                                  objects.rotation_xyzw[k], objects.size[k]), MODELS[c - 1].faces)
                  for k, c in enumerate(objects.category)]
        depth, ids = render_depth(meshes, view.camera)
        ids[depth > view.background] = -1
        shown = np.where(ids >= 0, objects.category[ids] if len(objects) else 0, 0)
        composed = np.where(ids >= 0, depth, view.background)
        composed = np.where(np.isfinite(composed), composed, view.depth)
        p = np.zeros((*view.depth.shape, 4))
        p[..., 0] = 1
        mine = probabilities.camera == i
        u, v = probabilities.uv[mine].T
        p[v, u] = probabilities.p[mine] / 255
        read = np.isfinite(view.depth)
        depth_sum += np.minimum(np.abs(composed - view.depth), .1)[read].sum() / .1
        seen = np.take_along_axis(p, shown[..., None].astype(int), 2)[..., 0]
        miss_sum += (1 - seen[read]).sum()
        count += read.sum()
    return depth_sum / count, miss_sum / count


def test_subsets_of_rendered_scenes_agree_with_dense_numpy():
    rng = np.random.default_rng(7)
    observation, probabilities, pool = rendered(rng)
    eq1 = Eq1(observation, probabilities, pool, MODELS)
    for share in (0, .1, .3, .6, 1):
        mask = rng.random(len(pool)) < share
        energy = eq1.energy(mask)
        depth, probability = reference(observation, probabilities, pool.take(mask))
        assert energy.depth == pytest.approx(depth, abs=1e-7)
        assert energy.probability == pytest.approx(probability, abs=1e-12)
        assert eq1.evaluate(mask) == pytest.approx(energy.total, abs=1e-6)


def test_every_flip_of_a_walk_agrees_with_the_whole():
    rng = np.random.default_rng(8)
    observation, probabilities, pool = rendered(rng)
    eq1 = Eq1(observation, probabilities, pool, MODELS)
    mask = np.zeros(len(pool), bool)
    for k in rng.integers(0, len(pool), 50):
        deltas = eq1.deltas()
        for i in range(len(pool)):
            flipped = mask.copy()
            flipped[i] ^= True
            assert eq1.evaluate(flipped) - eq1.value == pytest.approx(deltas[i], abs=1e-12)
        eq1.flip(k)
        mask[k] ^= True
        assert np.array_equal(eq1.mask, mask)
        assert eq1.value == eq1.evaluate(mask)
    eq1.reset(np.zeros(len(pool), bool))
    assert eq1.value == eq1.evaluate(np.zeros(len(pool), bool))


@pytest.mark.parametrize('most', [0, 1])
def test_deltas_without_a_member_equal_those_after_its_flip(most, deltas_by_flips):
    rng = np.random.default_rng(11)
    observation, probabilities, pool = rendered(rng)
    eq1 = Eq1(observation, probabilities, pool, MODELS, max_instances=most)
    for share in (0, .1, .3, .6):
        eq1.reset(rng.random(len(pool)) < share)
        members = np.flatnonzero(eq1.mask)
        assert np.array_equal(eq1.deltas_without(members), deltas_by_flips(eq1, members))


def test_the_truth_beats_the_empty_scene_on_depth():
    observation, probabilities, pool = rendered(np.random.default_rng(9))
    truth = energy_of(observation, probabilities, pool.take(np.arange(12, 17)), MODELS)
    assert truth.depth < .5 * energy_of(observation, probabilities, placed(), MODELS).depth


def test_no_more_than_max_instances_may_join():
    observation, probabilities, pool = rendered(np.random.default_rng(10))
    eq1 = Eq1(observation, probabilities, pool, MODELS, max_instances=1)
    k = 4
    eq1.flip(k)
    same = pool.category == pool.category[k]
    same[k] = False
    assert same.any()
    assert np.array_equal(np.isinf(eq1.deltas()), same)
