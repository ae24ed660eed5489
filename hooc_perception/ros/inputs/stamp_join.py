# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The join of what stages publish for one stamp."""

from collections import Counter, OrderedDict
from collections.abc import Iterable
from typing import Any


class StampJoin:
    """
    Bring together the parts that several topics carry for one stamp.

    :ivar drops: how often each (missing part, reason) was the end of a stamp.
    """

    def __init__(self, parts: Iterable[str], capacity: int = 16) -> None:
        """
        Begin without any part.

        :param parts: names of all parts of a whole.
        :param capacity: how many stamps may wait; the oldest makes room.
        """
        self.parts, self.capacity = frozenset(parts), capacity
        self.drops: Counter[tuple[str, str]] = Counter()
        self._waiting: OrderedDict[int, dict[str, Any]] = OrderedDict()

    def add(self, part: str, stamp_ns: int, value: Any) -> dict[str, Any] | None:
        """
        Take in one part; return {part: value} once the stamp is whole, else None.

        When a stamp is whole, earlier arrivals that still wait can only be older news and are
        dropped as `incomplete`, under the name of a part that they lack; so is the first to
        arrive if more than `capacity` wait.
        """
        have = self._waiting.setdefault(stamp_ns, {})
        have[part] = value
        if self.parts <= have.keys():
            for stamp in list(self._waiting):
                if stamp == stamp_ns:
                    break
                self._drop(stamp)
            return self._waiting.pop(stamp_ns)
        while len(self._waiting) > self.capacity:
            self._drop(next(iter(self._waiting)))
        return None

    def clear(self) -> None:
        """Forget everything that waits."""
        self._waiting.clear()

    def _drop(self, stamp: int) -> None:
        have = self._waiting.pop(stamp)
        self.drops[min(self.parts - have.keys()), 'incomplete'] += 1
