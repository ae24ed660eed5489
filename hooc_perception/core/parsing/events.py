# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What happened between two results: objects that were put, taken, moved, hidden, seen again."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hooc_perception.core.arrays import Float32Array, Float64Array, UInt32Array
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np

PUT, TAKEN, MOVED, HIDDEN, SEEN = 'put', 'taken', 'moved', 'hidden', 'seen'
# An object that is found elsewhere by more than this was moved; less is noise. [m]
MOVED_M = 0.02


@dataclass(frozen=True)
class Event:
    """
    Something that happened to an object.

    :ivar kind: PUT, TAKEN, MOVED, HIDDEN or SEEN.
    :ivar id: of the object.
    :ivar translation: (3,) float64, where it is now, target frame, metres; where it was, if it
        was taken.
    :ivar before: (3,) float64, where it was, if it was moved.
    """

    kind: str
    id: int
    category: str
    translation: Float64Array
    before: Float64Array | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        entry = {'event': self.kind, 'id': self.id, 'category': self.category,
                 'translation': self.translation.tolist()}
        return entry if self.before is None else {**entry, 'before': self.before.tolist()}


@dataclass
class _Last:
    """An object of the last result."""

    category: str
    translation: Float64Array
    hidden: bool


class EventLog:
    """
    Compare successive results.

    :param models: class id c is models[c - 1].
    """

    def __init__(self, models: Sequence[GenericModel]) -> None:
        self._names = [model.name for model in models]
        self._last: dict[int, _Last] | None = None

    def forget(self) -> None:
        """Forget the last result; nothing is said of the next one."""
        self._last = None

    def update(self, ids: UInt32Array, objects: Candidates,
               hidden_s: Float32Array | None = None) -> list[Event]:
        """
        Return the events that lead to a result; none to the first.

        :param ids: (n,) of the Tracker.
        :param hidden_s: (n,) seconds since each object was last seen, 0 = it is seen now; None =
            all are.
        """
        hidden = np.zeros(len(ids), bool) if hidden_s is None else hidden_s > 0
        now = {int(number): _Last(self._names[int(c) - 1], t.copy(), bool(h))
               for number, c, t, h in zip(ids, objects.category, objects.translation, hidden)}
        last, self._last = self._last, now
        if last is None:
            return []
        events = [Event(TAKEN, n, o.category, o.translation)
                  for n, o in last.items() if n not in now]
        for n, o in now.items():
            before = last.get(n)
            if before is None:
                events.append(Event(PUT, n, o.category, o.translation))
                continue
            if np.linalg.norm(o.translation - before.translation) > MOVED_M:
                events.append(Event(MOVED, n, o.category, o.translation, before.translation))
            if o.hidden != before.hidden:
                events.append(Event(HIDDEN if o.hidden else SEEN, n, o.category, o.translation))
        return events
