# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The joint method: model-driven candidates, one energy for categories, poses and sizes."""

from collections.abc import Sequence
from dataclasses import replace

from hooc_perception.core.arrays import BoolArray
from hooc_perception.core.energy.eq1 import energy_of
from hooc_perception.core.energy.local_search import SearchResult
from hooc_perception.core.frame.costs import ObjectCosts, PixelCosts
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.hypotheses.propose import propose, propose_more, ProposeConfig
from hooc_perception.core.methods.protocol import Deadline
from hooc_perception.core.parsing.answer import Choice, parsed_scene
from hooc_perception.core.parsing.calibration import calibrated_scores
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.parsing.revise import (
    around,
    narrowed,
    search_with,
    with_held,
)
from hooc_perception.core.parsing.search import improved, Search, search_scene
from hooc_perception.core.parsing.unknown import find_unknown
from hooc_perception.core.parsing.verifier import features, Verifier
from hooc_perception.core.types import Candidates, ParsedScene
import numpy as np


class JointMethod:
    """
    Alternates a discrete search with refinement and re-proposal; a verifier has the last word.

    :param propose: ProposeConfig of stage 3.
    :param parse: ParseConfig of stage 4; its pixel costs rank the hypotheses, too.
    :param verifier: of the model; None = the energy decides alone.
    """

    def __init__(self, propose: ProposeConfig = ProposeConfig(),
                 parse: ParseConfig = ParseConfig(), verifier: Verifier | None = None) -> None:
        self._propose, self._parse, self._verifier = propose, parse, verifier

    @property
    def pixels(self) -> PixelCosts:
        """Return the pixel costs of the joint energy."""
        return self._parse.pixels

    @property
    def objects(self) -> ObjectCosts:
        """Return the object costs of the joint energy."""
        return self._parse.objects

    def propose(self, frame: Frame, seed: int) -> Candidates:
        """Return candidates of every category, the best of each first."""
        return propose(frame, self._propose, self.pixels, stage_rng(seed, 'propose'))

    def propose_more(self, frame: Frame, objects: Candidates, turn: int, seed: int) -> Candidates:
        """Return candidates for what `objects` leave unexplained in round `turn`, from 1."""
        return propose_more(frame, objects, self._propose, self.pixels,
                            stage_rng(seed, 'propose', turn))

    def search(self, frame: Frame, pool: Candidates, seed: int, max_instances: int = 0) -> Search:
        """Return the Search at its optimum, as it is before the verifier judges."""
        return self._search(frame, pool, seed, max_instances, Deadline(0),
                            stage_rng(seed, 'parse'))[0]

    def parse(self, frame: Frame, pool: Candidates, seed: int, max_instances: int = 0,
              ) -> ParsedScene:
        """Search the scene, let the verifier judge the candidates, and decide."""
        deadline, rng = Deadline(self._parse.deadline_s), stage_rng(seed, 'parse')
        found = self._search(frame, pool, seed, max_instances, deadline, rng)
        return self._decided(frame, *found, deadline, rng)[0]

    def revise(self, frame: Frame, before: ParsedScene, region: Sequence[BoolArray], seed: int,
               max_instances: int = 0, settled: bool = False,
               extra: Candidates = Candidates.empty()) -> ParsedScene:
        """
        Return the objects of a frame set that follows one whose answer is known.

        Objects that the region does not touch stay as they are, with their score.

        :param before: the answer, in the table frame.
        :param region: per view (H, W) bool, what is decided anew.
        :param settled: the region stands still: an object of `before` is replaced only by one
            that is better by a margin.
        :param extra: further candidates.
        """
        deadline, rng = Deadline(self._parse.deadline_s), stage_rng(seed, 'parse')
        config = narrowed(self._parse, frame, region, self._propose.least_effort)
        start = search_with(frame, before, region, config, max_instances)
        wide, held_before = around(region), start.held[:len(before.objects)]

        def more(objects: Candidates, turn: int) -> Candidates:
            return propose_more(frame, objects, self._propose, self.pixels,
                                stage_rng(seed, 'propose', turn), wide)

        start.add(more(start.chosen.take(start.held[start.mask]), 0).extended(extra))
        found = improved(frame, start, config.revise.revise_rounds, rng, more, deadline.passed)
        parsed, search = self._decided(frame, *found, deadline, rng,
                                       self._parse.revise.revise_gain if settled else 0.0)
        return with_held(self.calibrate(frame, parsed), before, search.held[search.mask],
                         held_before)

    def _decided(self, frame: Frame, search: Search, found: SearchResult, considered: Candidates,
                 deadline: Deadline, rng: np.random.Generator, gain: float = 0.0,
                 ) -> tuple[ParsedScene, Search]:
        """Return the ParsedScene after the verifier's judgement, and the Search."""
        probability = None
        if self._verifies and self._verifier is not None and len(search.pool):
            probability = self._verifier.probability(features(search))
            search.weigh_verdict(probability)
        if gain:
            search.favour_kept(gain)
        if probability is not None or gain:
            found = search.run(rng, deadline.passed)
        choice = Choice(search.pool, search.mask, search.marginal_energies(),
                        found.converged and not deadline.passed(), considered, probability)
        return parsed_scene(frame, choice, self.pixels).timed(parse=deadline.elapsed), search

    def calibrate(self, frame: Frame, parsed: ParsedScene) -> ParsedScene:
        """Return the scene with scores from marginal energies, unless the verifier gave them."""
        if self._verifies or not len(parsed.objects):
            return parsed
        score = calibrated_scores(parsed, frame.observation)
        return replace(parsed, objects=replace(parsed.objects, score=score))

    def open_world(self, frame: Frame, parsed: ParsedScene, strangers: bool) -> ParsedScene:
        """
        Return the scene with the things of no category beside its objects.

        Only a model that was trained among strangers can tell them from the rest of an object:
        it rejects unlikely objects and things; otherwise the things have no score.
        """
        config = self._parse.open_world
        if strangers and (parsed.objects.score < config.reject_below).any():
            parsed = parsed.take(parsed.objects.score >= config.reject_below)
            parsed = replace(parsed, energy=energy_of(frame.observation, frame.probabilities,
                                                      parsed.objects, frame.models))
        unknown = find_unknown(frame, parsed.objects)
        if strangers:
            unknown = unknown.take(unknown.score >= config.least_unknown_score)
        else:
            unknown = replace(unknown, score=np.full(len(unknown), np.nan, np.float32))
        return replace(parsed, unknown=unknown)

    def _search(self, frame: Frame, pool: Candidates, seed: int, max_instances: int,
                deadline: Deadline, rng: np.random.Generator,
                ) -> tuple[Search, SearchResult, Candidates]:
        return search_scene(
            frame, pool, self._parse, rng, max_instances,
            lambda objects, turn: self.propose_more(frame, objects, turn, seed), deadline.passed)

    @property
    def _verifies(self) -> bool:
        return self._verifier is not None and self._parse.verdict.verify_weight > 0
