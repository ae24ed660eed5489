# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc parse --incremental`: the frame sets of a sequence, each after the one before."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
import time
from typing import Any, TYPE_CHECKING, TypeVar

from hooc_perception.errors import HoocError
from hooc_perception.scene import Scene

if TYPE_CHECKING:
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.io.scenes.scene import RecordedScene
    from hooc_perception.io.scenes.sequences import RecordedSequence
    from hooc_perception.parser import Parser

Recorded = TypeVar('Recorded', bound='RecordedScene | BagScene')


def in_time_order(scenes: 'Sequence[Recorded]', sequences: 'Sequence[RecordedSequence]',
                  ) -> 'list[Recorded]':
    """Return scenes sequence by sequence, as they follow in time, then those of none."""
    by_name = {scene.name: scene for scene in scenes}
    names = [name for sequence in sequences for name in sequence.scenes]
    return [*(by_name[name] for name in names),
            *(scene for scene in scenes if scene.name not in names)]


def updates(parser: 'Parser', seed: int, scenes: 'Sequence[RecordedScene | BagScene]',
            read: Iterable[Any], sequences: 'Sequence[RecordedSequence]',
            ) -> Iterator[tuple[Any, float]]:
    """
    Yield, for each scene in order, (dict of the Scene, seconds) or (HoocError, NaN).

    The dict also has ids, events, and the stamp in ns from the start of the sequence.

    A frame set that cannot be parsed is left out of its sequence. Scenes that no sequence names
    are one sequence.

    :param scenes: see `in_time_order`.
    :param read: per scene (DepthViews, anything), or the HoocError that reading gave.
    """
    from hooc_perception.core.parsing.events import EventLog
    from hooc_perception.core.parsing.tracking import Tracker
    from hooc_perception.io.scenes.results import with_ids
    from hooc_perception.io.scenes.sequences import PERIOD_S
    of_scene = {name: sequence for sequence in sequences for name in sequence.scenes}
    for sequence, frame_sets in groupby(zip(scenes, read), lambda one: of_scene.get(one[0].name)):
        period_s = PERIOD_S if sequence is None else sequence.period_s
        tracker, log = Tracker(parser.models), EventLog(parser.models)
        previous: Scene | None = None
        for number, (_, given) in enumerate(frame_sets):
            if isinstance(given, HoocError):
                yield given, float('nan')
                continue
            start = time.monotonic()
            try:
                result = parser.update(given[0], previous, seed)
            except HoocError as error:
                yield error, float('nan')
                continue
            previous, seconds = result, time.monotonic() - start
            stamp_ns = round(number * period_s * 1e9)
            ids, _ = tracker.update(stamp_ns, result.parsed.objects)
            unknown_ids = tracker.update_unknown(stamp_ns, result.parsed.unknown)
            events = log.update(ids, result.parsed.objects, result.parsed.hidden_s)
            yield with_ids(result.to_dict(), ids, unknown_ids) | {
                'stamp_ns': stamp_ns, 'events': [event.to_dict() for event in events]}, seconds
