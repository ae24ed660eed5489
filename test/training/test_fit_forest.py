# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Growth of trees: scikit-learn and brute force are the references."""

from dataclasses import replace

from hooc_perception.core.classification.forest import Forest
from hooc_perception.synthesis.population import FOLDS
from hooc_perception.training.fit_forest import (
    fit,
    FitConfig,
    quantise,
    thresholds,
    unaware_of,
)
from hooc_perception.training.kernels.splits import best_split, Limits, x_log_x
from hooc_perception.training.kernels.table_tree import grow_tree, Table, walk_binned
import numpy as np
import pytest
from scipy.stats import entropy
from sklearn.ensemble import RandomForestClassifier
from sklearn.tree import DecisionTreeClassifier


def toy(n, rng, n_features=12, n_classes=5):
    """Return (x, y): noisy blobs, of which half of the features know nothing."""
    y = rng.integers(0, n_classes, n).astype(np.uint8)
    centres = np.random.default_rng(9).normal(size=(n_classes, n_features)) * 1.5
    centres[:, n_features // 2:] = 0
    return (centres[y] + rng.normal(size=(n, n_features))).astype(np.float32), y


def gain(y, left, n_classes):
    """Return the information gain in bits times n, from the definition."""
    def total(part):
        counts = np.bincount(part, minlength=n_classes)
        return len(part) * entropy(counts, base=2) if len(part) else 0.0
    return total(y) - total(y[left]) - total(y[~left])


@pytest.mark.parametrize('n', [60, 499, 500, 3000])
def test_best_split_is_the_best_of_all(n):
    rng = np.random.default_rng(n)
    y = rng.integers(0, 6, n).astype(np.uint8)
    values = np.clip(rng.normal(10 + 2 * y, 6), 0, 63).astype(np.uint8)
    got, split = best_split(
        values, y, np.bincount(y, minlength=6), 64, x_log_x(n), 5,
        np.zeros((64, 6), np.int32), np.zeros(64, np.int32))
    allowed = [b for b in range(63) if min((values <= b).sum(), (values > b).sum()) >= 5]
    gains = [gain(y, values <= b, 6) for b in allowed]
    assert got == pytest.approx(max(gains), rel=1e-9)
    assert gain(y, values <= split, 6) == pytest.approx(max(gains), rel=1e-9)


def test_no_split_where_none_leaves_enough():
    y = np.array([0, 1] * 10, np.uint8)
    got, split = best_split(
        np.zeros(20, np.uint8), y, np.bincount(y, minlength=2), 8, x_log_x(20), 1,
        np.zeros((8, 2), np.int32), np.zeros(8, np.int32))
    assert (got, split) == (-1.0, -1)


def test_a_stump_splits_as_scikit_learn_does():
    x, y = toy(4000, np.random.default_rng(0))
    cuts = thresholds(x, 255, np.random.default_rng(0))
    feature, split, _ = grow_tree(Table(quantise(x, cuts), y, 5, 255),
                                  np.arange(4000, dtype=np.int32), 12,
                                  Limits(10**6, 1, 1, 0.0), 7)
    reference = DecisionTreeClassifier(criterion='entropy', max_depth=1).fit(x, y).tree_
    assert len(feature) == 3 and feature[0] == reference.feature[0]
    assert cuts[feature[0], split[0]] == pytest.approx(reference.threshold[0], abs=0.05)


def test_quantisation_agrees_with_the_thresholds_of_the_forest():
    x, _ = toy(500, np.random.default_rng(1))
    x[:, 0] = np.round(x[:, 0])  # few values: cuts repeat
    cuts = thresholds(x, 16, np.random.default_rng(0))
    binned = quantise(x, cuts)
    for f in range(x.shape[1]):
        for b in range(15):
            assert ((binned[f] <= b) == (x[:, f] <= cuts[f, b])).all()


@pytest.fixture(scope='module')
def fitted():
    rng = np.random.default_rng(2)
    x, y = toy(6000, rng)
    cuts = thresholds(x, 64, np.random.default_rng(0))
    config = FitConfig(trees=20, features_per_node=4, min_leaf=3, node_samples=100000,
                       prior=0.0, sample_share=1.0)
    return x, y, cuts, config, fit(quantise(x, cuts), y, 5, cuts, config,
                                   np.random.default_rng(5), n_jobs=1)


def test_the_forest_is_as_good_as_scikit_learns(fitted):
    x, y, _, _, forest = fitted
    test_x, test_y = toy(4000, np.random.default_rng(3))
    reference = RandomForestClassifier(20, criterion='entropy', max_features=4,
                                       min_samples_leaf=3, bootstrap=False,
                                       random_state=0).fit(x, y)
    p, q = forest.predict(test_x), reference.predict_proba(test_x)
    assert (p.argmax(1) == test_y).mean() > (q.argmax(1) == test_y).mean() - 0.015
    assert np.abs(p - q).mean() < 0.04
    np.testing.assert_allclose(p.sum(1), 1, atol=1e-5)


def test_same_seed_same_forest_whatever_the_threads(fitted):
    x, y, cuts, config, forest = fitted
    again = fit(quantise(x, cuts), y, 5, cuts, config, np.random.default_rng(5), n_jobs=2)
    other = fit(quantise(x, cuts), y, 5, cuts, config, np.random.default_rng(6), n_jobs=2)
    for key, value in forest.arrays().items():
        assert np.array_equal(value, again.arrays()[key]), key
    assert not np.array_equal(forest.feature, other.feature)


def test_ranking_on_a_subset_still_splits_all_samples(fitted):
    x, y, cuts, config, _ = fitted
    small = fit(quantise(x, cuts), y, 5, cuts, replace(config, node_samples=300),
                np.random.default_rng(5))
    test_x, test_y = toy(4000, np.random.default_rng(3))
    assert (small.predict(test_x).argmax(1) == test_y).mean() > 0.75


def test_every_leaf_keeps_its_least_size_and_no_class_dies_out():
    x, y = toy(2000, np.random.default_rng(4))
    cuts = thresholds(x, 64, np.random.default_rng(0))
    binned = quantise(x, cuts)
    feature, split, left = grow_tree(Table(binned, y, 5, 64), np.arange(2000, dtype=np.int32), 6,
                                     Limits(10**6, 30, 25, 0.0), 1)
    sizes = np.bincount(walk_binned(binned, feature, split, left),
                        minlength=len(feature))
    assert sizes[feature < 0].min() >= 25 and (sizes[feature >= 0] == 0).all()


def test_no_tree_sees_the_samples_of_its_fold():
    rng = np.random.default_rng(4)
    x, y = toy(3000, rng)
    # Class 0 occurs in fold 1 alone, where one feature gives it away.
    fold = np.where(y == 0, 1, rng.integers(-1, FOLDS, len(y))).astype(np.int8)
    x[:, 0] = np.where(y == 0, 9, x[:, 0])
    cuts = thresholds(x, 32, rng)
    config = FitConfig(trees=2 * FOLDS, features_per_node=12, bins=32, prior=0.1)
    forest = fit(quantise(x, cuts), y, 5, cuts, config, np.random.default_rng(0), fold=fold)
    arrays = forest.arrays('forest_')
    told = {k: Forest.from_arrays(unaware_of(arrays, k, 'forest_'), 'forest_').predict(x[y == 0])
            for k in range(FOLDS)}
    assert told[1][:, 0].max() < 0.2 and min(told[0][:, 0].mean(), told[2][:, 0].mean()) > 0.8
    trees = [len(unaware_of(arrays, k, 'forest_')['forest_roots']) for k in range(FOLDS)]
    assert trees == [2] * FOLDS
