# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Drawing hypotheses, ranking them and telling copies apart."""

from dataclasses import replace
from types import SimpleNamespace

from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.hypotheses.sampling import (
    benefit,
    best_half,
    non_maximum_suppression,
    sample,
    SampleCounts,
    tables,
)
from hooc_perception.core.shapes import Shapes
import numba
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation


@pytest.fixture(scope='module')
def space(desk):
    """Return the desk's Frame."""
    return desk.frame


def drawn(space, desk, config, seed=0, steps=0, weight=None, samples=1500):
    """Return (H, category) of a small draw."""
    shapes = Shapes(desk.models)
    H, shape = sample(space.cloud, space.field, shapes, config, np.random.default_rng(seed),
                      SampleCounts(samples, 30, steps), weight)
    return H, shapes.category[shape]


def test_tables_hold_every_models_points_and_resting_poses(things):
    few = replace(things[1], surface_points=things[1].surface_points[:100],
                  surface_normals=things[1].surface_normals[:100])
    models = (things[0], few, things[2])
    t = tables(models)
    assert t.points.shape == t.normals.shape == (3, 512, 3)
    assert t.points.dtype == t.normals.dtype == np.float64
    for k, model in enumerate(models):
        known = cKDTree(model.surface_points.astype(np.float64))
        assert known.query(t.points[k])[0].max() == 0
        assert len(np.unique(t.points[k], axis=0)) == min(512, len(model.surface_points))
        n = len(model.rest_rotations)
        np.testing.assert_array_equal(t.rest[k, :n], model.rest_rotations)
        steps = np.diff(t.rest_cdf[k], prepend=0)
        assert (steps[:n] > 0).all()
        assert not steps[n:].any(), 'a padding row can be drawn'


def test_a_draw_lies_on_the_cloud(desk, cheap, space):
    H, category = drawn(space, desk, cheap)
    assert set(category) == {1, 2, 3}
    assert len(H) > 40
    surface, t = cKDTree(space.cloud.points), tables(desk.models)
    for h, c in zip(H, category):
        R = Rotation.from_quat(h[3:7]).as_matrix()
        points = (t.points[c - 1] * h[7:10]) @ R.T + h[:3]
        assert surface.query(points)[0].min() < 1e-9
        assert np.linalg.norm(h[3:7]) == pytest.approx(1)


def touched(space, desk, H, category, allowed):
    """Assert that every hypothesis has a model point on a point of the cloud that is allowed."""
    t = tables(desk.models)
    surfaces = [cKDTree(space.cloud.points[a]) for a in allowed]
    for h, c in zip(H, category):
        R = Rotation.from_quat(h[3:7]).as_matrix()
        points = (t.points[c - 1] * h[7:10]) @ R.T + h[:3]
        assert surfaces[c - 1].query(points)[0].min() < 1e-9


def test_only_points_with_a_weight_are_drawn(desk, cheap, space):
    at_can = np.linalg.norm((space.cloud.points - desk.truth.translation[2])[:, :2], axis=1) < 0.05
    H, category = drawn(space, desk, cheap, weight=at_can.astype(float))
    assert len(H) > 10
    touched(space, desk, H, category, [at_can] * 3)


def test_without_distrust_a_category_is_drawn_only_where_the_classifier_sees_it(desk, cheap,
                                                                                space):
    at = [np.linalg.norm((space.cloud.points - t)[:, :2], axis=1) < 0.1
          for t in desk.truth.translation]
    p = np.stack([np.zeros(len(at[0])), *at], 1).astype(np.float32)
    sure = SimpleNamespace(cloud=replace(space.cloud, p=p), field=space.field)
    H, category = drawn(sure, desk, replace(cheap, distrust=0.0))
    assert set(category) == {1, 2, 3}
    touched(space, desk, H, category, at)


def test_refinement_raises_scores(desk, cheap, space):
    rough, fine = (drawn(space, desk, cheap, steps=s)[0] for s in (0, 40))
    assert rough.shape == fine.shape
    assert (fine[:, 10] >= rough[:, 10] - 1e-12).all()
    assert np.median(fine[:, 10] - rough[:, 10]) > 0.01


def test_the_same_seed_gives_the_same_whatever_the_threads(desk, cheap, space):
    known, results = numba.get_num_threads(), []
    try:
        for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
            numba.set_num_threads(threads)
            results.append(drawn(space, desk, cheap, steps=10)[0])
    finally:
        numba.set_num_threads(known)
    np.testing.assert_array_equal(*results)
    other = drawn(space, desk, cheap, seed=1, steps=10)[0]
    assert other.shape != results[0].shape or (other != results[0]).any()


