# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The network over the table: what it gives, on how many threads, and what it refuses."""

import cv2
from hooc_perception.core.classification import features, table_network
from hooc_perception.core.classification.classify import classify, KIND_FUSED
from hooc_perception.core.classification.forest import Forest
from hooc_perception.core.classification.table_network import Surface, TableMap
from hooc_perception.errors import HoocError
from hooc_perception.training.network.weights import bundled
import numpy as np
import pytest


@pytest.fixture(scope='module')
def network():
    """Return the network that comes with the package."""
    return table_network.from_arrays(bundled())


@pytest.fixture(scope='module')
def scene(small):
    """Two boxes on a table, seen by three cameras."""
    return small.observed([small.box([-0.15, 0.0, 0.05], [0.1, 0.16, 0.1]),
                           small.box([0.15, 0.05, 0.03], [0.2, 0.06, 0.06])])


@pytest.fixture(scope='module')
def looked(scene):
    """Return the pixels and the surroundings, with a map, of the scene."""
    pixels = features.foreground_pixels(scene)
    return pixels, features.surroundings(scene, pixels, table=True)


def described(network, looked, rows):
    pixels, around = looked
    return network.describe(around.table, Surface(
        pixels.points[rows], pixels.normals[rows], pixels.residual[rows]))


def test_the_last_columns_of_a_pixel_are_those_of_the_network(network, looked):
    pixels, around = looked
    rows = np.arange(0, len(pixels.points), 50)
    probes = features.draw_probes(np.random.default_rng(0), 4)
    x = features.pixel_features(pixels, around, probes, rows, network)
    assert x.shape == (len(rows), features.feature_count(4, network)) and np.isfinite(x).all()
    assert (x[:, :features.feature_count(4)]
            == features.pixel_features(pixels, around, probes, rows)).all()
    assert (x[:, features.feature_count(4):] == described(network, looked, rows)).all()


def test_the_same_numbers_whatever_the_threads(network, looked):
    rows = np.arange(0, len(looked[0].points), 20)
    before = cv2.getNumThreads()
    try:
        cv2.setNumThreads(1)
        one = described(network, looked, rows)
        cv2.setNumThreads(2)
        two = described(network, looked, rows)
    finally:
        cv2.setNumThreads(before)
    assert (one == two).all()


def test_places_are_told_apart_and_neighbours_are_not(network, looked):
    pixels, _ = looked
    rows = np.arange(0, len(pixels.points), 5)
    logits = described(network, looked, rows)[:, -26:]
    left = pixels.points[rows, 0] < 0
    between = np.linalg.norm(logits[left].mean(0) - logits[~left].mean(0))
    assert between > 1.0


def test_maps_of_any_size_that_divides_are_read(network):
    surface = Surface(np.array([[0.3, 0.2, 0.05]]), np.array([[0, 0, 1]], np.float32),
                      np.zeros(1, np.float32))
    for shape in ((208, 208), (240, 208), (208, 304)):
        grid = table_network.centred(np.array([0.3, 0.2]), 0.005, shape)
        table = TableMap(np.zeros((table_network.CHANNELS, *shape), np.float32), grid)
        assert np.isfinite(network.describe(table, surface)).all()


def test_height_and_normal_are_part_of_a_point():
    surface = Surface(np.array([[0, 0, 0.001], [0, 0, 0.3]]),
                      np.array([[0, 0, 1], [1, 0, 0]], np.float32),
                      np.array([0.001, 0.5], np.float32))
    x = table_network.point_features(surface)
    assert x.shape == (2, table_network.POINT_FEATURES)
    assert (x[0, :9] < 0).all() and (x[1, :9] > 0).all()
    assert x[:, -4:-1].tolist() == [[0, 0, 1], [1, 0, 0]] and x[1, -1] == 3


def test_no_network_and_a_damaged_one(scene):
    assert table_network.from_arrays({}) is None
    arrays = dict(bundled())
    del arrays['network_bias1']
    with pytest.raises(HoocError, match='damaged network'):
        table_network.from_arrays({**arrays, 'network_digest': np.zeros(16, np.uint8)})


def test_a_forest_that_reads_the_network_needs_it(scene):
    columns = features.feature_count(0)
    stump = Forest(np.array([columns, -1, -1], np.int32), np.zeros(3, np.float32),
                   np.array([1, 0, 0], np.int32), np.zeros(1, np.int32),
                   np.array([0, 0, 1], np.int32), np.array([[0, 255], [255, 0]], np.uint8))
    classifier = {'kind': np.uint8(KIND_FUSED), 'version': np.uint8(1), 'classes': np.uint8(1),
                  'probes': np.zeros((0, 5)), **stump.arrays('forest_')}
    with pytest.raises(HoocError, match='damaged'):
        classify(scene, classifier)
    assert len(classify(scene, {**classifier, **bundled()}).p) > 100
