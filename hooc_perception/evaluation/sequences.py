# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Scores of recorded sequences: how soon a change is right, and how steady the rest is.

A frame set is *right* about a removed object when no estimate of its category is near to where
it was, and about a placed or moved object when an estimate of its category is near to where it
is. *Near* is as in the paper: within half the longest side of the generic model.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from hooc_perception.core.types import GenericModel
from hooc_perception.evaluation.matching import PosedObject
from hooc_perception.evaluation.open_world import LOCALIZED_SHARE
from hooc_perception.evaluation.scores import SceneScore
from hooc_perception.evaluation.tables import Cell, Table
from hooc_perception.io.scenes.scene import TrueObject
from hooc_perception.io.scenes.sequences import ARM_IN, ARM_OUT, RecordedSequence, REMOVED
import numpy as np

# True objects of which the cameras see a smaller share, behind the arm for instance, do not count.
LEAST_SEEN = 0.15
# An object that moves farther than this between two still frame sets has jumped.
JUMP_M = 0.02


@dataclass(frozen=True)
class Frame:
    """What the scores of one frame set come from: its scene's score, truth and estimates."""

    score: SceneScore
    truth: Sequence[TrueObject]
    estimates: Sequence[PosedObject]


@dataclass(frozen=True)
class FrameScore:
    """
    One frame set.

    :ivar localized: share of the true objects that count; NaN where none does.
    :ivar false_categories: number of estimated categories that are not there.
    :ivar seconds: as the results say; NaN where they lack the scene.
    """

    scene: str
    localized: float
    false_categories: int
    seconds: float


@dataclass(frozen=True)
class ChangeScore:
    """
    One object that was removed, placed or moved.

    :ivar frame: index of the first frame set that shows it.
    :ivar what: the event, such as 'removed can'.
    :ivar after: how many further frame sets it takes until one is right, 0 = right at once;
        None = not before the next event.
    """

    frame: int
    what: str
    after: int | None


@dataclass(frozen=True)
class SequenceScore:
    """
    The scores of one sequence.

    :ivar flicker: of every two successive still frame sets, the share of the categories told in
        either that are told in one only.
    :ivar jitter_m: how far each category told in both is from where it was, metres.
    :ivar switches: how often a localized object has another id than when last localized; None
        where no estimate has an id.
    """

    name: str
    frames: tuple[FrameScore, ...]
    changes: tuple[ChangeScore, ...]
    flicker: tuple[float, ...]
    jitter_m: tuple[float, ...]
    switches: int | None


def sequence_score(sequence: RecordedSequence, frames: Sequence[Frame],
                   models: Mapping[str, GenericModel]) -> SequenceScore:
    """Return the SequenceScore of a sequence; `frames` are its frame sets, in their order."""
    scores = tuple(
        FrameScore(f.score.name, _share([_is_near(true, f, models) for true in _counted(f)]),
                   f.score.false_categories, f.score.seconds) for f in frames)
    flicker, jitter = _steadiness(sequence, frames)
    return SequenceScore(sequence.name, scores, tuple(_changes(sequence, frames, models)),
                         tuple(flicker), tuple(jitter), _switches(frames, models))


def _counted(frame: Frame) -> list[TrueObject]:
    """Return the true objects that the cameras see enough of."""
    return [true for true in frame.truth
            if true.surface_visibility is None or true.surface_visibility >= LEAST_SEEN]


def _near(true: TrueObject | None, frame: Frame, models: Mapping[str, GenericModel],
          ) -> list[PosedObject]:
    """Return the estimates of an object's category that are near to it; none of no object."""
    if true is None:
        return []
    limit = LOCALIZED_SHARE * models[true.category].longest_side
    return [e for e in frame.estimates if e.category == true.category
            and np.linalg.norm(np.subtract(e.translation, true.translation)) < limit]


def _is_near(true: TrueObject | None, frame: Frame, models: Mapping[str, GenericModel]) -> bool:
    """Return whether an estimate of an object's category is near to it."""
    return bool(_near(true, frame, models))


def _changes(sequence: RecordedSequence, frames: Sequence[Frame],
             models: Mapping[str, GenericModel]) -> list[ChangeScore]:
    """Return the ChangeScores in the order of time."""
    out = []
    for start, (verb, category) in sorted(sequence.changes.items()):
        end = min((k for k in sequence.events if k > start), default=len(frames))
        before = _first(category, frames[start - 1])
        right = [k - start for k in range(start, end) if (
            not _is_near(before, frames[k], models) if verb == REMOVED
            else _is_near(_first(category, frames[k]), frames[k], models))]
        out.append(ChangeScore(start, sequence.events[start], min(right, default=None)))
    return out


def _first(category: str, frame: Frame) -> TrueObject | None:
    """Return the first true object of a category, None where there is none."""
    return next((true for true in frame.truth if true.category == category), None)


