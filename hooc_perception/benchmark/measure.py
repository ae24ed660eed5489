# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How a contest is run: the same work by several contestants, who must agree on the result."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter as now
import tracemalloc
from typing import Any

from hooc_perception.errors import HoocError
import numpy as np

# A contestant is repeated until it has run this long, but at least MIN_RUNS times, unless one
# run alone takes longer than PATIENCE_S.
MIN_SECONDS, MIN_RUNS, MAX_RUNS, PATIENCE_S = 0.4, 5, 1000, 5.0


@dataclass(frozen=True)
class Contestant:
    """
    One way to do the work.

    :ivar run: function without arguments; its result is compared by the contest.
    :ivar share: part of the work that it does: a slow one may do a tenth; its time is scaled.
    """

    name: str
    run: Callable[[], Any]
    share: float = 1.0


@dataclass(frozen=True)
class Contest:
    """
    One stage.

    :ivar stage: short name; `work` describes one unit of work.
    :ivar contestants: ours first; the last one is the baseline of the ratios.
    :ivar disagreement: (result of ours, result of another) -> one number that must not exceed
        `tolerance`; None where results are not comparable.
    """

    stage: str
    work: str
    contestants: tuple[Contestant, ...]
    disagreement: Callable[[Any, Any], Any] | None = None
    tolerance: float = 0.0


@dataclass(frozen=True)
class Entry:
    """
    The measurements of one contestant.

    :ivar seconds: median over the runs, for the whole work.
    :ivar ratio: how many times faster than the contest's baseline.
    :ivar peak_mb: peak memory allocated by Python and numpy.
    :ivar disagreement: with ours; NaN for ours and where nothing is compared.
    """

    stage: str
    work: str
    name: str
    seconds: float
    ratio: float
    runs: int
    peak_mb: float
    disagreement: float


def hold(contest: Contest) -> tuple[Entry, ...]:
    """
    Return the Entries of a Contest, in its order.

    :raises HoocError: where the result of a contestant differs from ours, so that the times
        cannot be compared.
    """
    measured, ours = [], None
    for contestant in contest.contestants:
        result, seconds, runs, peak_mb = _measure(contestant.run)
        difference = float('nan')
        if ours is None:
            ours = result
        elif contest.disagreement is not None:
            difference = float(contest.disagreement(ours, result))
            if not difference <= contest.tolerance:
                raise HoocError(f'{contest.stage}: {contestant.name} differs from ours by '
                                f'{difference:.3g}, more than {contest.tolerance:.3g}, so the '
                                'times cannot be compared; run the tests of that stage')
        measured.append((contestant, seconds / contestant.share, runs, peak_mb, difference))
    baseline = measured[-1][1]
    return tuple(Entry(contest.stage, contest.work, contestant.name, seconds, baseline / seconds,
                       runs, peak_mb, difference)
                 for contestant, seconds, runs, peak_mb, difference in measured)


def _measure(run: Callable[[], Any]) -> tuple[Any, float, int, float]:
    """Return (result, median s, number of runs, peak MB); the first run is a warm-up."""
    start = now()
    result = run()
    first = now() - start
    # A run that takes seconds is not repeated: it has filled the caches long before its end.
    times = [first] if first > PATIENCE_S else []
    total = sum(times)
    while (len(times) < MIN_RUNS or total < MIN_SECONDS) and (
            total <= PATIENCE_S and len(times) < MAX_RUNS):
        start = now()
        run()
        times.append(now() - start)
        total += times[-1]
    peak_mb = float('nan')
    if first < PATIENCE_S:
        # Not while timing, because it slows down every allocation.
        tracemalloc.start()
        run()
        peak_mb = tracemalloc.get_traced_memory()[1] / 2 ** 20
        tracemalloc.stop()
    return result, float(np.median(times)), len(times), peak_mb
