# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Setting B: which candidates make room for the true poses."""

from hooc_perception.core.types import Candidates
from hooc_perception.evaluation.true_poses import with_true_poses
from hooc_perception.scenes.scene import TrueObject
import numpy as np
import pytest


def true_object(category, x):
    """Return a TrueObject at (x, 0, 0.1)."""
    return TrueObject(category, np.array([x, 0, 0.1]), np.array([0, 0, 0.6, 0.8]),
                      np.array([0.1, 0.2, 0.3]))


@pytest.fixture
def ordered(models):
    """Return the GenericModels: class ids 1 ball, 2 box, 3 can."""
    assert list(models) == ['ball', 'box', 'can']
    return tuple(models.values())


def pool_of(*rows):
    """Return Candidates from (class id, score); the row's number is its x."""
    category, score = zip(*rows)
    n = len(rows)
    translation = np.zeros((n, 3))
    translation[:, 0] = np.arange(n)
    return Candidates(np.array(category, np.uint16), translation, np.tile([0, 0, 0, 1.0], (n, 1)),
                      np.full((n, 3), 0.1, np.float32), np.array(score, np.float32))


def test_the_worst_of_each_true_category_makes_room(ordered):
    pool = pool_of((1, 0.9), (1, 0.2), (1, 0.5), (2, 0.1), (3, 0.3), (3, 0.4))
    changed = with_true_poses([true_object('ball', 7.0), true_object('can', 8.0)], ordered)(pool)
    # Rows 1 (ball, .2) and 4 (can, .3) are gone, the box's only candidate is not.
    assert changed.translation[:, 0].tolist() == [0, 2, 3, 5, 7, 8]
    assert changed.category.tolist() == [1, 1, 2, 3, 1, 3]
    np.testing.assert_allclose(changed.rotation_xyzw[-2:], [[0, 0, 0.6, 0.8]] * 2)
    np.testing.assert_allclose(changed.size[-2:], [[0.1, 0.2, 0.3]] * 2, rtol=1e-6)
    assert len(pool) == 6
    for name in ('category', 'translation', 'rotation_xyzw', 'size', 'score'):
        assert getattr(changed, name).dtype == getattr(pool, name).dtype


def test_two_of_a_category_take_two_places(ordered):
    pool = pool_of((1, 0.9), (1, 0.2), (1, 0.5))
    truth = [true_object('ball', 7.0), true_object('ball', 8.0)]
    changed = with_true_poses(truth, ordered)(pool)
    assert changed.translation[:, 0].tolist() == [0, 7, 8]


def test_a_category_without_candidates_gains_one(ordered):
    pool = pool_of((1, 0.9))
    truth = [true_object('can', 7.0), true_object('ball', 8.0), true_object('ball', 9.0)]
    changed = with_true_poses(truth, ordered)(pool)
    assert changed.translation[:, 0].tolist() == [7, 8, 9]
    assert changed.category.tolist() == [3, 1, 1]
    alone = with_true_poses(truth, ordered)(Candidates.empty())
    assert alone.translation[:, 0].tolist() == [7, 8, 9]


def test_no_truth_changes_nothing_and_unknown_categories_are_left_out(ordered):
    pool = pool_of((1, 0.9), (2, 0.1))
    for truth in ([], [true_object('teapot', 7.0)]):
        assert with_true_poses(truth, ordered)(pool).translation[:, 0].tolist() == [0, 1]
