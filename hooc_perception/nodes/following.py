# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How the answer of the parsing node follows the frame sets."""

from collections.abc import Callable
from dataclasses import dataclass
import time
from typing import TYPE_CHECKING

from hooc_perception.core.config import Config, param
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.incremental.memory import Memory, Step
from hooc_perception.core.types import Candidates, Observation, ParsedScene, PixelProbabilities
from hooc_perception.errors import HoocError
from hooc_perception.nodes.background import Background
from hooc_perception.parser import Parser

if TYPE_CHECKING:       # the process of a full parse needs no ROS
    from hooc_perception.ros.health.diagnostics import Diagnostics

# A full parse begins when nothing has changed for so long: what is settled soon would end it.
CALM_S = 5.0


@dataclass(frozen=True)
class FollowConfig(Config):
    """When everything is decided anew, though little has changed."""

    full_every_s: float = param(
        60.0, 'While nothing changes, everything is decided anew after this time, in the '
        'background; the answer is replaced by what is clearly better. The process that does it '
        'takes as much memory as the node. 0 = never. Without effect where incremental is '
        'false.', 's', 0.0, 86400.0, runtime=True)
    detect_full: bool = param(
        False, 'A call of detect has everything decided anew, as after full_every_s, and waits '
        'for it.', runtime=True)


@dataclass(frozen=True, eq=False)
class FullParse:
    """
    Decides everything anew on a frame set that stands still, see `Parser.follow`.

    Candidates are proposed here: stage 3 proposes none for such a frame set.
    """

    parser: Parser
    step: Step
    before: ParsedScene
    observation: Observation
    probabilities: PixelProbabilities
    seed: int

    def __call__(self) -> ParsedScene:
        """Return the answer, in the table frame."""
        parser = self.parser
        return parser.follow(self.step, self.before,
                             lambda: parser.frame(self.observation, self.probabilities),
                             lambda seen: parser.propose(seen, self.seed), self.seed, True)


class Following:
    """The last answer, and what it is based on; reports of full parses go to `diagnostics`."""

    def __init__(self, diagnostics: 'Diagnostics') -> None:
        """Begin without any."""
        self._diagnostics = diagnostics
        self._memory: Memory | None = None
        self._answer: ParsedScene | None = None
        self._parser: Parser | None = None
        self._background: Background[ParsedScene] | None = None
        # Monotonic seconds of the last full parse, and of the last change.
        self._full_at = self._changed_at = 0.0

    def forget(self) -> None:
        """Decide the next frame set by itself."""
        self.give_up()
        self._memory = self._answer = None

    def give_up(self) -> None:
        """End the full parse in the background, if there is one."""
        if self._background is not None:
            self._background.discard()
            self._background = None
            self._diagnostics.count('full_parse', 'given_up')

    def update(self, parser: Parser, observation: Observation, frame: Callable[[], Frame],
               pool: Callable[[Frame], Candidates], seed: int, full_every_s: float,
               full: bool = False) -> ParsedScene:
        """
        Return the answer to the next frame set, in the table frame.

        While nothing changes, that is the last answer, or that of a full parse that has ended in
        the background.

        :param frame, pool: see `Parser.follow`.
        :param full: decide everything anew, now.
        """
        if parser is not self._parser:
            self.forget()
        self._parser = parser
        step = parser.step(self._memory, observation)
        if self._answer is not None and step.region is None and not (step.full or full):
            answer = self._calm(parser, step, self._answer, frame, seed, full_every_s)
        else:
            self.give_up()
            answer = parser.follow(step, self._answer, frame, pool, seed, full)
            self._changed_at = time.monotonic()
            if full or step.full:
                self._full_at = self._changed_at
        # Not before there is an answer: a frame set that is refused has not been looked at.
        self._memory, self._answer = step.memory, answer
        return answer

    def _calm(self, parser: Parser, step: Step, answer: ParsedScene, frame: Callable[[], Frame],
              seed: int, full_every_s: float) -> ParsedScene:
        """Return the answer to a frame set without change; begin or end a full parse."""
        now, running = time.monotonic(), self._background
        if running is None:
            if full_every_s and now - self._full_at >= full_every_s and (
                    now - self._changed_at >= min(CALM_S, full_every_s)):
                self._begin(parser, step, answer, frame, seed)
        elif running.is_done:
            self._background = None
            try:
                answer = running.result()
                self._diagnostics.ok('full_parse', seconds=now - self._full_at)
                self._diagnostics.count('full_parse', 'ended')
            except HoocError as error:
                self._failed(str(error))
            self._full_at = now
        return parser.follow(step, answer, frame, lambda _: Candidates.empty(), seed)

    def _begin(self, parser: Parser, step: Step, answer: ParsedScene, frame: Callable[[], Frame],
               seed: int) -> None:
        """Start a full parse in the background."""
        self._full_at = time.monotonic()
        try:
            seen = frame()
            self._background = Background(FullParse(parser, step, answer, seen.observation,
                                                    seen.probabilities, seed))
        except (HoocError, OSError) as error:
            self._failed(f'it cannot begin: {error}')

    def _failed(self, reason: str) -> None:
        self._diagnostics.warn('full_parse', 'failed', 'the answer stays as it was, because '
                               f'everything could not be decided anew: {reason}')
