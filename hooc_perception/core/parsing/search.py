# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The joint search of stage 4: choose, refine, propose again, until nothing improves."""

from hooc_perception.core.energy.joint import JointEnergy
from hooc_perception.core.energy.local_search import local_search
from hooc_perception.core.frame.evidence import hypotheses_of, PixelWeights
from hooc_perception.core.frame.workspace import workspace_of
from hooc_perception.core.hypotheses.merge import merged_pairs
from hooc_perception.core.hypotheses.propose import candidates_of
from hooc_perception.core.symmetry import half_turns
from hooc_perception.core.types import Candidates
import numpy as np


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
        if not found.converged or late():
            break
        state.merged(config.polish_steps, rng)
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
                hypotheses_of(new, self.models), new.category, weights_of(self.config), lists=True)
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
        return self.evidence.polish(hypotheses, category, me, context, weights_of(c), c.complexity,
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


def weights_of(config):
    """Return the PixelWeights of a ParseConfig."""
    return PixelWeights(config.tolerance_m, config.normal_weight, config.category_weight,
                        config.free_weight)
