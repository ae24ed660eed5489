# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 4: which of the candidates stand there.

`genetic` is the paper's search of Eq. 1; `joint` alternates a discrete search with continuous
refinement of what it chose and with new proposals where depth stays unexplained.
"""

from dataclasses import dataclass, replace
import time

from hooc_perception.core.config import param
from hooc_perception.core.eq1 import energy_of, Eq1
from hooc_perception.core.evidence import hypotheses_of, PixelWeights
from hooc_perception.core.genetic import genetic_search, GeneticConfig
from hooc_perception.core.joint import JointEnergy
from hooc_perception.core.kernels import explain as stat
from hooc_perception.core.local_search import local_search, LocalSearchConfig
from hooc_perception.core.merge import merged_pairs
from hooc_perception.core.propose import candidates_of
from hooc_perception.core.symmetry import half_turns
from hooc_perception.core.types import Candidates, ParsedScene
from hooc_perception.core.verify import features
from hooc_perception.core.workspace import workspace_of
import numpy as np


@dataclass(frozen=True)
class ParseConfig(LocalSearchConfig, GeneticConfig):
    """Parameters of stage 4; GeneticConfig serves `genetic`, LocalSearchConfig `joint`."""

    search: str = param('joint', 'how the subset is found', choices=('joint', 'genetic'))
    patience: int = param(8, 'kicks in a row without a gain after which the search has '
                          'converged', low=0)
    kept: int = param(12, 'joint: candidates a category, beside the chosen, that go on to the next '
                      'round', low=1)
    finalists: int = param(8, 'joint: candidates a category, beside the chosen, that are looked '
                           'at in full resolution', low=1)
    rounds: int = param(2, 'joint: rounds of refinement and re-proposal', low=0)
    polish_steps: int = param(20, 'joint: steps of refinement of a chosen object', low=0)
    turn_steps: int = param(10, 'joint: steps of refinement of a chosen object after half a turn '
                            'about each of its axes; 0 = no such turns', low=0)
    tolerance_m: float = param(0.03, 'joint: depth residual as bad as no explanation', 'm',
                               0.002, 0.5)
    normal_weight: float = param(0.4, 'joint: cost of a perpendicular normal', '', 0.0, 2.0)
    category_weight: float = param(0.4, 'joint: cost of a category that the classifier rules out',
                                   '', 0.0, 4.0)
    free_weight: float = param(0.7, 'joint: cost of hiding what was measured farther away', '',
                               0.0, 2.0)
    complexity: float = param(0.1, 'joint: cost of a covered pixel', '', 0.0, 2.0)
    size_prior: float = param(0.05, 'joint: cost of squared log scale a covered pixel', '', 0, 2.0)
    base_cost: float = param(40.0, 'joint: cost of an object that no verifier has judged', 'px',
                             0.0, 1000.0)
    verify_weight: float = param(80.0, 'joint: worth of the odds that the verifier gives a '
                                 'candidate, each unit of their logarithm; 0 = the energy '
                                 'decides alone', 'px', 0.0, 1000.0)
    missing_against_false: float = param(2.0, 'joint: how much worse it is to miss an object than '
                                         'to report a false one', '', 0.01, 100.0)
    least_cost: float = param(40.0, 'joint: what an object costs at least, however probable, '
                              'where a category may stand there more than once', 'px', 0.0, 1e4)
    overlap: float = param(300.0, 'joint: cost of an object inside others', 'px', 0.0, 1e5)
    deadline_s: float = param(0.0, 'joint: seconds after which the best so far is the answer, '
                              '0 = none', 's', 0.0, 3600.0, runtime=True)


def parse(observation, probabilities, pool, models, config=ParseConfig(), rng=None,
          max_instances=0, more=None, verifier=None):
    """
    Return the ParsedScene: the objects that together explain the frame set best.

    :param pool: Candidates.
    :param max_instances: most objects of one category, 0 = no limit.
    :param more: callable (objects: Candidates, round: int) -> Candidates that proposes anew for
        what the objects leave unexplained; None = the pool is all there is.
    :param verifier: core.verify.Verifier of the model, None = the energy decides alone.
    """
    start = time.monotonic()

    def late():
        return 0 < config.deadline_s < time.monotonic() - start

    if config.search == 'genetic':
        scene = _genetic(observation, probabilities, pool, models, config, rng, max_instances,
                         late)
    else:
        scene = _joint(observation, probabilities, pool, models, config, rng, max_instances,
                       more, late, verifier)
    return scene.timed(parse=time.monotonic() - start)


def _genetic(observation, probabilities, pool, models, config, rng, max_instances, late):
    """Search Eq. 1 as in the paper."""
    energy = Eq1(observation, probabilities, pool, models)
    mask, _, converged = genetic_search(len(pool), energy.evaluate, rng, config, pool.category,
                                        max_instances, late)
    energy.reset(mask)
    return _answer(observation, probabilities, models, pool, mask, energy.deltas()[mask],
                   energy.energy(mask), converged, config)


def _joint(observation, probabilities, pool, models, config, rng, max_instances, more, late,
           verifier):
    """Search the scene, ask the verifier what it thinks of the candidates, and decide."""
    state, found, considered = search_scene(observation, probabilities, pool, models, config,
                                            rng, max_instances, more, late)
    score = None
    if verifier is not None and config.verify_weight and len(state.pool):
        score = verifier.probability(features(state.evidence, state.pool, state.stats,
                                              state.lists, models, state.weighed()))
        found = state.judged(score).search(rng, late)
    return _answer(observation, probabilities, models, state.pool, state.mask, state.worth(),
                   None, found.converged and not late(), config, considered, score)


def search_scene(observation, probabilities, pool, models, config, rng, max_instances=0,
                 more=None, late=lambda: False):
    """
    Alternate discrete search, refinement and re-proposal, coarse first and in full at last.

    The rounds look at every second row and column; what is left in the running then is
    refined and decided on all pixels.

    :return: (Search at its optimum, SearchResult, Candidates that were considered before).
    """
    space = workspace_of(observation, probabilities, models)
    state, considered = Search(space.coarse, models, config, max_instances).with_more(pool), pool
    for turn in range(config.rounds + 1):
        found = state.search(rng, late)
        state.merged(config.polish_steps, rng)
        if not found.converged or late():
            break
        last = turn == config.rounds
        new = state.polished(config.turn_steps if last else config.polish_steps, rng, last)
        if more is not None and not last and not late():
            new = new.extended(more(state.pool.take(state.mask), turn + 1))
        considered = considered.extended(new)
        state = state.take(state.in_the_running(config.kept)).with_more(new)
    if found.converged and not late():
        found = state.search(rng, late)
    state = state.on(space.evidence, state.in_the_running(config.finalists))
    if found.converged and not late():
        found = state.with_more(state.polished(config.polish_steps, rng)).search(rng, late)
    return state, found, considered


class Search:
    """A pool with its pixel lists on one resolution, and the subset chosen so far."""

    def __init__(self, evidence, models, config, max_instances):
        self.evidence, self.models, self.config = evidence, models, config
        self.max_instances = max_instances
        self.pool, self.mask, self.odds = Candidates.empty(), np.zeros(0, bool), None
        self.stats = self.lists = self.energy = None

    def with_more(self, new):
        """Take further Candidates into the pool; return self."""
        if len(new) or self.lists is None:
            stats, lists = self.evidence.explain(
                hypotheses_of(new, self.models), new.category, _weights(self.config), lists=True)
            first = self.lists is None
            self.stats = stats if first else np.concatenate([self.stats, stats])
            self.lists = lists if first else self.lists.extended(lists)
            self.pool = self.pool.extended(new)
            self.mask = np.concatenate([self.mask, np.zeros(len(new), bool)])
        return self

    def search(self, rng, late):
        """Search from the current subset; return the SearchResult."""
        self._weigh()
        found = local_search(self.energy, rng, self.config, late)
        self.mask = found.mask
        return found

    def polished(self, steps, rng, turned=False):
        """
        Return refined copies of the chosen; both stay, the search decides which fit.

        :param turned: start them half a turn away, about each axis where that is visible: no
            step of a refinement is so long.
        """
        chosen = np.flatnonzero(self.mask)
        start, context = self.pool.take(chosen), self.evidence.compose(chosen, self.lists)
        if turned:
            start, row = half_turns(start, self.models)
            chosen = chosen[row]
        if not len(chosen) or not steps:
            return Candidates.empty()
        H = self._refined(hypotheses_of(start, self.models), start.category, chosen, context,
                          steps, rng)
        return candidates_of(H, start.category, start.score, self.models)

    def merged(self, steps, rng):
        """Let one object take the place of two of its kind where that costs less; return self."""
        chosen = np.flatnonzero(self.mask)
        start, pairs = merged_pairs(self.pool.take(chosen), self.models)
        if not len(start) or not steps:
            return self
        H = hypotheses_of(start, self.models)
        for k, pair in enumerate(chosen[pairs]):
            others = self.evidence.compose(np.setdiff1d(chosen, pair), self.lists)
            H[k] = self._refined(H[k:k + 1], start.category[k:k + 1], [-1], others, steps, rng)[0]
        first = len(self.pool)
        self.with_more(candidates_of(H, start.category, start.score, self.models))
        energy = self.weighed()
        for k, pair in enumerate(chosen[pairs]):
            mask = self.mask.copy()
            mask[pair], mask[first + k] = False, True
            if self.mask[pair].all() and energy.evaluate(mask) < energy.value:
                self.mask = mask
                energy.reset(mask)
        return self

    def _refined(self, hypotheses, category, me, context, steps, rng):
        """Return hypotheses (m, 10), each refined in its context; see Evidence.polish."""
        c = self.config
        return self.evidence.polish(hypotheses, category, me, context, _weights(c), c.complexity,
                                    c.size_prior, steps, (0.005, 0.06, 0.04), rng)

    def in_the_running(self, most):
        """Return (n,) bool: the chosen and the `most` a category that would cost least to add."""
        keep = self.mask.copy()
        costs = self.energy.joining_costs()
        for c in np.unique(self.pool.category):
            mine = np.flatnonzero((self.pool.category == c) & ~self.mask)
            keep[mine[np.argsort(costs[mine], kind='stable')[:most]]] = True
        return keep

    def take(self, rows):
        """Return the same search with only some rows (n,) bool."""
        other = Search(self.evidence, self.models, self.config, self.max_instances)
        other.pool, other.mask, other.stats = (
            self.pool.take(rows), self.mask[rows], self.stats[rows])
        other.lists = self.lists.take(np.flatnonzero(rows))
        return other

    def on(self, evidence, rows):
        """Return the same search on another resolution, with only some rows (n,) bool."""
        other = Search(evidence, self.models, self.config, self.max_instances)
        other.with_more(self.pool.take(rows))
        other.mask = self.mask[rows]
        return other

    def judged(self, probability):
        """Let the odds of each candidate (n,) weigh in its cost; return self."""
        p = np.clip(probability, 0.02, 0.98)
        c = self.config
        self.odds = -c.verify_weight * (np.log(p / (1 - p)) + np.log(c.missing_against_false))
        if self.max_instances != 1:
            # Two candidates for one thing are both probable; a limit of one would choose.
            self.odds = np.maximum(self.odds, c.least_cost)
        return self

    def weighed(self):
        """Return the JointEnergy of the pool as it is, at the current subset."""
        if self.energy is None or self.energy.n != len(self.pool):
            self._weigh()
        return self.energy

    def worth(self):
        """Return (chosen,) how much the energy rises if an object is removed, in pixels."""
        return self.weighed().deltas()[self.mask]

    def _weigh(self):
        """Set up the energy of the pool as it is now, at the current subset."""
        self.energy = JointEnergy(self.evidence, self.pool, self.stats, self.lists, self.models,
                                  self.config, self.max_instances, self.odds)
        self.energy.reset(self.mask)


def _answer(observation, probabilities, models, pool, mask, worth, energy, converged, config,
            considered=None, probability=None):
    """Return the ParsedScene of a subset with its evidence."""
    objects = pool.take(mask)
    pool = pool if considered is None else considered
    if energy is None:
        energy = energy_of(observation, probabilities, objects, models)
    n = len(objects)
    if not n:
        none = np.zeros(0, np.float32)
        return ParsedScene(objects, energy, none, none, none, np.zeros(0, np.uint8), pool,
                           converged)
    evidence = workspace_of(observation, probabilities, models).evidence
    H = hypotheses_of(objects, models)
    _, lists = evidence.explain(H, objects.category, _weights(config), lists=True)
    context = evidence.compose(np.arange(n), lists)
    stats = evidence.explain(H, objects.category, _weights(config), context, me=np.arange(n))
    alone = np.maximum(stats[:, stat.SHOWN], 1)
    seen = alone - stats[:, stat.BEHIND]
    agree = stats[:, stat.AGREE]
    share = agree / np.maximum(agree + stats[:, stat.VIOLATE] + 20, 1)
    if probability is not None:
        share = probability[mask]
    objects = replace(objects, score=np.clip(share, 0, 1).astype(np.float32))
    return ParsedScene(objects, energy, (seen / alone).astype(np.float32),
                       (stats[:, stat.RESIDUAL] / np.maximum(agree, 1)).astype(np.float32),
                       np.asarray(worth, np.float32), stats[:, stat.VIEWS].astype(np.uint8), pool,
                       converged)


def _weights(config):
    """Return the PixelWeights of a ParseConfig."""
    return PixelWeights(config.tolerance_m, config.normal_weight, config.category_weight,
                        config.free_weight)
