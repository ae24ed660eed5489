# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Forest inference against plain walks, and the refusal of damaged forests."""

from dataclasses import replace

from hooc_perception.core.classification.forest import Forest, quantised
from hooc_perception.core.classification.kernels import pixel_forest as forest_pixels
from hooc_perception.core.classification.pixel_forest import centres, depth_stack, PixelForest
from hooc_perception.core.geometry import inverse, project, transform
from hooc_perception.errors import HoocError
import numpy as np
import pytest


def tree(rng, depth, n_features, n_classes):
    """Return random (feature, threshold, left, leaf_p) of a full tree, depth-first."""
    feature, threshold, left = [], [], []

    def grow(node, level):
        if level == depth or (level > 1 and rng.random() < 0.2):
            return
        feature[node], threshold[node] = rng.integers(n_features), rng.normal()
        child = len(feature)
        left[node] = child
        for _ in range(2):
            feature.append(-1), threshold.append(0.0), left.append(0)
        grow(child, level + 1), grow(child + 1, level + 1)

    feature.append(-1), threshold.append(0.0), left.append(0)
    grow(0, 0)
    return (np.array(feature, np.int32), np.array(threshold, np.float32),
            np.array(left, np.int32))


@pytest.fixture(scope='module')
def forest():
    rng = np.random.default_rng(3)
    trees = [tree(rng, 6, 5, 4) for _ in range(3)]
    start = np.cumsum([0, *(len(t[0]) for t in trees)])
    feature = np.concatenate([t[0] for t in trees])
    leaf = np.where(feature < 0, np.cumsum(feature < 0) - 1, 0).astype(np.int32)
    left = np.concatenate([t[2] + s for t, s in zip(trees, start)]).astype(np.int32)
    return Forest(feature, np.concatenate([t[1] for t in trees]), left,
                  start[:-1].astype(np.int32), leaf,
                  quantised(rng.random((int((feature < 0).sum()), 4))))


def plain(forest, row):
    """Return the mean leaf distribution of one row, one node after the other."""
    p = np.zeros(forest.leaf_p.shape[1])
    for node in forest.roots:
        while forest.feature[node] >= 0:
            goes_left = row[forest.feature[node]] <= forest.threshold[node]
            node = forest.left[node] + (not goes_left)
        p += forest.leaf_p[forest.leaf[node]]
    return p / p.sum()


def test_prediction_is_the_mean_of_plain_walks(forest):
    x = np.random.default_rng(4).normal(size=(70, 5)).astype(np.float32)
    x[0, :] = np.nan  # goes right everywhere, in both
    expected = np.array([plain(forest, row) for row in x])
    np.testing.assert_allclose(forest.predict(x), expected, atol=1e-6)


def test_arrays_there_and_back(forest):
    again = Forest.from_arrays(forest.arrays('a_'), 'a_')
    x = np.random.default_rng(5).normal(size=(20, 5))
    assert (again.predict(x) == forest.predict(x)).all()


@pytest.mark.parametrize('key, change', [
    ('left', lambda a: a + 10**6), ('left', lambda a: np.zeros_like(a)),
    ('roots', lambda a: a + 10**6), ('roots', lambda a: a[:0]), ('leaf', lambda a: a + 10**6),
    ('threshold', lambda a: a[:-1]), ('leaf_p', lambda a: a[0]), ('leaf', lambda a: a - 10**6)])
def test_damaged_forests_are_refused(forest, key, change):
    arrays = forest.arrays()
    arrays[key] = change(arrays[key])
    with pytest.raises(HoocError, match='damaged'):
        Forest.from_arrays(arrays)


def test_missing_arrays_are_named(forest):
    arrays = forest.arrays('x_')
    del arrays['x_left']
    with pytest.raises(HoocError, match='x_left'):
        Forest.from_arrays(arrays, 'x_')


def quantised_in_numpy(p):
    """Return what `quantised` does, whole columns at a time."""
    scaled = np.asarray(p, float) * 255 / np.maximum(p.sum(1, keepdims=True), 1e-12)
    low = np.floor(scaled)
    short = (255 - low.sum(1)).round().astype(int)
    rank = np.argsort(np.argsort(low - scaled, axis=1, kind='stable'), axis=1, kind='stable')
    return (low + (rank < short[:, None])).astype(np.uint8)


