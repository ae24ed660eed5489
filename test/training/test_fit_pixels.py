# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's forests on scenes in which only another view tells the classes apart."""

from dataclasses import replace

from hooc_perception.core.classification.pixel_forest import centres
from hooc_perception.core.types import Camera, ObservedView, RectifiedView
from hooc_perception.training.fit_pixels import fit_view, PixelFitConfig, PixelPool, pool
import numpy as np
import pytest

CONFIG = PixelFitConfig(structure_scenes=12, leaf_scenes=12, trees=3, structure_pixels=100,
                        leaf_pixels=100, tests_per_node=60, min_leaf=5)


def camera(name, x):
    """Return a camera one metre above (x, 0) that looks straight down."""
    T = np.array([[1, 0, 0, x], [0, -1, 0, 0], [0, 0, -1, 1], [0, 0, 0, 1.0]])
    return Camera(name, 48, 40, np.array([[60.0, 0, 24], [0, 60, 20], [0, 0, 1]]), np.zeros(5), T)


def make_pool(rng, n_scenes, n_pixels):
    """
    Return a PixelPool of two views: pixels of view 0 look alike, view 1 shows their class.

    Around the projection of a class 2 point, view 1 has a step; for class 1 it is flat.
    """
    cameras = [camera('a', 0.0), camera('b', 0.02)]
    views = [ObservedView(c, None, None, None, None) for c in cameras]
    images = np.full((n_scenes, 2, 40, 48), 1000, np.uint16)
    scene, centre, y = [], [], []
    for s in range(n_scenes):
        step = s % 2
        points = np.column_stack([rng.uniform(-0.05, 0.05, n_pixels),
                                  rng.uniform(-0.05, 0.05, n_pixels), np.zeros(n_pixels)])
        if step:
            images[s, 1, :, ::2] -= 60
        images[s] += rng.integers(0, 4, images[s].shape).astype(np.uint16)
        scene += [s] * n_pixels
        centre.append(centres(points, views))
        y += [1 + step] * n_pixels
    scene, centre, y = np.array(scene, np.int32), np.concatenate(centre), np.array(y, np.uint8)
    return PixelPool(images, [scene, scene], [centre, centre], [y, y])


@pytest.fixture(scope='module')
def pools():
    rng = np.random.default_rng(0)
    return make_pool(rng, 12, 100), make_pool(rng, 12, 100), make_pool(rng, 8, 100)


def predict(forest, data, view):
    """Return (n, C) probabilities of a pool's pixels."""
    parts = [forest.predict(data.images[s], data.centre[view][data.scene[view] == s])
             for s in range(len(data.images))]
    return np.concatenate(parts)


def test_a_view_learns_from_what_only_the_other_sees(pools):
    structure, leaves, fresh = pools
    forest = fit_view(structure, leaves, 0, 3, CONFIG, seed=1)
    assert (forest.test_view == 1).mean() > 0.6
    assert (predict(forest, fresh, 0).argmax(1) == fresh.y[0]).mean() > 0.9


def test_leaves_come_from_the_other_pool(pools):
    structure, leaves, fresh = pools
    swapped = replace_y(leaves, lambda y: (3 - y).astype(np.uint8))
    forest = fit_view(structure, swapped, 0, 3, CONFIG, seed=1)
    assert (predict(forest, fresh, 0).argmax(1) == 3 - fresh.y[0]).mean() > 0.9


def replace_y(data, change):
    """Return the pool with other classes."""
    return PixelPool(data.images, data.scene, data.centre, [change(y) for y in data.y])


def test_same_seed_same_forest_whatever_the_threads(pools):
    structure, leaves, _ = pools
    one = fit_view(structure, leaves, 0, 3, CONFIG, seed=4, n_jobs=1).arrays('')
    two = fit_view(structure, leaves, 0, 3, CONFIG, seed=4, n_jobs=2).arrays('')
    assert all(np.array_equal(one[k], two[k]) for k in one)
    other = fit_view(structure, leaves, 0, 3, CONFIG, seed=5).arrays('')
    assert not np.array_equal(one['offsets'], other['offsets'])


def test_tests_stay_in_the_region_and_some_use_the_centre(pools):
    structure, leaves, _ = pools
    config = replace(CONFIG, region_m=0.03, centre_share=1.0)
    forest = fit_view(structure, leaves, 0, 3, config, seed=1)
    assert np.abs(forest.offsets[:, :2]).max() <= 0.03
    assert (forest.offsets[:, 2:] == 0).all()


def test_a_large_node_is_ranked_on_a_subset_but_split_whole(pools):
    structure, leaves, fresh = pools
    forest = fit_view(structure, leaves, 0, 3, replace(CONFIG, node_samples=80), seed=1)
    assert (predict(forest, fresh, 0).argmax(1) == fresh.y[0]).mean() > 0.85


def test_a_pool_holds_object_and_table_pixels_of_every_view():
    class Scene:
        pass

    rng = np.random.default_rng(0)
    scenes = []
    for _ in range(2):
        scene, views, labels = Scene(), [], []
        for c in (camera('a', 0.0), camera('b', 0.02)):
            depth = np.full((40, 48), 1.0, np.float32) + rng.normal(0, 1e-4, (40, 48))
            label = np.zeros((40, 48), np.uint8)
            depth[10:20, 15:30] = 0.9
            label[10:20, 15:30] = 3
            views.append(RectifiedView(c, depth.astype(np.float32)))
            labels.append(label)
        scene.views, scene.labels = tuple(views), tuple(labels)
        scenes.append(scene)
    data = pool(iter(scenes), 2, 50, replace(CONFIG, table_share=0.4), 0, 'test')
    assert data.images.shape == (2, 2, 40, 48)
    assert data.images[0, 0, 15, 20] == 900
    for view in range(2):
        assert (np.bincount(data.y[view], minlength=4) == [40, 0, 0, 100]).all()
        assert data.centre[view].shape == (140, 2, 3)
        # A pixel's own view shows it where it is.
        own = data.centre[view][data.y[view] == 3, view]
        assert ((own[:, 0] > 14.4) & (own[:, 0] < 29.6)).all()
