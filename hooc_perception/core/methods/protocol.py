# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What a method has to offer: candidates of a frame, and the objects among them."""

from collections.abc import Sequence
import time
from typing import Protocol

from hooc_perception.core.arrays import BoolArray
from hooc_perception.core.frame.costs import ObjectCosts, PixelCosts
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.types import Candidates, ParsedScene


class Method(Protocol):
    """
    Stages 3 and 4 of the chain.

    Both draw their random numbers from `stage_rng(seed, stage)`: processes that run one stage
    each agree with one process that runs both, to the bit.
    """

    @property
    def pixels(self) -> PixelCosts:
        """Return the pixel costs by which evidence and uncertainty are measured."""
        ...

    @property
    def objects(self) -> ObjectCosts:
        """Return the object costs by which uncertainty is measured."""
        ...

    def propose(self, frame: Frame, seed: int) -> Candidates:
        """Return candidates of every category, the best of each first."""
        ...

    def parse(self, frame: Frame, pool: Candidates, seed: int, max_instances: int = 0,
              ) -> ParsedScene:
        """
        Return the objects that together explain the frame best.

        :param max_instances: most objects per category, 0 = no limit.
        """
        ...

    def revise(self, frame: Frame, before: ParsedScene, region: Sequence[BoolArray], seed: int,
               max_instances: int = 0, settled: bool = False,
               extra: Candidates = Candidates.empty()) -> ParsedScene:
        """
        Return the objects of a frame set that follows one whose answer is known, calibrated.

        :param before: the answer, in the table frame.
        :param region: per view (H, W) bool, what is decided anew.
        :param settled: the region stands still: an object of `before` is replaced only by one
            that is better by a margin.
        :param extra: further candidates.
        """
        ...

    def calibrate(self, frame: Frame, parsed: ParsedScene) -> ParsedScene:
        """Return the same objects with scores that are probabilities, where the method can."""
        ...

    def open_world(self, frame: Frame, parsed: ParsedScene, strangers: bool) -> ParsedScene:
        """
        Return the scene with things of no category, where the method can tell them.

        :param strangers: whether the classifier was trained among things of no category.
        """
        ...


class Deadline:
    """
    Tells when the time of a parse is up.

    :param seconds: after which `passed()` is true; 0 = never.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds, self._start = seconds, time.monotonic()

    @property
    def elapsed(self) -> float:
        """Return the seconds since the start."""
        return time.monotonic() - self._start

    def passed(self) -> bool:
        """Return whether the time is up."""
        return 0 < self._seconds < self.elapsed
