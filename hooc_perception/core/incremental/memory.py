# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a scene from one frame set to the next."""

from dataclasses import dataclass, replace

from hooc_perception.core.arrays import BoolArray
from hooc_perception.core.incremental.changes import (
    changed_share,
    changes,
    comparable,
    FEWEST_PX,
    unseen,
)
from hooc_perception.core.incremental.watch import seen_so_far, Watched
from hooc_perception.core.segment.config import AccumulateConfig
from hooc_perception.core.segment.table import Table
from hooc_perception.core.types import Observation, ParsedScene


@dataclass(frozen=True, eq=False)
class Memory:
    """
    What a stage remembers of the frame sets before.

    :ivar seen: the Observation that the last answer is based on; where something was hidden, as
        it was seen before that, and `hidden` where it has never been seen.
    :ivar pending: per view (H, W) bool, what has changed since it was last looked at on
        accumulated readings.
    :ivar latest: the Observation of the last frame set, as it came.
    """

    seen: Observation
    pending: tuple[BoolArray, ...]
    latest: Observation

    @staticmethod
    def first(observation: Observation) -> 'Memory':
        """Return what is known after the first frame set: everything is new."""
        return Memory(observation, tuple(view.foreground for view in observation.views),
                      observation)


@dataclass(frozen=True, eq=False)
class Past:
    """
    What a whole chain in one process remembers of the frame sets before.

    :ivar watched: of stage 1.
    :ivar table: where the table was.
    :ivar memory: of what the answer is based on.
    :ivar parsed: the answer, in the table frame.
    """

    watched: Watched
    table: Table
    memory: Memory
    parsed: ParsedScene


@dataclass(frozen=True, eq=False)
class Step:
    """
    What a frame set asks for, beside the last one.

    :ivar memory: for the next frame set.
    :ivar full: whether everything must be decided anew.
    :ivar region: per view (H, W) bool, what must be decided anew; None = nothing.
    :ivar settled: whether `region` has stood still for long enough to be looked at again.
    """

    memory: Memory
    full: bool = False
    region: tuple[BoolArray, ...] | None = None
    settled: bool = False


def next_step(memory: Memory | None, observation: Observation,
              config: AccumulateConfig = AccumulateConfig()) -> Step:
    """
    Return what a frame set asks for.

    :param memory: None before the first frame set.
    :param observation: the same object as that of the last frame set where nothing has changed,
        see `watch`.
    """
    if memory is None or not comparable(memory.seen, observation):
        return Step(Memory.first(observation), full=True)
    if observation is memory.latest:
        return Step(memory)
    masks = _news(memory.seen, observation)
    if changed_share(memory.seen, observation, masks) > config.full_share:
        return Step(Memory.first(observation), full=True)
    seen = seen_so_far(memory.seen, observation)
    if sum(int(mask.sum()) for mask in masks) >= FEWEST_PX:
        pending = tuple(a | b for a, b in zip(memory.pending, masks))
        return Step(Memory(seen, pending, observation), region=masks)
    hidden = [unseen(view) for view in observation.views]
    region = tuple(mask & ~away for mask, away in zip(memory.pending, hidden))
    accumulates = config.accumulate_frames > 1 and config.settle_frames > 0
    if not accumulates or not any(mask.any() for mask in region):
        return Step(replace(memory, latest=observation))
    # What is hidden now is looked at later.
    settled = Memory(seen, tuple(mask & away for mask, away in zip(memory.pending, hidden)),
                     observation)
    if changed_share(memory.seen, observation, region) > config.full_share and not any(
            away.any() for away in hidden):
        return Step(settled, full=True)
    return Step(settled, region=region, settled=True)


def _news(before: Observation, now: Observation) -> tuple[BoolArray, ...]:
    """Return, per view, the foreground (H, W) that has changed or is seen for the first time."""
    return tuple(mask | (unseen(a) & ~unseen(b) & b.foreground) for mask, a, b in zip(
        changes(before, now), before.views, now.views))
