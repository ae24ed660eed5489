# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether scores are calibrated probabilities and sigmas match the errors."""

from collections.abc import Iterator
from typing import Any

from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.evaluation.evaluate import Evaluation
from hooc_perception.evaluation.tables import Table
import numpy as np

SCORE_BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)
# An estimate with a score above this is taken for certain.
CERTAIN = 0.8


def verdicts(evaluation: Evaluation) -> tuple[Float64Array, BoolArray]:
    """
    Return (score (n,) float64, right (n,) bool) of all estimates of an Evaluation.

    An estimate is right if it is localized: its centre within half the model's size of a true
    one of its category, one to one.
    """
    score, right = [], []
    for scene in evaluation.scores:
        good = {o.estimate for o in scene.objects if o.localized}
        for i, estimate in enumerate(evaluation.estimates[scene.name]):
            score.append(estimate.score)
            right.append(i in good)
    return np.array(score, float), np.array(right, bool)


def reliability(score: Float64Array,
                right: BoolArray) -> list[tuple[float, float, int, float, float]]:
    """Return [(low, high, number, mean score, share that is right)] of the non-empty bins."""
    out = []
    for low, high in zip(SCORE_BINS[:-1], SCORE_BINS[1:]):
        mine = (score >= low) & ((score < high) | (high == 1.0))
        if mine.any():
            out.append((low, high, int(mine.sum()), float(score[mine].mean()),
                        float(right[mine].mean())))
    return out


def calibration_error(score: Float64Array, right: BoolArray) -> float:
    """
    Return the expected calibration error, NaN without estimates.

    The mean over estimates of the distance, in the bin of each, between the mean score and the
    share that is right.
    """
    bins = reliability(score, right)
    n = sum(number for _, _, number, _, _ in bins)
    return sum(number * abs(mean - share) for _, _, number, mean, share in bins) / (n or np.nan)


def certain_and_wrong(score: Float64Array, right: BoolArray) -> tuple[int, int, float]:
    """Return how many scores exceed CERTAIN, how many of these are wrong, and that share."""
    certain = score > CERTAIN
    n, wrong = int(certain.sum()), int((certain & ~right).sum())
    return n, wrong, wrong / n if n else float('nan')


def certainty_summary(evaluation: Evaluation) -> dict[str, Any]:
    """
    Return what `--json` holds of the scores of an Evaluation.

    :return: {estimates, localized, mean_score, calibration_error, brier, certain: {above,
        estimates, wrong, share}, bins: [{low, high, estimates, mean_score, localized}]}; the
        `localized` are shares of estimates.
    """
    score, right = verdicts(evaluation)
    some = len(score) > 0
    certain, wrong, share = certain_and_wrong(score, right)
    names = ('low', 'high', 'estimates', 'mean_score', 'localized')
    return {'estimates': len(score),
            'localized': float(right.mean()) if some else float('nan'),
            'mean_score': float(score.mean()) if some else float('nan'),
            'calibration_error': calibration_error(score, right),
            'brier': float(((score - right) ** 2).mean()) if some else float('nan'),
            'certain': {'above': CERTAIN, 'estimates': certain, 'wrong': wrong, 'share': share},
            'bins': [dict(zip(names, row)) for row in reliability(score, right)]}


def score_table(evaluation: Evaluation) -> Table | None:
    """Return the Table of scores beside the share that is right, None without estimates."""
    score, right = verdicts(evaluation)
    if not len(score):
        return None
    rows = [(f'{low:g} to {high:g}', n, mean, share)
            for low, high, n, mean, share in reliability(score, right)]
    return Table(f'Scores as probabilities: {evaluation.label}',
                 ('score', 'estimates', 'mean score', 'localized'),
                 (*rows, ('all', len(score), float(score.mean()), float(right.mean()))),
                 ('Calibrated: a score equals the share of such estimates that is localized. '
                  f'Expected calibration error {calibration_error(score, right):.3f}, the mean '
                  'distance between the two, weighted by the number of estimates.',),
                 (len(rows),))


def sigma_errors(evaluation: Evaluation) -> dict[str, Float64Array]:
    """
    Return {t, r: (n, 2) float64} of error and sigma, metres and radians, of localized objects.

    Objects without a sigma are left out.
    """
    out: dict[str, list[tuple[float, float]]] = {'t': [], 'r': []}
    for scene in evaluation.scores:
        for o in scene.objects:
            if o.localized and o.estimate is not None:
                estimate = evaluation.estimates[scene.name][o.estimate]
                out['t'].append((o.centre_m, estimate.sigma_t))
                out['r'].append((o.rotation_rad, estimate.sigma_r))
    pairs = {key: np.array(rows, float).reshape(-1, 2) for key, rows in out.items()}
    return {key: rows[np.isfinite(rows).all(1)] for key, rows in pairs.items()}


def sigma_table(evaluation: Evaluation) -> Table | None:
    """Return the Table of sigmas beside errors, None where the results have no sigmas."""
    rows = []
    for key, name, unit in (('t', 'sigma_t', 1000), ('r', 'sigma_r', 180 / np.pi)):
        pairs = sigma_errors(evaluation)[key]
        pairs = pairs[np.argsort(pairs[:, 1], kind='stable')]
        for which, part in _quarters(pairs):
            if len(part):
                error, sigma = part.T
                rows.append((f'{name}, {which}', len(part), unit * float(np.median(sigma)),
                             unit * float(np.median(error)), float((error <= sigma).mean()),
                             float((error <= 2 * sigma).mean())))
    if not rows:
        return None
    return Table(f'Errors and sigmas: {evaluation.label}',
                 ('mm, deg', 'objects', 'median sigma', 'median error', 'within 1', 'within 2'),
                 tuple(rows), ('Localized objects, in quarters by sigma from small to large. '
                               'Ideal: .68 within one sigma.',))


def _quarters(pairs: Float64Array) -> Iterator[tuple[str, Float64Array]]:
    """Yield (name, rows) of all pairs and, where there are enough, of each quarter."""
    yield 'all', pairs
    if len(pairs) >= 8:
        yield from ((f'quarter {i}', part) for i, part in enumerate(np.array_split(pairs, 4), 1))
