# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a scene from one frame set to the next."""

from dataclasses import dataclass, replace

from hooc_perception.core.arrays import BoolArray
from hooc_perception.core.incremental.changes import changed_share, changes, comparable
from hooc_perception.core.incremental.watch import seen_so_far, Watched
from hooc_perception.core.segment.table import Table
from hooc_perception.core.types import Observation, ParsedScene

# Changes of fewer pixels, over all views, are noise.
FEWEST_PX = 30


@dataclass(frozen=True, eq=False)
class Memory:
    """
    What a stage remembers of the frame sets before.

    :ivar seen: the Observation that the last answer is based on; where something was hidden, as
        it was seen before that.
    :ivar pending: per view (H, W) bool, what has changed since it was last looked at on
        accumulated readings.
    :ivar calm: how many frame sets in a row have shown no change.
    """

    seen: Observation
    pending: tuple[BoolArray, ...]
    calm: int = 0

    @staticmethod
    def first(observation: Observation) -> 'Memory':
        """Return what is known after the first frame set: everything is new."""
        return Memory(observation, tuple(view.foreground for view in observation.views))


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


def next_step(memory: Memory | None, observation: Observation, full_share: float,
              settle_frames: int) -> Step:
    """
    Return what a frame set asks for.

    :param memory: None before the first frame set.
    :param full_share: share of the foreground that must have changed for a full parse.
    :param settle_frames: frame sets without change after which changes are looked at again; 0 =
        never.
    """
    if memory is None or not comparable(memory.seen, observation):
        return Step(Memory.first(observation), full=True)
    masks = changes(memory.seen, observation)
    if changed_share(memory.seen, observation, masks) > full_share:
        return Step(Memory.first(observation), full=True)
    if sum(int(mask.sum()) for mask in masks) >= FEWEST_PX:
        pending = tuple(a | b for a, b in zip(memory.pending, masks))
        return Step(Memory(seen_so_far(memory.seen, observation), pending), region=masks)
    calm = memory.calm + 1
    if calm != settle_frames or not any(mask.any() for mask in memory.pending):
        return Step(replace(memory, calm=calm))
    settled = Memory(seen_so_far(memory.seen, observation),
                     tuple(mask & False for mask in memory.pending), calm)
    if changed_share(memory.seen, observation, memory.pending) > full_share:
        return Step(settled, full=True)
    return Step(settled, region=memory.pending, settled=True)
