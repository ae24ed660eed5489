# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the scores: bars per category and how the errors are distributed."""

from pathlib import Path

from hooc_perception.evaluation.scores import pose_errors
import matplotlib
from matplotlib.figure import Figure
import numpy as np

COLOURS = ('#3b6fb6', '#d9822b', '#3f9b62', '#b5495b', '#7b5ea7', '#6b7280')


def _axes(width, height, n=1):
    with matplotlib.rc_context({'font.size': 9}):
        figure = Figure(figsize=(width, height), layout='constrained')
        axes = figure.subplots(1, n, squeeze=False)[0]
    for ax in axes:
        ax.spines[['top', 'right']].set_visible(False)
    return figure, axes


def category_bars(named, categories, path):
    """
    Draw the share of true objects that are localized, a group of bars per category.

    :param named: sequence of (label, {category: dict as from `scores.per_category`}).
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


def error_curves(named, path):
    """
    Draw the share of all true objects below an error, over the error: centre and rotation.

    Objects that were not found never get below any, so the curves end at the found share.

    :param named: sequence of (label, [SceneScore]).
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


def reliability(named, path, bins=5):
    """
    Draw the share of estimates that are right over their score, and how many there are.

    :param named: sequence of (label, (score (n,), right (n,)) as from `scores.verdicts`).
    """
    figure, (ax,) = _axes(4.2, 3.6)
    ax.plot([0, 1], [0, 1], color='0.7', lw=0.8, ls=':')
    for k, (label, (score, right)) in enumerate(named):
        at = np.clip((score * bins).astype(int), 0, bins - 1)
        count = np.bincount(at, minlength=bins)
        shown = count > 0
        x, y = (np.bincount(at, weights=w, minlength=bins)[shown] / count[shown]
                for w in (score, right))
        colour = COLOURS[k % len(COLOURS)]
        ax.plot(x, y, color=colour, lw=1, label=label)
        ax.scatter(x, y, s=8 + 4 * np.sqrt(count[shown]), color=colour)
        for xi, yi, n in zip(x, y, count[shown]):
            ax.annotate(str(n), (xi, yi), (4, -9), textcoords='offset points', fontsize=7,
                        color=colour)
    ax.set_xlim(0, 1.02)
    ax.set_ylim(0, 1.02)
    ax.set_xlabel('mean score of the estimates')
    ax.set_ylabel('share of them that are right')
    ax.legend(frameon=False, fontsize=8, loc='upper left')
    figure.savefig(path, dpi=130)


def write_plots(folder, named, categories):
    """
    Write categories.png, errors.png and reliability.png into a folder; return their paths.

    :param named: sequence of (label, [SceneScore], per-category table, verdicts).
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f'{name}.png' for name in ('categories', 'errors', 'reliability')]
    category_bars([(label, table) for label, _, table, _ in named], categories, files[0])
    error_curves([(label, scores) for label, scores, _, _ in named], files[1])
    reliability([(label, verdicts) for label, _, _, verdicts in named], files[2])
    return files