def row(**named):
    """Return a row of statistics."""
    out = np.zeros(stat.STATS)
    for name, value in named.items():
        out[getattr(stat, name)] = value
    return out


def test_the_better_half_of_each_mesh_goes_on():
    score = np.array([3., 1, 2, 5, 4, 9, 7, 7])
    shape = np.array([0, 0, 0, 1, 1, 2, 3, 3])
    assert best_half(score, shape).tolist() == [0, 2, 3, 5, 6]
    assert len(best_half(score[:0], shape[:0])) == 0


def test_benefit_ranks_by_what_is_explained():
    good = {'SHOWN': 1000, 'DELTA': -800, 'SHARE': 0.9}
    ranked = [row(**good), row(**{**good, 'SHARE': 0.3}), row(**{**good, 'DELTA': -500}),
              row(**{**good, 'DELTA': 0}), row(**{**good, 'DELTA': 500})]
    benefits = benefit(np.array(ranked), 0.1)
    # A model inside a larger thing explains only a small share of the patch.
    assert benefits[0] > benefits[1] > benefits[3] > benefits[4]
    assert benefits[0] > benefits[2] > benefits[3]
    assert benefits[0] > 0 > benefits[4]
    costly = benefit(np.array(ranked), 0.5)
    assert (costly < benefits).all()


def test_benefit_of_what_nobody_sees_is_finite():
    hidden = row(SHOWN=500, BEHIND=500)
    assert np.isfinite(benefit(np.array([hidden, row()]), 0.1)).all()
    assert benefit(np.zeros((0, stat.STATS)), 0.1).shape == (0,)


def hypotheses(*rows):
    """Return H (m, 10) from (x, yaw, scale)."""
    return np.array([[x, 0, 0, 0, 0, np.sin(yaw / 2), np.cos(yaw / 2), s, s, s]
                     for x, yaw, s in rows])


def test_near_copies_are_left_out_and_other_sizes_stay(things):
    H = hypotheses((0, 0, 1), (0.003, 0.05, 1.02), (0, 0, 1.5), (0, 1.6, 1), (0.1, 0, 1))
    score = np.array([0.5, 0.9, 0.4, 0.3, 0.2])
    rows = non_maximum_suppression(H, np.zeros(5, int), score, Shapes(things), 10)
    assert rows.tolist() == [1, 2, 3, 4]
    assert non_maximum_suppression(H, np.zeros(5, int), score, Shapes(things),
                                   2).tolist() == [1, 2]


def test_a_quaternion_and_its_negative_are_the_same_rotation(things):
    H = np.repeat(hypotheses((0, 0.4, 1)), 2, axis=0)
    H[1, 3:7] *= -1
    rows = non_maximum_suppression(H, np.zeros(2, int), np.array([0.1, 0.2]), Shapes(things), 5)
    assert rows.tolist() == [1]


def test_categories_do_not_compete(things):
    H = hypotheses(*[(0, 0, 1)] * 3)
    score, shapes = np.array([0.1, 0.2, 0.3]), Shapes(things)
    rows = non_maximum_suppression(H, np.array([2, 0, 1]), score, shapes, 1)
    assert sorted(rows.tolist()) == [0, 1, 2]
    assert non_maximum_suppression(H[:0], np.zeros(0, int), np.zeros(0), shapes, 3).tolist() == []


def test_none_wanted_none_given(things):
    H = hypotheses((0, 0, 1), (0.3, 0, 1))
    assert non_maximum_suppression(H, np.zeros(2, int), np.zeros(2), Shapes(things),
                                   0).tolist() == []


def test_what_is_left_out_is_what_a_plain_loop_leaves_out(things):
    rng = np.random.default_rng(8)
    H = hypotheses(*rng.uniform([-0.03, -0.6, 0.8], [0.03, 0.6, 1.3], (200, 3)))
    category, score = rng.integers(1, 3, 200), rng.random(200)
    expected = []
    for c in (1, 2):
        kept = []
        for i in sorted(np.flatnonzero(category == c), key=lambda i: -score[i]):
            if all(np.linalg.norm(H[i, :3] - H[k, :3]) >= 0.12 * things[c - 1].longest_side
                   or abs(np.log(H[i, 7] / H[k, 7])) >= 0.22
                   or abs(H[i, 3:7] @ H[k, 3:7]) <= 0.92 for k in kept):
                kept.append(i)
        expected += kept[:12]
    assert 8 < len(expected) < 25
    assert non_maximum_suppression(H, category - 1, score, Shapes(things), 12).tolist() == expected
