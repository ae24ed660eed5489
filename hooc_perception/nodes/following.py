# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How the answer of the parsing node follows the frame sets."""

from collections.abc import Callable
from dataclasses import dataclass
import time

from hooc_perception.core.config import Config, param
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.incremental.memory import Memory
from hooc_perception.core.types import Candidates, Observation, ParsedScene
from hooc_perception.parser import Parser


@dataclass(frozen=True)
class FollowConfig(Config):
    """When everything is decided anew, though little has changed."""

    full_every_s: float = param(
        60.0, 'While nothing changes, everything is decided anew after this time; the answer is '
        'replaced by what is clearly better. 0 = never. Without effect where incremental is '
        'false.', 's', 0.0, 86400.0, runtime=True)
    detect_full: bool = param(
        False, 'A call of detect has everything decided anew, as after full_every_s.',
        runtime=True)


class Following:
    """The last answer, and what it is based on."""

    def __init__(self) -> None:
        """Begin without any."""
        self._memory: Memory | None = None
        self._answer: ParsedScene | None = None
        self._parser: Parser | None = None
        self._full_at = 0.0     # monotonic seconds of the last full parse

    def forget(self) -> None:
        """Decide the next frame set by itself."""
        self._memory = self._answer = None

    def update(self, parser: Parser, observation: Observation, frame: Callable[[], Frame],
               pool: Callable[[Frame], Candidates], seed: int, full_every_s: float,
               full: bool = False) -> ParsedScene:
        """
        Return the answer to the next frame set, in the table frame.

        :param frame, pool: see `Parser.follow`.
        :param full: decide everything anew.
        """
        if parser is not self._parser:
            self.forget()
        self._parser = parser
        step = parser.step(self._memory, observation)
        now = time.monotonic()
        if step.region is None and full_every_s and now - self._full_at >= full_every_s:
            full = True
        parsed = parser.follow(step, self._answer, frame, pool, seed, full)
        if full or step.full:
            self._full_at = time.monotonic()
        self._memory, self._answer = step.memory, parsed
        return parsed
