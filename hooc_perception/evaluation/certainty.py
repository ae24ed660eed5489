# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether scores are probabilities and sigmas hold what they promise."""

from hooc_perception.evaluation.tables import Table
import numpy as np

SCORE_BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)


def verdicts(evaluation):
    """
    Return (score (n,) float64, right (n,) bool) of all estimates of an Evaluation.

    Right is an estimate that is localized: its centre within half the model's size of a true
    one of its category, one to one.
    """
    score, right = [], []
    for scene in evaluation.scores:
        good = {o.estimate for o in scene.objects if o.localized}
        for i, estimate in enumerate(evaluation.estimates[scene.name]):
            score.append(estimate.score)
            right.append(i in good)
    return np.array(score, float), np.array(right, bool)


def reliability(score, right):
    """Return [(low, high, number, mean score, share that is right)] of bins that are not empty."""
    out = []
    for low, high in zip(SCORE_BINS[:-1], SCORE_BINS[1:]):
        mine = (score >= low) & ((score < high) | (high == 1.0))
        if mine.any():
            out.append((low, high, int(mine.sum()), float(score[mine].mean()),
                        float(right[mine].mean())))
    return out


def score_table(evaluation):
    """Return the Table that holds scores against what is right, None without estimates."""
    score, right = verdicts(evaluation)
    if not len(score):
        return None
    rows = [(f'{low:g} to {high:g}', n, mean, share)
            for low, high, n, mean, share in reliability(score, right)]
    return Table(f'Scores as probabilities: {evaluation.label}',
                 ('score', 'estimates', 'mean score', 'localized'),
                 (*rows, ('all', len(score), float(score.mean()), float(right.mean()))),
                 ('A calibrated score is the share of its like that is localized.',),
                 (len(rows),))


def sigma_errors(evaluation):
    """
    Return {t, r: (n, 2) float64} of error and sigma, metres and radians, of localized objects.

    What has no sigma is left out.
    """
    out = {'t': [], 'r': []}
    for scene in evaluation.scores:
        for o in scene.objects:
            if o.localized:
                estimate = evaluation.estimates[scene.name][o.estimate]
                out['t'].append((o.centre_m, estimate.sigma_t))
                out['r'].append((o.rotation_rad, estimate.sigma_r))
    pairs = {key: np.array(rows, float).reshape(-1, 2) for key, rows in out.items()}
    return {key: rows[np.isfinite(rows).all(1)] for key, rows in pairs.items()}


def sigma_table(evaluation):
    """Return the Table that holds sigmas against errors, None where the results have none."""
    rows = []
    for key, name, unit in (('t', 'sigma_t', 1000), ('r', 'sigma_r', 180 / np.pi)):
        pairs = sigma_errors(evaluation)[key]
        pairs = pairs[np.argsort(pairs[:, 1], kind='stable')]
        parts = [('all', pairs)] + [(f'quarter {i}', part) for i, part in enumerate(
            np.array_split(pairs, 4), 1)] if len(pairs) >= 8 else [('all', pairs)]
        for which, part in parts:
            if len(part):
                error, sigma = part.T
                rows.append((f'{name}, {which}', len(part), unit * float(np.median(sigma)),
                             unit * float(np.median(error)), float((error <= sigma).mean()),
                             float((error <= 2 * sigma).mean())))
    if not rows:
        return None
    return Table(f'Errors and sigmas: {evaluation.label}',
                 ('mm, deg', 'objects', 'median sigma', 'median error', 'within 1', 'within 2'),
                 tuple(rows), ('Of localized objects, by quarters from the surest to the least '
                               'sure; .68 within one sigma is what is promised.',))