def test_quantised_rows_are_those_of_numpy():
    rng = np.random.default_rng(1)
    p = np.concatenate([rng.dirichlet(np.full(26, 0.2), 500), rng.integers(0, 4, (300, 26)),
                        np.zeros((1, 26)), np.eye(26)])
    for dtype in (np.float32, np.float64):
        assert np.array_equal(quantised(p.astype(dtype)), quantised_in_numpy(p.astype(dtype)))


def test_quantised_rows_sum_to_255_and_stay_near():
    p = np.random.default_rng(0).dirichlet(np.full(26, 0.2), 200)
    q = quantised(p)
    assert (q.sum(1, dtype=int) == 255).all()
    assert np.abs(q / 255 - p).max() < 1 / 255


def test_centres_are_projections_and_scale_with_depth(small):
    observation = small.observed([small.box([0, 0, 0.05], [0.1, 0.1, 0.1])])
    points = np.random.default_rng(0).uniform(-0.2, 0.2, (30, 3))
    got = centres(points, observation.views)
    for i, view in enumerate(observation.views):
        local = transform(inverse(view.camera.T_world_camera), points)
        u, v = project(view.camera.K, local)
        np.testing.assert_allclose(got[:, i, 0], u, atol=1e-3)
        np.testing.assert_allclose(got[:, i, 1], v, atol=1e-3)
        np.testing.assert_allclose(got[:, i, 2], view.camera.K[0, 0] / local[:, 2], rtol=1e-5)


def test_depth_stack_fills_holes_with_the_empty_scene(small):
    observation = small.observed([small.box([0, 0, 0.05], [0.1, 0.1, 0.1])])
    view = observation.views[0]
    hole = view.depth.copy()
    r, c = np.argwhere(view.foreground)[0]
    hole[r, c] = np.nan
    stack = depth_stack([replace(view, depth=hole)])
    assert stack[0, r, c] == round(float(view.background[r, c]) * 1000)
    assert stack[0, r + 1, c] == round(float(view.depth[r + 1, c]) * 1000)


def test_pixel_walk_compares_two_depths_in_any_view():
    image = np.arange(2 * 20 * 30, dtype=np.uint16).reshape(1, 2, 20, 30)
    centre = np.array([[[10, 10, 100.0], [5, 6, 50.0]]], np.float32)
    # At 0.02 m and 50 pixels a metre the second offset is one pixel to the right.
    offsets = np.array([[0.0, 0.02, 0.02, 0.0], [-1.0, 0.0, 0.0, 0.0]], np.float32)
    assert forest_pixels.respond(image[0, 1], centre[0, 1], offsets[0], 4000) == (
        int(image[0, 1, 7, 5]) - int(image[0, 1, 6, 6]))
    assert forest_pixels.respond(image[0, 1], centre[0, 1], offsets[1], 4000) == (
        4000 - int(image[0, 1, 6, 5]))
    forest = Forest(np.array([0, -1, -1], np.int32), np.array([29, 0, 0], np.float32),
                    np.array([1, 0, 0], np.int32), np.zeros(1, np.int32),
                    np.array([0, 0, 1], np.int32), np.array([[255, 0], [0, 255]], np.uint8))
    for cut, expected in ((29, 0), (28, 1)):
        f = PixelForest(Forest(forest.feature, np.array([cut, 0, 0], np.float32), forest.left,
                               forest.roots, forest.leaf, forest.leaf_p),
                        np.array([1], np.uint8),
                        np.array([[0.0, 0.02, 0.02, 0.0]], np.float32))
        assert f.predict(image[0], centre).argmax(1)[0] == expected


def test_damaged_pixel_forests_are_refused(forest):
    arrays = {**forest.arrays('v_'), 'v_test_view': np.zeros(5, np.uint8),
              'v_offsets': np.zeros((5, 4), np.float32)}
    assert PixelForest.from_arrays(arrays, 'v_', 1)
    for key, value in (('v_test_view', np.full(5, 3, np.uint8)),
                       ('v_offsets', np.zeros((4, 4), np.float32)),
                       ('v_offsets', np.full((5, 4), np.nan, np.float32))):
        with pytest.raises(HoocError, match='damaged'):
            PixelForest.from_arrays({**arrays, key: value}, 'v_', 1)
