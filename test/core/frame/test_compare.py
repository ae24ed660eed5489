# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Hypotheses rendered and compared with the images: kernels against pixel by pixel Python."""

from collections import Counter
from types import SimpleNamespace

from hooc_perception.core.frame.evidence import hypotheses_of
from hooc_perception.core.frame.kernels import compare as kernel
from hooc_perception.core.frame.kernels import pixel_cost
from hooc_perception.core.frame.kernels.pixel_lists import PixelLists
from hooc_perception.core.frame.kernels.records import PixelWeights, RefineSettings
from hooc_perception.core.geometry import posed_vertices
from hooc_perception.core.render import render_depth, render_patch
import numba
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

WEIGHTS = PixelWeights()


@pytest.fixture(scope='module')
def scene(desk):
    """Return the desk, its full Evidence, and 18 hypotheses: true, near, far, of other classes."""
    evidence = desk.frame.evidence
    rng, rows, category = np.random.default_rng(4), [], []
    true = hypotheses_of(desk.truth, desk.frame.shapes)
    for k in range(18):
        h, spread = true[k % 3].copy(), (0, 0.004, 0.015, 0.05)[k // 3 % 4]
        h[:3] += rng.normal(0, spread, 3)
        h[3:7] = (Rotation.from_rotvec(rng.normal(0, 10 * spread, 3))
                  * Rotation.from_quat(h[3:7])).as_quat()
        h[7:10] *= np.exp(rng.normal(0, 3 * spread, 3))
        rows.append(h)
        category.append(k % 3 + 1 if k < 12 else (k + 1) % 3 + 1)
    category = np.array(category)
    # Every family has one member.
    return SimpleNamespace(desk=desk, evidence=evidence, H=np.array(rows), category=category,
                           shape=category - 1, true=true)


def mesh_of(scene, h, c):
    """Return the world (vertices, faces) of a hypothesis."""
    model = scene.desk.models[c - 1]
    return posed_vertices(model, h[:3], h[3:7], h[7:10] * model.extents), model.faces


def shown_pixels(scene, h, c):
    """Yield (pixel of all views, view, depth, unit normal towards the camera) by render_patch."""
    vertices, faces = mesh_of(scene, h, c)
    first = 0
    for k, view in enumerate(scene.desk.observation.views):
        camera = view.camera
        pixels, depth = render_patch(vertices, faces, camera)
        face = render_depth([(vertices, f[None]) for f in faces], camera)[1].ravel()[pixels]
        corners = vertices[faces[face]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        towards = camera.T_world_camera[:3, 3] - corners[:, 0]
        normals *= np.where((normals * towards).sum(1) < 0, -1, 1)[:, None]
        yield from zip(pixels + first, [k] * len(pixels), depth, normals)
        first += view.depth.size


def plain_cost(residual, foreground, cosine, unlikely, w=WEIGHTS):
    """Return (cost, state) of a pixel, see kernels/pixel_cost.py."""
    if not foreground:
        return w.free * min(1.0, abs(residual) / w.tolerance_m), pixel_cost.SEEN_THROUGH
    if residual >= w.tolerance_m:
        return 1.0 + 0.5 * w.category, pixel_cost.OCCLUDED
    if residual <= -w.tolerance_m:
        return 0.5 + 0.5 * w.free + 0.5 * w.category, pixel_cost.SEEN_THROUGH
    return (abs(residual) / w.tolerance_m + w.normal * (1 - max(0.0, cosine))
            + w.category * unlikely), pixel_cost.AGREES


def plain(scene, h, c, context=None, me=-1):
    """Return ({statistic: value}, [(pixel, depth, cost)]) of one hypothesis."""
    e = scene.evidence.views
    probability = {}
    for camera, (u, v), p in zip(scene.desk.probabilities.camera, scene.desk.probabilities.uv,
                                 scene.desk.probabilities.p):
        width = scene.desk.cameras[camera].width
        first = sum(x.depth.size for x in scene.desk.observation.views[:camera])
        probability[first + int(v) * width + int(u)] = p[c] / 255
    owner, depth_1, cost_1, depth_2, cost_2 = (
        scene.evidence.nothing if context is None else context)
    stats, hits, entries, views = Counter(), Counter(), [], set()
    for i, k, z, normal in shown_pixels(scene, h, c):
        before, base = ((depth_2, cost_2) if owner[i] == me else (depth_1, cost_1))
        stats['SHOWN'] += 1
        if before[i] < z:
            stats['BEHIND'] += 1
            continue
        if not e.depth[i] > 0:
            stats['MISSING'] += 1
            continue
        cosine = normal @ e.normals[i] if e.foreground[i] and np.isfinite(e.normals[i, 0]) else 1.0
        p = probability.get(i, 0.0)
        unlikely = min(1.0, -np.log(max(p, 0.002)) / 4)
        cost, state = plain_cost(float(z) - float(e.depth[i]), e.foreground[i], cosine, unlikely)
        entries.append((i, z, cost))
        stats['DELTA'] += float(cost) - float(base[i])
        if state == pixel_cost.AGREES:
            stats['AGREE'] += 1
            stats['GAIN'] += 1 - cost
            stats['COS'] += cosine
            stats['RESIDUAL'] += abs(float(z) - float(e.depth[i]))
            stats['UNLIKELINESS'] += unlikely
            views.add(k)
            if e.patch[i] >= 0:
                hits[e.patch[i]] += 1
        elif state == pixel_cost.SEEN_THROUGH:
            stats['VIOLATE'] += 1.0 if e.foreground[i] else cost
        else:
            stats['BEHIND'] += 1
    stats['VIEWS'] = len(views)
    if hits:
        stats['SHARE'] = sum(n * min(1, n / e.patch_size[s]) for s, n in hits.items()) / sum(
            hits.values())
    return stats, entries


NAMES = ('SHOWN', 'AGREE', 'GAIN', 'VIOLATE', 'BEHIND', 'MISSING', 'SHARE', 'UNLIKELINESS',
         'COS', 'RESIDUAL', 'DELTA', 'VIEWS')


def agree_with_plain(scene, rows, context, me):
    """Compare statistics and pixel lists of some rows with those of plain Python."""
    stats, lists = scene.evidence.compare_pixels(scene.H[rows], scene.shape[rows], WEIGHTS,
                                                 context, me=me)
    for k, row in enumerate(rows):
        expected, entries = plain(scene, scene.H[row], scene.category[row], context, me[k])
        for name in NAMES:
            assert stats[k, getattr(kernel, name)] == pytest.approx(
                expected[name], rel=1e-5, abs=1e-4), name
        mine = slice(*lists.offsets[k:k + 2])
        pixel, depth, cost = (np.array(x) for x in zip(*entries))
        np.testing.assert_array_equal(lists.pixel[mine], pixel)
        np.testing.assert_allclose(lists.depth[mine], depth, rtol=1e-6)
        np.testing.assert_allclose(lists.cost[mine], cost, atol=1e-5)
    return stats


def test_statistics_and_pixel_lists_are_those_of_plain_python(scene):
    rows = [0, 1, 2, 4, 8, 9, 11, 13, 17]
    stats = agree_with_plain(scene, rows, None, [-1] * len(rows))
    assert (stats[:, kernel.AGREE].max() > 500) and (stats[:, kernel.VIOLATE].max() > 50)
    assert stats[:, kernel.MISSING].min() > 0


def test_statistics_among_others_that_are_shown_already(scene):
    _, lists = scene.evidence.compare_pixels(scene.H[:6], scene.shape[:6], WEIGHTS)
    context = scene.evidence.compose([0, 2, 4], lists)
    stats = agree_with_plain(scene, [0, 3, 4, 5, 7], context, [0, -1, 4, -1, 0])
    assert stats[1, kernel.BEHIND] > 100, 'a copy of what is shown hides nothing'


def test_pixel_costs():
    def cost(residual, foreground=True, cosine=1.0, unlikely=0.0):
        return pixel_cost.pixel_cost(1.0 + residual, 1.0, foreground, cosine, unlikely,
                                 PixelWeights(0.03, 0.4, 0.5, 0.7))

    assert cost(0.0) == (0.0, pixel_cost.AGREES)
    assert cost(0.0, cosine=0.0) == (pytest.approx(0.4), pixel_cost.AGREES)
    assert cost(0.0, cosine=-1.0) == cost(0.0, cosine=0.0)
    assert cost(0.0, unlikely=1.0) == (pytest.approx(0.5), pixel_cost.AGREES)
    assert cost(0.015)[0] == pytest.approx(cost(-0.015)[0])
    rising = [cost(r)[0] for r in (0.0, 0.005, 0.015, 0.029)]
    assert rising == sorted(rising)
    assert rising[-1] < 1.0
    # Far off, behind the reading or seen through: no better than a bad agreement.
    assert cost(0.1)[1] == pixel_cost.OCCLUDED
    assert cost(0.1)[0] >= 1.0
    assert cost(-0.1)[1] == pixel_cost.SEEN_THROUGH
    assert cost(-0.1)[0] > 0.5
    # Where the table was measured nothing can be explained.
    assert cost(0.0, foreground=False) == (0.0, pixel_cost.SEEN_THROUGH)
    assert cost(-0.1, foreground=False) == (0.7, pixel_cost.SEEN_THROUGH)


def test_the_category_counts(scene):
    ball_there = scene.true[2].copy()
    ball_there[7:10] = scene.desk.models[2].extents / scene.desk.models[1].extents
    can, ball = scene.evidence.compare(np.array([scene.true[2], ball_there]), [2, 1], WEIGHTS)
    assert can[kernel.UNLIKELINESS] < 0.1 * can[kernel.AGREE]
    assert ball[kernel.UNLIKELINESS] > 0.7 * ball[kernel.AGREE] > 100
    blind = scene.evidence.compare(ball_there[None], [1], PixelWeights(category=0.0))[0]
    assert blind[kernel.GAIN] > ball[kernel.GAIN] + 0.2 * ball[kernel.AGREE]


def test_the_true_objects_explain_what_they_cover(scene):
    stats = scene.evidence.compare(scene.true, [0, 1, 2], WEIGHTS)
    covered = stats[:, kernel.SHOWN] - stats[:, kernel.BEHIND] - stats[:, kernel.MISSING]
    assert (stats[:, kernel.AGREE] > 0.9 * covered).all()
    assert (stats[:, kernel.VIEWS] == 3).all()
    assert (stats[:, kernel.DELTA] < -0.6 * covered).all()
    assert (stats[:, kernel.RESIDUAL] / stats[:, kernel.AGREE] < 0.003).all()
    moved = scene.true.copy()
    moved[:, 0] += 0.05
    assert (scene.evidence.compare(moved, [0, 1, 2], WEIGHTS)[:, kernel.DELTA]
            > stats[:, kernel.DELTA] + 100).all()


def test_delta_is_the_change_of_the_composed_cost(scene):
    _, lists = scene.evidence.compare_pixels(scene.H, scene.shape, WEIGHTS)
    for others, new in (([], 0), ([0, 1], 2), ([3, 7], 4), ([0, 4, 8, 11], 5)):
        before, after = (scene.evidence.compose(m, lists) for m in (others, [*others, new]))
        rise = after[2].astype(float).sum() - before[2].astype(float).sum()
        for context, me in ((before, -1), (after, new)):
            stats = scene.evidence.compare(scene.H[[new]], scene.shape[[new]], WEIGHTS,
                                           context, me=[me])
            assert stats[0, kernel.DELTA] == pytest.approx(rise, abs=0.02)


def test_composing_is_sorting_by_depth(scene):
    rng, n = np.random.default_rng(8), len(scene.evidence.views.depth)
    pixels = [np.sort(rng.choice(300, 120, replace=False)) for _ in range(7)]
    offsets = np.cumsum([0] + [len(p) for p in pixels])
    depth, cost = rng.uniform(0.5, 1, (2, offsets[-1])).astype(np.float32)
    lists = PixelLists(offsets, np.concatenate(pixels), depth, cost)
    members = [5, 0, 3, 6]
    owner, depth_1, cost_1, depth_2, cost_2 = scene.evidence.compose(members, lists)
    none = scene.evidence.cost_none
    for i in range(300):
        stack = sorted((depth[e], cost[e], k) for k in members
                       for e in range(offsets[k], offsets[k + 1]) if lists.pixel[e] == i)
        stack += [(np.inf, none[i], None)] * 2
        assert (depth_1[i], cost_1[i]) == stack[0][:2]
        assert (depth_2[i], cost_2[i]) == stack[1][:2]
        assert owner[i] == stack[0][2] if stack[0][2] is not None else owner[i] < -1
    np.testing.assert_array_equal(cost_1[300:], none[300:])
    assert np.isinf(depth_1[300:n]).all()
    assert (scene.evidence.nothing[0] == -2).all(), 'composing wrote into what is shared'


def settings(steps):
    """Return the settings of a refinement."""
    return RefineSettings(0.1, 0.05, steps, 0.005, 0.06, 0.04)


def objective(scene, H, context, me, complexity, prior):
    """Return what refinement lowers."""
    stats = scene.evidence.compare(H, scene.shape, WEIGHTS, context, me=me)
    return stats[:, kernel.DELTA] + stats[:, kernel.SHOWN] * (
        complexity + prior * (np.log(H[:, 7:10]) ** 2).sum(1))


@pytest.mark.parametrize('members', [[], [0, 1, 2], [3, 8]])
def test_refinement_never_makes_its_objective_worse(scene, members):
    _, lists = scene.evidence.compare_pixels(scene.H, scene.shape, WEIGHTS)
    context = scene.evidence.compose(members, lists)
    me = np.where(np.isin(np.arange(len(scene.H)), members), np.arange(len(scene.H)), -1)
    H = scene.evidence.refine(scene.H, scene.shape, WEIGHTS, settings(25),
                              np.random.default_rng(0), context, me)
    before, after = (objective(scene, h, context, me, 0.1, 0.05) for h in (scene.H, H))
    assert (after <= before + 1e-6).all()
    assert (after < before - 5).mean() > 0.4
    np.testing.assert_allclose(np.linalg.norm(H[:, 3:7], axis=1), 1, atol=1e-9)


def test_refinement_brings_a_shifted_object_back(scene):
    shifted = scene.true.copy()
    shifted[:, :2] += [[0.008, -0.006]]
    kept = shifted.copy()
    H = scene.evidence.refine(shifted, np.array([0, 1, 2]), WEIGHTS, settings(80),
                              np.random.default_rng(1))
    np.testing.assert_array_equal(shifted, kept)
    off = np.linalg.norm(H[:, :3] - scene.true[:, :3], axis=1)
    assert off.max() < 0.007, 'they were 1 cm off'


def test_one_seed_one_result_whatever_the_threads(scene):
    known, results = numba.get_num_threads(), []
    try:
        for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
            numba.set_num_threads(threads)
            stats, lists = scene.evidence.compare_pixels(scene.H, scene.shape, WEIGHTS)
            H = scene.evidence.refine(scene.H, scene.shape, WEIGHTS, settings(10),
                                      np.random.default_rng(3), scene.evidence.nothing, [-1] * 18)
            results.append((stats, lists.offsets, lists.pixel, lists.cost, H))
    finally:
        numba.set_num_threads(known)
    for a, b in zip(*results, strict=True):
        np.testing.assert_array_equal(a, b)
