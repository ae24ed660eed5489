# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Plots of the scores: bars per category, distribution of the errors, reliability."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.evaluation.certainty import (
    calibration_error,
    CERTAIN,
    reliability,
    SCORE_BINS,
    sigma_errors,
    verdicts,
)
from hooc_perception.evaluation.evaluate import Evaluation
from hooc_perception.evaluation.scores import pose_errors, SceneScore
import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

COLOURS = ('#3b6fb6', '#d9822b', '#3f9b62', '#b5495b', '#7b5ea7', '#6b7280')


def _axes(width: float, height: float, n: int = 1) -> tuple[Figure, Sequence[Axes]]:
    """Return a figure of this size in inches and its n axes side by side."""
    with matplotlib.rc_context({'font.size': 9}):
        figure = Figure(figsize=(width, height), layout='constrained')
        axes = figure.subplots(1, n, squeeze=False)[0]
    for ax in axes:
        ax.spines[['top', 'right']].set_visible(False)
    return figure, axes


def category_bars(named: Sequence[tuple[str, Mapping[str, Any]]], categories: Iterable[str],
                  path: str | Path) -> None:
    """
    Draw the share of true objects that are localized, a group of bars per category.

    :param named: (label, {category: dict as from `scores.per_category`}) of each result.
    :param path: PNG file to write.
    """
    shown = [c for c in categories if any(table[c]['true'] for _, table in named)]
    figure, (ax,) = _axes(max(6.0, 0.36 * len(shown) + 1.5), 3.6)
    width = 0.8 / max(len(named), 1)
    for k, (label, table) in enumerate(named):
        at = np.arange(len(shown)) + (k - (len(named) - 1) / 2) * width
        true = np.array([max(table[c]['true'], 1) for c in shown])
        for key, alpha in (('found', 0.3), ('localized', 1.0)):
            ax.bar(at, [table[c][key] for c in shown] / true, width * 0.92, alpha=alpha,
                   color=COLOURS[k % len(COLOURS)],
                   label=f'{label}: {key}' if len(shown) else None)
    ax.set_xticks(range(len(shown)), [c.replace('_', ' ') for c in shown], rotation=60,
                  ha='right')
    ax.set_ylim(0, 1)
    ax.set_ylabel('share of the true objects')
    ax.legend(frameon=False, fontsize=8, ncols=max(1, len(named)), loc='lower center',
              bbox_to_anchor=(0.5, 1.0))
    figure.savefig(path, dpi=130)


def error_curves(named: Sequence[tuple[str, Sequence[SceneScore]]], path: str | Path) -> None:
    """
    Plot the share of all true objects below an error over the error: centre and rotation.

    Objects that were not found are below no error, so the curves end at the found share.

    :param named: (label, scores) of each result.
    """
    figure, axes = _axes(9.0, 3.4, 2)
    for k, (label, scores) in enumerate(named):
        errors = pose_errors(scores)
        n = max(1, sum(len(s.objects) for s in scores))
        for ax, values, limit in ((axes[0], errors['centre_m'] * 100, 15),
                                  (axes[1], np.degrees(errors['rotation_rad']), 180)):
            x = np.sort(values)
            ax.step(np.concatenate([[0], x, [max(limit, x.max(initial=0))]]),
                    np.concatenate([[0], np.arange(1, len(x) + 1), [len(x)]]) / n,
                    where='post', color=COLOURS[k % len(COLOURS)], label=label)
            ax.set_xlim(0, limit)
            ax.set_ylim(0, 1)
    axes[0].axvline(2, color='0.6', lw=0.8, ls=':')
    axes[0].set_xlabel('error of the centre, cm')
    axes[1].set_xlabel('error of the rotation, up to symmetry, degrees')
    axes[0].set_ylabel('share of the true objects')
    axes[0].legend(frameon=False, fontsize=8, loc='lower right')
    figure.savefig(path, dpi=130)


