# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The genetic algorithm of Basevi & Leonardis 2016, section 4, over subsets of n items.

It knows nothing of scenes: `ask()` gives a population of subsets, `tell(energies)` takes their
energies, the smaller the better. In each iteration the best 20 % survive, 20 % are drawn from all
with probability proportional to 1 / E, 10 % are new, and 50 % are children: two parents by
roulette (1 / E), three-point crossover, then mutation: each item joins or leaves with a
probability that falls with the iterations. The best subset ever seen is the answer.

The paper gives neither the number of iterations nor the schedule of the mutation: both are
parameters here, the schedule geometric from `mutation_start` to `mutation_end`.
"""

from collections.abc import Callable
from dataclasses import dataclass

from hooc_perception.core.arrays import AnyArray, BoolArray
from hooc_perception.core.config import Config, param
import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class GeneticConfig(Config):
    """Parameters of the genetic search; (paper) = the value is published, (ours) = it is not."""

    population: int = param(100, 'Number of subsets per iteration (paper).', low=4)
    start_size: float = param(10.0, 'Mean number of members of a random subset (paper).', low=0.0)
    elite: float = param(0.2, 'Share of the best subsets that survive (paper).',
                         low=0.0, high=1.0)
    drawn: float = param(0.2, 'Share drawn with probability proportional to 1 / E (paper).',
                         low=0.0, high=1.0)
    new: float = param(0.1, 'Share of new random subsets (paper).', low=0.0, high=1.0)
    cuts: int = param(3, 'Number of crossover points (paper).', low=1)
    mutation_start: float = param(
        0.05, 'Probability that a candidate flips in the first iteration; about 6 of 115 (ours).',
        low=0.0, high=1.0)
    mutation_end: float = param(
        0.002, 'Probability that a candidate flips in the last iteration; about one flip in four '
        'children of 115 (ours).', low=0.0, high=1.0)
    iterations: int = param(
        300, 'Number of iterations; a few seconds at 115 candidates, beyond which more '
        'iterations of the same schedule gain little (ours).', low=1)


class GeneticSearch:
    """
    Ask for a population, tell its energies, until `finished`.

    :param n: number of items to choose from.
    :param group: (n,) integers, group of each item.
    :param max_per_group: surplus members of a group are removed at random before a subset is
        evaluated; 0 = no limit, as in the paper (whose energy alone keeps two poses of one
        category apart).
    """

    def __init__(self, n: int, rng: np.random.Generator, config: GeneticConfig = GeneticConfig(),
                 group: AnyArray | None = None, max_per_group: int = 0) -> None:
        """Draw the first population."""
        self.n, self.config, self._rng = n, config, rng
        self._group = np.zeros(n, np.int64) if group is None else np.asarray(group)
        self._max_per_group = max_per_group
        self.iteration = 0
        self.best_mask: BoolArray = np.zeros(n, bool)
        self.best_energy = float(np.inf)
        self._population = self._random(config.population)

    @property
    def finished(self) -> bool:
        """Return whether all iterations are done."""
        return self.iteration >= self.config.iterations

    @property
    def mutation(self) -> float:
        """Return the probability of a flip in the current iteration."""
        c = self.config
        done = self.iteration / max(c.iterations - 1, 1)
        low = max(c.mutation_end, 1e-12)
        return max(c.mutation_start, low) * (low / max(c.mutation_start, low)) ** done

    def ask(self) -> BoolArray:
        """Return (population, n) bool, the subsets to evaluate."""
        return self._population.copy()

    def tell(self, energies: ArrayLike) -> None:
        """Take the (population,) energies of what `ask` returned and breed the next."""
        energies = np.asarray(energies, np.float64)
        order = np.argsort(energies, kind='stable')
        if energies[order[0]] < self.best_energy:
            self.best_energy = float(energies[order[0]])
            self.best_mask = self._population[order[0]].copy()
        c, rng = self.config, self._rng
        fitness = 1.0 / np.maximum(energies, 1e-12)
        fitness /= fitness.sum()
        n_elite, n_drawn, n_new = (round(share * c.population)
                                   for share in (c.elite, c.drawn, c.new))
        n_children = c.population - n_elite - n_drawn - n_new
        drawn = rng.choice(c.population, n_drawn, replace=False, p=fitness)
        children = np.zeros((max(n_children, 0), self.n), bool)
        for child in children:
            a, b = rng.choice(c.population, 2, replace=False, p=fitness)
            child[:] = self._crossover(self._population[a], self._population[b])
        children ^= rng.random(children.shape) < self.mutation
        self._population = np.concatenate([
            self._population[order[:n_elite]], self._population[drawn], self._random(n_new),
            self._repaired(children)])[:c.population]
        self.iteration += 1

    def _random(self, count: int) -> BoolArray:
        """Return (count, n) random subsets of `start_size` members on average."""
        share = min(1.0, self.config.start_size / max(self.n, 1))
        return self._repaired(self._rng.random((count, self.n)) < share)

    def _crossover(self, a: BoolArray, b: BoolArray) -> BoolArray:
        """Return the child of two parents (n,) that switches parents at each random cut."""
        cuts = min(self.config.cuts, max(self.n - 1, 0))
        at = self._rng.choice(np.arange(1, self.n), cuts, replace=False) if cuts else []
        turns = np.zeros(self.n, np.int64)
        turns[at] = 1
        return np.where(np.cumsum(turns) % 2 == 0, a, b)

    def _repaired(self, subsets: BoolArray) -> BoolArray:
        """Remove surplus members of groups at random, in place; return the subsets."""
        if self._max_per_group:
            for subset in subsets:
                members = self._rng.permutation(np.flatnonzero(subset))
                for g in np.unique(self._group[members]):
                    same = members[self._group[members] == g]
                    subset[same[self._max_per_group:]] = False
        return subsets


def genetic_search(n: int, energy: Callable[[BoolArray], float], rng: np.random.Generator,
                   config: GeneticConfig = GeneticConfig(), group: AnyArray | None = None,
                   max_per_group: int = 0, stop: Callable[[], bool] | None = None,
                   ) -> tuple[BoolArray, float, bool]:
    """
    Minimise `energy` over the subsets of n items with the paper's genetic algorithm.

    :param energy: (n,) bool -> energy; called once per distinct subset.
    :param group, max_per_group: as in GeneticSearch.
    :param stop: returns True when time is up; called after each iteration.
    :return: (mask (n,) bool, energy, converged: False where `stop` ended it).
    """
    search = GeneticSearch(n, rng, config, group, max_per_group)
    known: dict[bytes, float] = {}
    while not search.finished:
        energies = []
        for subset in search.ask():
            key = np.packbits(subset).tobytes()
            if key not in known:
                known[key] = energy(subset)
            energies.append(known[key])
        search.tell(energies)
        if stop is not None and stop() and not search.finished:
            return search.best_mask, search.best_energy, False
    return search.best_mask, search.best_energy, True
