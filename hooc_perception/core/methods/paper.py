# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The method of Basevi & Leonardis (2016), step by step: section 4 of the paper."""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import BoolArray
from hooc_perception.core.config import Config, group, param
from hooc_perception.core.energy.eq1 import Eq1
from hooc_perception.core.frame.costs import ObjectCosts, PixelCosts
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.methods.fragments import FragmentConfig, propose_fragments
from hooc_perception.core.methods.genetic import genetic_search, GeneticConfig
from hooc_perception.core.methods.protocol import Deadline
from hooc_perception.core.parsing.answer import Choice, parsed_scene
from hooc_perception.core.types import Candidates, ParsedScene


@dataclass(frozen=True)
class PaperParseConfig(Config):
    """
    Parameters of the paper's stage 4.

    :ivar genetic: of the genetic search.
    """

    deadline_s: float = param(0.0, 'Seconds after which the best subset so far is the result; 0 '
                              '= none.', 's', 0.0, 3600.0, runtime=True)
    genetic: GeneticConfig = group(GeneticConfig())


class PaperMethod:
    """
    Candidates from fragments by ICP, the subset of least energy (Eq. 1) by a genetic search.

    :param propose: FragmentConfig of stage 3.
    :param parse: PaperParseConfig of stage 4.
    """

    # The paper has no such costs: these only describe the result, in the units of the others.
    pixels, objects = PixelCosts(unknown_weight=0.0), ObjectCosts()

    def __init__(self, propose: FragmentConfig = FragmentConfig(),
                 parse: PaperParseConfig = PaperParseConfig()) -> None:
        self._propose, self._parse = propose, parse

    def propose(self, frame: Frame, seed: int) -> Candidates:
        """Return at most five candidates per category, see fragments.py."""
        return propose_fragments(frame.observation, frame.probabilities, frame.models,
                                 self._propose, stage_rng(seed, 'propose'))

    def parse(self, frame: Frame, pool: Candidates, seed: int, max_instances: int = 0,
              ) -> ParsedScene:
        """Return the subset of least energy (Eq. 1) that the genetic search finds."""
        deadline = Deadline(self._parse.deadline_s)
        energy = Eq1(frame.observation, frame.probabilities, pool, frame.models)
        mask, _, converged = genetic_search(
            len(pool), energy.evaluate, stage_rng(seed, 'parse'), self._parse.genetic,
            pool.category, max_instances, deadline.passed)
        energy.reset(mask)
        choice = Choice(pool, mask, energy.deltas()[mask], converged, energy=energy.energy(mask))
        return parsed_scene(frame, choice, self.pixels).timed(parse=deadline.elapsed)

    def revise(self, frame: Frame, before: ParsedScene, region: Sequence[BoolArray], seed: int,
               max_instances: int = 0, settled: bool = False,
               extra: Candidates = Candidates.empty()) -> ParsedScene:
        """Return what the frame set shows by itself: the paper knows single frame sets only."""
        return self.parse(frame, self.propose(frame, seed), seed, max_instances)

    def calibrate(self, frame: Frame, parsed: ParsedScene) -> ParsedScene:
        """Return the scene as it is: Eq. 1 is a mean over pixels and tells no probability."""
        return parsed

    def open_world(self, frame: Frame, parsed: ParsedScene, strangers: bool) -> ParsedScene:
        """Return the scene as it is: the paper knows no things without a category."""
        return parsed
