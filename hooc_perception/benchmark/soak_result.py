# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The result of a soak test, and its picture."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hooc_perception.benchmark.change_check import ChangeResult
from hooc_perception.core.arrays import Float64Array, Int64Array
import numpy as np

# The first answers compile, load and fill caches: growth counts after this many of them and after
# this share of the time.
WARM_ANSWERS, WARM_UP = 8, 0.3
# The level to which memory falls back, percentile.
LEVEL = 10
COLOURS = {'put': 'tab:green', 'taken': 'tab:orange', 'moved': 'tab:blue'}


@dataclass
class SoakResult:
    """
    The result of a soak test.

    :ivar seconds: (n,) time of each sample since the first image; answered: (n,) frame sets
        that were answered by then.
    :ivar memory_mb: {process: (n,) resident memory, MB}.
    :ivar frames: published images; sets: frame sets that ingestion assembled; answers: those
        that were answered; refused: those that a stage rejected; deaths: of nodes.
    :ivar reasons: (thing, reason) -> number, as the nodes count them.
    :ivar background_mb: most memory of the processes of full parses.
    :ivar changes: how the answers followed the changes of the table; None = there were none.
    :ivar start_ns: stamp from which `seconds` count.
    """

    seconds: Float64Array
    answered: Int64Array
    memory_mb: dict[str, Float64Array]
    frames: int
    sets: int
    answers: int
    refused: int
    deaths: int
    reasons: Counter[tuple[str, str]] = field(default_factory=Counter)
    background_mb: float = 0.0
    changes: ChangeResult | None = None
    start_ns: int = 0

    def growth_mb(self, name: str) -> float:
        """
        Return the growth of a process after warm-up: last quarter minus first quarter.

        Of each, the level counts to which memory falls back: it rises while a node computes, which
        it does more or less often.
        """
        rows = self.memory_mb[name][self._warm():]
        quarter = max(1, len(rows) // 4)
        return float(np.nanpercentile(rows[-quarter:], LEVEL)
                     - np.nanpercentile(rows[:quarter], LEVEL))

    def growth_mb_per_hour(self, name: str) -> float:
        """Return the slope of a line through the memory of a process after warm-up."""
        start = self._warm()
        if len(self.seconds) - start < 2:
            return float('nan')
        return float(3600 * np.polyfit(self.seconds[start:], self.memory_mb[name][start:], 1)[0])

    def _warm(self) -> int:
        """Return the first sample at which growth counts, the last one at the latest."""
        warm = max(int(WARM_UP * len(self.seconds)),
                   int(np.searchsorted(self.answered, WARM_ANSWERS)))
        return min(warm, len(self.seconds) - 1)


def write_plot(path: str | Path, result: SoakResult) -> None:
    """Draw the memory of every process over time as a PNG, and how changes were answered."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    changes = result.changes
    figure, axes = pyplot.subplots(1 if changes is None else 2, figsize=(
        8, 4 if changes is None else 6), dpi=120, sharex=True, squeeze=False)
    memory = axes[0, 0]
    for name, rows in result.memory_mb.items():
        memory.plot(result.seconds / 60, rows, label=name)
    memory.set(ylabel='resident memory, MB', ylim=(0, None),
               title=f'{result.answers} frame sets answered, {result.deaths} deaths')
    memory.legend(loc='lower right')
    if changes is not None:
        _draw_changes(axes[1, 0], changes, result.start_ns)
    for each in axes[:, 0]:
        each.grid(alpha=0.3)
    axes[-1, 0].set_xlabel('minutes')
    figure.tight_layout()
    figure.savefig(path)
    pyplot.close(figure)


def _draw_changes(axes: Any, changes: ChangeResult, start_ns: int) -> None:
    """Draw the time from each change to the first answer that shows it."""
    for kind, colour in COLOURS.items():
        mine = [f for f in changes.followed if f.change.kind == kind and f.late is not None]
        axes.plot([(f.stamp_ns - start_ns) * 1e-9 / 60 for f in mine], [f.seconds for f in mine],
                  'o', color=colour, label=kind)
    axes.plot([(f.stamp_ns - start_ns) * 1e-9 / 60 for f in changes.lost],
              np.zeros(len(changes.lost)), 'rx', label='never')
    axes.set(ylabel='seconds until the answer',
             title=f'{len(changes.followed)} changes, {len(changes.lost)} not shown')
    axes.legend(loc='upper right')
