# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Classifier and pool scores on made-up probabilities and pools."""

from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Candidates, PixelProbabilities
from hooc_perception.evaluation.scores import score_scene
from hooc_perception.evaluation.stages import (
    as_candidates,
    as_objects,
    pixel_scores,
    pool_recall,
    true_classes,
)
import numpy as np
import pytest


@pytest.fixture
def observation(tiny):
    return observe([rectify(view) for view in tiny.scene('10_1').depth()])


def probabilities_of(observation, truths, models, spoil=0.0):
    """Return probabilities that are certain and right but for a share `spoil` of the pixels."""
    rng, parts = np.random.default_rng(0), []
    for j, view in enumerate(observation.views):
        v, u = np.nonzero(view.foreground)
        p = np.zeros((len(u), len(models) + 1), np.uint8)
        classes = np.maximum(true_classes(truths, models, view)[v, u], 0)
        wrong = rng.random(len(u)) < spoil
        p[np.arange(len(u)), np.where(wrong, classes % len(models) + 1, classes)] = 255
        parts.append((np.full(len(u), j, np.uint8), np.stack([u, v], 1).astype(np.uint16), p))
    return PixelProbabilities(*(np.concatenate(x) for x in zip(*parts)))


def test_true_classes_follow_the_rendered_truth(observation, posed_truths, models):
    ordered = tuple(models.values())
    names = list(models)
    view = observation.views[0]
    classes = true_classes(posed_truths['10_1'], ordered, view)
    assert set(np.unique(classes)) >= {0, 1, 2, 3}
    assert not (classes[~view.foreground] > 0).any()
    # The pixel that the ball's centre projects to shows the ball.
    T = np.linalg.inv(view.camera.T_world_camera)
    ball = posed_truths['10_1'][0]
    x, y, z = T[:3, :3] @ ball.translation + T[:3, 3]
    u, v = 150 * x / z + 79.5, 150 * y / z + 59.5
    assert classes[round(v), round(u)] == names.index('ball') + 1


def test_perfect_probabilities_are_perfect(observation, posed_truths, models):
    truths, ordered = posed_truths['10_1'], tuple(models.values())
    scores = pixel_scores(probabilities_of(observation, truths, ordered), observation, truths,
                          ordered)
    assert scores['accuracy'] == scores['balanced_accuracy'] == 1
    assert scores['true_probability'] > 0.98 and scores['log_loss'] < 0.02
    assert scores['pixels'] > 500


def test_spoilt_pixels_are_counted(observation, posed_truths, models):
    truths, ordered = posed_truths['10_1'], tuple(models.values())
    scores = pixel_scores(probabilities_of(observation, truths, ordered, 0.3), observation,
                          truths, ordered)
    assert scores['accuracy'] == pytest.approx(0.7, abs=0.04)
    assert scores['balanced_accuracy'] == pytest.approx(0.7, abs=0.08)


def test_no_certain_pixel_gives_no_number(observation, models):
    ordered = tuple(models.values())
    scores = pixel_scores(probabilities_of(observation, [], ordered), observation, [], ordered)
    assert scores['pixels'] == 0 and np.isnan(scores['accuracy'])


def test_candidates_there_and_back(posed_truths, models):
    ordered = tuple(models.values())
    back = as_objects(as_candidates(posed_truths['10_1'], ordered), ordered)
    for a, b in zip(posed_truths['10_1'], back, strict=True):
        assert a.category == b.category
        np.testing.assert_allclose(a.translation, b.translation)
        np.testing.assert_allclose(a.size, b.size, rtol=1e-6)
    assert len(as_candidates([], ordered)) == 0


def test_pool_recall(posed_truths, models):
    truths, ordered = posed_truths['10_1'], tuple(models.values())
    ids = [list(models).index(name) + 1 for name in ('ball', 'ball', 'box', 'can')]
    ball, box, can = (t.translation for t in truths)
    # The ball's best-scored candidate is wrong, the box is 5 cm off (of 8), the can far off.
    places = np.array([ball + [0.3, 0, 0], ball + [0.01, 0, 0], box + [0.05, 0, 0],
                       can + [0.3, 0, 0]])
    pool = Candidates(np.array(ids, np.uint16), places, np.tile([0, 0, 0, 1.0], (4, 1)),
                      np.full((4, 3), 0.1, np.float32), np.array([.9, .1, .5, .5], np.float32))
    answer = score_scene('x', as_objects(pool.take([0, 2]), ordered), truths, models)
    loss = pool_recall(pool, truths, ordered, answer)
    assert loss.pool_localized == pytest.approx(2 / 3)
    assert loss.pool_tight == pytest.approx(1 / 3)
    assert loss.first_localized == pytest.approx(1 / 3)
    assert loss.kept == pytest.approx(1 / 2)
    assert loss.candidates == 4
    assert pool_recall(Candidates.empty(), truths, ordered).pool_localized == 0