def _steadiness(sequence: RecordedSequence,
                frames: Sequence[Frame]) -> tuple[list[float], list[float]]:
    """Return (flicker, jitter) over all pairs of successive frame sets in which nothing moves."""
    arm = {k for k, event in sequence.events.items() if event in (ARM_IN, ARM_OUT)}
    flicker, jitter = [], []
    for k in range(1, len(frames)):
        if k in sequence.events or k - 1 in arm:
            continue
        a, b = ({e.category: e.translation for e in frames[j].estimates} for j in (k - 1, k))
        if a or b:
            flicker.append(len(a.keys() ^ b.keys()) / len(a.keys() | b.keys()))
        jitter += [float(np.linalg.norm(np.subtract(a[c], b[c])))
                   for c in sorted(a.keys() & b.keys())]
    return flicker, jitter


def _switches(frames: Sequence[Frame], models: Mapping[str, GenericModel]) -> int | None:
    """Return how often a localized object has changed its id, None without any id."""
    if all(e.id is None for frame in frames for e in frame.estimates):
        return None
    count, last = 0, {}
    for frame in frames:
        for true in _counted(frame):
            number = next((e.id for e in _near(true, frame, models) if e.id is not None), None)
            if number is not None:
                count += last.get(true.category, number) != number
                last[true.category] = number
    return count


def _share(values: Sequence[bool]) -> float:
    """Return the share of True, NaN of nothing."""
    return float(np.mean(values)) if values else float('nan')


def summary(scores: Sequence[SequenceScore]) -> dict[str, Any]:
    """
    Return the figures over all sequences, and every sequence with its frame sets and changes.

    Means are over frame sets, or over pairs of them; None where there is nothing to count.
    `id_switches` is per 100 frame sets.
    """
    frames = [frame for s in scores for frame in s.frames]
    after = [change.after for s in scores for change in s.changes]
    jitter = np.array([metres for s in scores for metres in s.jitter_m])
    known = [s.switches for s in scores if s.switches is not None]
    seconds = _finite([frame.seconds for frame in frames])
    localized = _finite([frame.localized for frame in frames])
    flicker = [share for s in scores for share in s.flicker]
    return {
        'localized': _mean(localized), 'false_categories': _mean(
            [frame.false_categories for frame in frames]),
        'changes': len(after), 'right': sum(k is not None for k in after),
        'at_once': sum(k == 0 for k in after), 'flicker': _mean(flicker),
        'jitter_m': float(np.median(jitter)) if len(jitter) else None,
        'jumps': _mean(jitter > JUMP_M),
        'id_switches': 100 * sum(known) / len(frames) if known else None,
        'seconds_median': float(np.median(seconds)) if seconds else None,
        'seconds_p95': float(np.percentile(seconds, 95)) if seconds else None,
        'sequences': [asdict(s) for s in scores]}


def _finite(values: Sequence[float]) -> list[float]:
    """Return the values without NaN."""
    return [value for value in values if np.isfinite(value)]


def _mean(values: Any) -> float | None:
    """Return the mean, None of nothing."""
    return float(np.mean(values)) if len(values) else None


def tables_of(summaries: Sequence[tuple[str, Mapping[str, Any]]]) -> list[Table]:
    """Return the tables of (label, summary) of several results, [] without any."""
    if not summaries:
        return []
    rows: list[tuple[Cell, ...]] = [
        (label, _text(s['localized'], 3), s['false_categories'],
         f'{s["right"]}/{s["changes"]}', s['at_once'], _text(s['flicker'], 3),
         _text(s['jitter_m'] and 1000 * s['jitter_m'], 1), _text(s['jumps'], 3),
         _text(s['id_switches'], 1), s['seconds_median'], s['seconds_p95'])
        for label, s in summaries]
    figures = Table(
        'Sequences', ('results', 'localized', 'false', 'changes right', 'at once', 'flicker',
                      'jitter mm', '> 2 cm', 'id switches', 's', 's, 95 %'), tuple(rows),
        ('localized, false: means over frame sets; changes right: before the next event; at once: '
         'in the first frame set that shows them; flicker: share of the categories told in one of '
         'two successive still frame sets only; jitter mm, > 2 cm: how far the others move '
         'between them, median and share; id switches: per 100 frame sets; s: seconds per frame '
         'set, median and 95th percentile.',))
    changes = _change_table(summaries)
    return [figures, changes] if changes.rows else [figures]


def _change_table(summaries: Sequence[tuple[str, Mapping[str, Any]]]) -> Table:
    """Return how many further frame sets each change takes, a column per results file."""
    after = [{(q['name'], c['frame'], c['what']): 'never' if c['after'] is None else c['after']
              for q in s['sequences'] for c in q['changes']} for _, s in summaries]
    rows: list[tuple[Cell, ...]] = [
        (f'{name} {frame}: {what}', *(column.get((name, frame, what)) for column in after))
        for name, frame, what in after[0]]
    return Table('Frame sets until a change is right',
                 ('change', *(label for label, _ in summaries)), tuple(rows),
                 ('0: right in the first frame set that shows the change; never: not before the '
                  'next event.',))


def _text(value: float | None, decimals: int) -> str | None:
    """Return a number with so many decimals, None for None."""
    return None if value is None else f'{value:.{decimals}f}'
