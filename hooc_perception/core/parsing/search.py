# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The joint search of stage 4: choose, refine, propose again, until nothing improves."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.core.energy.joint import JointEnergy
from hooc_perception.core.energy.local_search import HeldEnergy, local_search, SearchResult
from hooc_perception.core.frame.evidence import Evidence, hypotheses_of
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.frame.kernels.records import Context, RefineSettings
from hooc_perception.core.hypotheses.merge import merged_pairs
from hooc_perception.core.hypotheses.propose import candidates_of
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.symmetry import half_turns
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np

# First step lengths of a refinement: metres, radians, log scale.
STEPS = (0.005, 0.06, 0.04)

# (chosen objects, round) -> candidates for what they leave unexplained.
Proposer = Callable[[Candidates, int], Candidates]


def search_scene(frame: Frame, pool: Candidates, config: ParseConfig, rng: np.random.Generator,
                 max_instances: int = 0, more: Proposer | None = None,
                 late: Callable[[], bool] = lambda: False,
                 ) -> tuple['Search', SearchResult, Candidates]:
    """
    Alternate discrete search, refinement and re-proposal, coarse first and in full at last.

    The rounds look at every second row and column; the remaining candidates are then refined
    and decided on all pixels.

    :param max_instances: most objects per category, 0 = no limit.
    :param more: proposes anew; None = the pool is all there is.
    :param late: True once the deadline has passed.
    :return: (Search at its optimum, SearchResult, Candidates that were considered before).
    """
    search = Search(frame.coarse, frame.models, config, max_instances)
    search.add(pool)
    return improved(frame, search, config.rounds, rng, more, late)


def improved(frame: Frame, search: 'Search', rounds: int, rng: np.random.Generator,
             more: Proposer | None = None, late: Callable[[], bool] = lambda: False,
             ) -> tuple['Search', SearchResult, Candidates]:
    """
    Return what `search_scene` returns, from a Search on coarse pixels and its current subset.

    :param rounds: of refinement and re-proposal.
    """
    config, considered = search.config, search.pool
    for turn in range(rounds + 1):
        found = search.run(rng, late)
        if not found.converged or late():
            break
        search.merge_pairs(rng)
        last = turn == rounds
        new = search.refined_copies(config.turn_steps if last else config.polish_steps, rng, last)
        new = new.extended(search.exchanged_members(config.member_steps, rng))
        if more is not None and not last and not late():
            new = new.extended(more(search.chosen, turn + 1))
        considered = considered.extended(new)
        search = search.subset(search.shortlist(config.kept))
        search.add(new)
    if found.converged and not late():
        found = search.run(rng, late)
    search = search.at_resolution(frame.evidence, search.shortlist(config.finalists))
    if found.converged and not late():
        search.add(search.refined_copies(config.polish_steps, rng))
        found = search.run(rng, late)
    return search, found, considered


