# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Reliability and coverage on made-up answers whose certainty is known."""

from types import SimpleNamespace

from hooc_perception.evaluation.certainty import (
    calibration_error,
    certain_and_wrong,
    certainty_summary,
    reliability,
    score_table,
    sigma_errors,
    sigma_table,
    verdicts,
)
from hooc_perception.evaluation.matching import posed, PosedObject
from hooc_perception.evaluation.plots import certainty_plot
from hooc_perception.evaluation.scores import score_scene
import numpy as np
from PIL import Image
import pytest
from scipy.spatial.transform import Rotation


@pytest.fixture
def made_up(models):
    """Return an Evaluation of 400 cans: right as often as they say, errors as large."""
    rng = np.random.default_rng(0)
    scores, estimates = [], {}
    for i in range(400):
        score, sigma = rng.uniform(0.1, 1.0), rng.uniform(0.002, 0.004)
        right = rng.random() < score
        at = rng.normal(size=3) * sigma / 1.87 if right else np.array([1.0, 0, 0])
        turn = Rotation.from_rotvec([rng.normal() * 0.1, 0, 0])
        truth = PosedObject('can', np.zeros(3), np.array([0, 0, 0, 1.0]), models['can'].extents)
        found = PosedObject('can', at, turn.as_quat(), models['can'].extents, score, sigma, 0.1)
        estimates[str(i)] = [found]
        scores.append(score_scene(str(i), [found], [truth], models))
    return SimpleNamespace(label='made up', scores=tuple(scores), estimates=estimates)


def test_scores_that_are_probabilities_lie_on_the_diagonal(made_up):
    score, right = verdicts(made_up)
    assert len(score) == 400 and 0.3 < right.mean() < 0.8
    for _, _, n, mean, share in reliability(score, right):
        assert abs(mean - share) < 3 * 0.5 / np.sqrt(n)
    table = score_table(made_up)
    assert table.rows[-1][1] == 400 == sum(row[1] for row in table.rows[:-1])


def test_certain_but_wrong_and_calibration_by_hand(models):
    truth = PosedObject('can', np.zeros(3), np.array([0, 0, 0, 1.0]), models['can'].extents)

    def can(score, x):
        return PosedObject('can', np.array([x, 0, 0]), truth.rotation_xyzw, truth.size, score)

    # Above .8: one right, one astray, and one doubled, whose place is taken. A score of .8
    # itself is not above it.
    estimates = {'a': [can(0.9, 0.0), can(0.85, 0.02)], 'b': [can(0.99, 1.0)], 'c': [can(0.8, 0)],
                 'd': [can(0.2, 1.0)]}
    scores = tuple(score_scene(name, objects, [truth], models)
                   for name, objects in estimates.items())
    some = SimpleNamespace(label='some', scores=scores, estimates=estimates)
    score, right = verdicts(some)
    assert right.tolist() == [True, False, False, True, False]
    assert certain_and_wrong(score, right) == (3, 2, pytest.approx(2 / 3))
    summary = certainty_summary(some)
    assert summary['certain'] == {'above': 0.8, 'estimates': 3, 'wrong': 2,
                                  'share': pytest.approx(2 / 3)}
    assert (summary['estimates'], summary['localized']) == (5, 0.4)
    # Bins: .2 (0 of 1), .8 and .85 (1 of 2), .9 (1 of 1), .99 (0 of 1).
    assert [b['estimates'] for b in summary['bins']] == [1, 2, 1, 1]
    assert summary['calibration_error'] == pytest.approx(
        (0.2 + 2 * (0.825 - 0.5) + 0.1 + 0.99) / 5)
    assert summary['brier'] == pytest.approx(
        (0.1 ** 2 + 0.85 ** 2 + 0.99 ** 2 + 0.2 ** 2 + 0.2 ** 2) / 5)
    assert '0.388' in score_table(some).notes[0]


def test_without_estimates_nothing_is_certain():
    nobody = certainty_summary(SimpleNamespace(label='x', scores=(), estimates={}))
    assert nobody['certain']['estimates'] == 0 and nobody['bins'] == []
    assert np.isnan([nobody['certain']['share'], nobody['calibration_error'],
                     nobody['brier']]).all()
    assert np.isnan(calibration_error(np.zeros(0), np.zeros(0, bool)))


def test_errors_lie_within_sigma_as_often_as_promised(made_up):
    pairs = sigma_errors(made_up)
    assert len(pairs['t']) == len(pairs['r'])
    rows = {row[0]: row for row in sigma_table(made_up).rows}
    assert rows['sigma_t, all'][4] == pytest.approx(0.68, abs=0.06)
    assert rows['sigma_r, all'][4] == pytest.approx(0.68, abs=0.06)
    assert rows['sigma_t, all'][5] > 0.97
    quarters = [rows[f'sigma_t, quarter {i}'][2] for i in (1, 2, 3, 4)]
    assert quarters == sorted(quarters)


def test_results_without_sigmas_have_no_table(made_up, tmp_path):
    bare = {name: [PosedObject(o.category, o.translation, o.rotation_xyzw, o.size, o.score)
                   for o in objects] for name, objects in made_up.estimates.items()}
    plain = SimpleNamespace(label='plain', scores=made_up.scores, estimates=bare)
    assert sigma_table(plain) is None and score_table(plain) is not None
    nobody = SimpleNamespace(label='x', scores=(), estimates={})
    assert score_table(nobody) is None and sigma_table(nobody) is None
    certainty_plot([plain, made_up, nobody], tmp_path / 'c.png')
    assert np.asarray(Image.open(tmp_path / 'c.png').convert('L')).std() > 5


def test_sigmas_are_read_from_results():
    entry = {'category': 'can', 'translation': [0, 0, 0], 'rotation_xyzw': [0, 0, 0, 1],
             'size': [1, 1, 1], 'score': None}
    assert np.isnan(posed(entry).sigma_t)
    told = posed(entry | {'sigma_t': 0.004, 'sigma_r': None})
    assert told.sigma_t == 0.004 and np.isnan(told.sigma_r)