def certainty_plot(evaluations: Sequence[Evaluation], path: str | Path) -> None:
    """
    Plot a reliability diagram of the scores, and errors over sigmas.

    :param evaluations: those without sigmas are left out of the second plot, which is omitted
        where none has any.
    """
    sigmas = [sigma_errors(e)['t'] * 1000 for e in evaluations]
    with_sigmas = any(map(len, sigmas))
    with matplotlib.rc_context({'font.size': 9}):
        figure = Figure(figsize=(9.0 if with_sigmas else 4.5, 4.4), layout='constrained')
        axes = figure.subplot_mosaic(
            [['shares', 'sigmas'], ['counts', 'sigmas']] if with_sigmas
            else [['shares'], ['counts']], height_ratios=[3, 1])
    for ax in axes.values():
        ax.spines[['top', 'right']].set_visible(False)
    _reliability(axes['shares'], axes['counts'], evaluations)
    if with_sigmas:
        _sigmas(axes['sigmas'], [(e.label, pairs) for e, pairs in zip(evaluations, sigmas)])
    figure.savefig(path, dpi=130)


def _reliability(shares: Axes, counts: Axes, evaluations: Sequence[Evaluation]) -> None:
    """Plot the share of right estimates over their mean score, and how many there are."""
    shares.plot([0, 1], [0, 1], color='0.7', lw=0.8)
    for k, e in enumerate(evaluations):
        score, right = verdicts(e)
        bins = np.array(reliability(score, right), float).reshape(-1, 5)
        if not len(bins):
            continue
        n, mean, share = bins.T[2:]
        # One standard deviation of the share, given so few estimates.
        error = np.sqrt((share * n + 1) * ((1 - share) * n + 1) / (n + 2) ** 2 / (n + 3))
        colour = COLOURS[k % len(COLOURS)]
        shares.errorbar(mean, share, [np.minimum(error, share), np.minimum(error, 1 - share)],
                        fmt='o-', ms=4, lw=1, color=colour,
                        label=f'{e.label}: {len(score)} estimates, '
                              f'off by {calibration_error(score, right):.3f}')
        counts.stairs(np.histogram(score, SCORE_BINS)[0], SCORE_BINS, color=colour, lw=1.2)
    for ax in (shares, counts):
        ax.axvline(CERTAIN, color='0.6', lw=0.8, ls=':')
        ax.set_xlim(0, 1.02)
    shares.set_ylim(0, 1.02)
    shares.set_ylabel('share that is localized')
    shares.set_xlabel('mean score')
    if shares.get_legend_handles_labels()[0]:
        shares.legend(frameon=False, fontsize=8)
    counts.set_ylim(bottom=0)
    counts.set_xlabel('score')
    counts.set_ylabel('estimates')


def _sigmas(ax: Axes, named: Sequence[tuple[str, Float64Array]]) -> None:
    """Plot the error of the centre over sigma_t, from (label, pairs of both in millimetres)."""
    for k, (label, pairs) in enumerate(named):
        if len(pairs):
            ax.loglog(pairs[:, 1], np.maximum(pairs[:, 0], 0.2), 'o', ms=3, alpha=0.6,
                      color=COLOURS[k % len(COLOURS)], label=label)
    ax.loglog([1, 100], [1, 100], color='0.7', lw=0.8)
    ax.set_xlabel('sigma_t, mm')
    ax.set_ylabel('error of the centre, mm')


def write_plots(folder: str | Path, evaluations: Sequence[Evaluation],
                categories: Sequence[str]) -> list[Path]:
    """Write categories.png, errors.png and certainty.png into a folder; return their paths."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / name for name in ('categories.png', 'errors.png', 'certainty.png')]
    category_bars([(e.label, e.per_category(categories)) for e in evaluations], categories,
                  paths[0])
    error_curves([(e.label, e.scores) for e in evaluations], paths[1])
    certainty_plot(evaluations, paths[2])
    return paths