class Search:
    """
    A pool with its pixel lists at one resolution, and the subset chosen so far.

    :ivar pool: Candidates; `mask` (n,) bool, which of them are chosen.
    :ivar held: (n,) bool, chosen candidates that stay as they are; `kept` (n,) bool, candidates
        that stay in the pool.
    :ivar stats: (n, STATS) of the pool, each candidate alone in the images; `lists` its pixels.
    """

    def __init__(self, evidence: Evidence, models: Sequence[GenericModel], config: ParseConfig,
                 max_instances: int) -> None:
        self.evidence, self.models, self.config = evidence, models, config
        self.max_instances = max_instances
        self.pool, self.mask = Candidates.empty(), np.zeros(0, bool)
        self.held, self.kept = np.zeros(0, bool), np.zeros(0, bool)
        self.stats, self.lists = evidence.compare_pixels(
            hypotheses_of(self.pool, evidence.shapes), evidence.shapes.of(self.pool),
            config.pixels.weights())
        self._penalty: Float64Array | None = None
        self._favour = 0.0
        self._energy: JointEnergy | None = None

    @property
    def chosen(self) -> Candidates:
        """Return the chosen candidates."""
        return self.pool.take(self.mask)

    @property
    def energy(self) -> JointEnergy:
        """Return the JointEnergy of the pool as it is, at the current subset."""
        if self._energy is None or self._energy.n != len(self.pool):
            self._energy = self._build_energy()
        elif not np.array_equal(self._energy.mask, self.mask):
            self._energy.reset(self.mask)
        return self._energy

    def add(self, new: Candidates) -> None:
        """Add Candidates to the pool; none of them is chosen yet."""
        if not len(new):
            return
        shapes = self.evidence.shapes
        H = hypotheses_of(new, shapes)
        stats, lists = self.evidence.compare_pixels(H, shapes.of(new),
                                                    self.config.pixels.weights())
        first = not len(self.pool)
        self.stats = stats if first else np.concatenate([self.stats, stats])
        self.lists = lists if first else self.lists.extended(lists)
        self.pool = self.pool.extended(new)
        none = np.zeros(len(new), bool)
        self.mask, self.held, self.kept = (np.concatenate([rows, none]) for rows in (
            self.mask, self.held, self.kept))

    def start(self, objects: Candidates, held: BoolArray) -> None:
        """
        Add the objects of an earlier answer to the pool, where they stay.

        :param held: (n,) bool, those that are chosen and stay as they are.
        """
        first = len(self.pool)
        self.add(objects)
        self.kept[first:] = True
        self.mask[first:] = self.held[first:] = held

    def run(self, rng: np.random.Generator, late: Callable[[], bool]) -> SearchResult:
        """Search from the current subset, which becomes the best that was found."""
        self.energy.reprice(self._penalty)
        energy = HeldEnergy(self.energy, self.held) if self.held.any() else self.energy
        found = local_search(energy, rng, self.config.search, late)
        self.mask = found.mask
        return found

    def refined_copies(self, steps: int, rng: np.random.Generator, turned: bool = False,
                       ) -> Candidates:
        """
        Return refined copies of the chosen candidates; the search decides between both.

        :param turned: start them half a turn away, about each axis where that is visible: no
            refinement takes such a long step.
        """
        chosen = np.flatnonzero(self.mask & ~self.held)
        start, context = self.pool.take(chosen), self._shown()
        if turned:
            start, row = half_turns(start, self.models)
            chosen = chosen[row]
        if not len(chosen) or not steps:
            return Candidates.empty()
        return self._refined(start, chosen, context, steps, rng)

    def exchanged_members(self, steps: int, rng: np.random.Generator) -> Candidates:
        """Return refined copies of the chosen candidates with each other mesh of their family."""
        chosen = np.flatnonzero(self.mask & ~self.held)
        objects, shapes = self.pool.take(chosen), self.evidence.shapes
        family = shapes.family[shapes.of(objects)]
        rows = np.repeat(np.arange(len(chosen)), family - 1)
        if not len(rows) or not steps:
            return Candidates.empty()
        member = np.concatenate([np.setdiff1d(np.arange(n), [own])
                                 for n, own in zip(family, objects.member)])
        start = replace(objects.take(rows), member=member.astype(np.uint16))
        return self._refined(start, chosen[rows], self._shown(), steps, rng)

    def merge_pairs(self, rng: np.random.Generator) -> None:
        """Replace two chosen objects of one category by one where that costs less."""
        steps, members = self.config.polish_steps, np.flatnonzero(self.mask)
        chosen = np.flatnonzero(self.mask & ~self.held)
        start, pairs = merged_pairs(self.pool.take(chosen), self.models)
        if not len(start) or not steps:
            return
        merged = Candidates.empty()
        for k, pair in enumerate(chosen[pairs]):
            others = self.evidence.compose(np.setdiff1d(members, pair), self.lists)
            merged = merged.extended(self._refined(start.take([k]), [-1], others, steps, rng))
        first = len(self.pool)
        self.add(merged)
        for k, pair in enumerate(chosen[pairs]):
            mask = self.mask.copy()
            mask[pair], mask[first + k] = False, True
            if self.mask[pair].all() and self.energy.evaluate(mask) < self.energy.value:
                self.mask = mask
                self.energy.reset(mask)

    def shortlist(self, most: int) -> BoolArray:
        """Return (n,) bool: chosen and kept ones and, per category, the `most` cheapest to add."""
        keep = self.mask | self.kept
        costs = self.energy.joining_costs()
        for c in np.unique(self.pool.category):
            mine = np.flatnonzero((self.pool.category == c) & ~keep)
            keep[mine[np.argsort(costs[mine], kind='stable')[:most]]] = True
        return keep

    def subset(self, rows: BoolArray) -> 'Search':
        """Return a new search with only some rows (n,) bool of the pool."""
        other = Search(self.evidence, self.models, self.config, self.max_instances)
        other.pool, other.stats = self.pool.take(rows), self.stats[rows]
        other.mask, other.held, other.kept = self.mask[rows], self.held[rows], self.kept[rows]
        other.lists = self.lists.take(np.flatnonzero(rows))
        return other

    def at_resolution(self, evidence: Evidence, rows: BoolArray) -> 'Search':
        """Return a new search on other pixels, with only some rows (n,) bool of the pool."""
        other = Search(evidence, self.models, self.config, self.max_instances)
        other.add(self.pool.take(rows))
        other.mask, other.held, other.kept = self.mask[rows], self.held[rows], self.kept[rows]
        return other

    def weigh_verdict(self, probability: Float64Array) -> None:
        """Let the verifier's probability (n,) of each candidate count in its cost."""
        verdict = self.config.verdict
        p = np.clip(probability, 0.02, 0.98)
        penalty = -verdict.verify_weight * (np.log(p / (1 - p))
                                            + np.log(verdict.missing_against_false))
        if self.max_instances != 1:
            # Two candidates for one object are both probable; a limit of one would choose.
            penalty = np.maximum(penalty, verdict.least_cost)
        self._penalty = penalty

    def favour_kept(self, pixels: float) -> None:
        """Let each candidate that stays in the pool cost so much less in the search, in pixels."""
        penalty = np.full(len(self.pool), self.config.objects.base_cost) \
            if self._penalty is None else self._penalty
        self._penalty, self._favour = penalty - pixels * self.kept, pixels

    def marginal_energies(self) -> Float64Array:
        """
        Return (chosen,) how much the energy rises if an object is removed, in pixels.

        What favours an object does not count: it is no evidence of it.
        """
        favour = self._favour * self.evidence.scale * self.kept[self.mask]
        return self.energy.deltas()[self.mask] - favour

    def _shown(self) -> Context:
        """Return the Context of the chosen candidates."""
        return self.evidence.compose(np.flatnonzero(self.mask), self.lists)

    def _refined(self, start: Candidates, own: Sequence[int] | np.ndarray, context: Context,
                 steps: int, rng: np.random.Generator) -> Candidates:
        """Return `start`, each row refined in its context; see Evidence.refine."""
        costs, shapes = self.config.objects, self.evidence.shapes
        H = self.evidence.refine(
            hypotheses_of(start, shapes), shapes.of(start), self.config.pixels.weights(),
            RefineSettings(costs.complexity, costs.size_prior, steps, *STEPS), rng, context, own)
        return candidates_of(H, shapes.of(start), start.score, shapes)

    def _build_energy(self) -> JointEnergy:
        energy = JointEnergy(self.evidence, self.pool, self.stats, self.lists, self.models,
                             self.config.objects, self.max_instances, self._penalty)
        energy.reset(self.mask)
        return energy
