# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The genetic algorithm against brute force, and its numbers against the paper's."""

from hooc_perception.core.methods.genetic import genetic_search, GeneticConfig, GeneticSearch
import numpy as np
import pytest

SHORT = GeneticConfig(iterations=40, start_size=4.0, mutation_start=.2, mutation_end=.02)


def quadratic(seed, n=10):
    """Return a positive energy over (n,) bool with many local minima."""
    rng = np.random.default_rng(seed)
    Q, c = rng.normal(size=(n, n)), rng.normal(0, 2, n)

    def energy(mask):
        return 100 + mask @ Q @ mask + c @ mask
    return energy


def all_subsets(n):
    return (np.arange(2 ** n)[:, None] >> np.arange(n) & 1).astype(bool)


@pytest.mark.parametrize('seed', range(5))
def test_it_finds_the_optimum_of_small_instances(seed):
    energy = quadratic(seed)
    mask, value, converged = genetic_search(10, energy, np.random.default_rng(0), SHORT)
    assert converged
    assert value == energy(mask)
    assert value == pytest.approx(min(map(energy, all_subsets(10))))


def test_same_seed_same_answer_and_other_seed_other_path():
    def path(seed):
        search = GeneticSearch(30, np.random.default_rng(seed), SHORT)
        energy, seen = quadratic(0, 30), []
        for _ in range(5):
            seen.append(search.ask())
            search.tell([energy(s) for s in seen[-1]])
        return np.array(seen)

    assert np.array_equal(path(1), path(1))
    assert not np.array_equal(path(1), path(2))


def test_the_first_population_is_the_papers():
    population = GeneticSearch(115, np.random.default_rng(0)).ask()
    assert population.shape == (100, 115)
    assert population.sum(1).mean() == pytest.approx(10, abs=1)


def test_the_next_population_keeps_the_best_fifth_and_draws_another_from_the_rest():
    search = GeneticSearch(115, np.random.default_rng(0))
    old = search.ask()
    search.tell(1.0 + np.arange(100))
    new = search.ask()
    assert new.shape == (100, 115)
    assert np.array_equal(new[:20], old[:20])
    known = {s.tobytes() for s in old}
    assert all(s.tobytes() in known for s in new[20:40])
    assert not any(s.tobytes() in known for s in new[40:])
    assert new[40:50].sum(1).mean() == pytest.approx(10, abs=3)


def test_better_subsets_are_drawn_more_often_by_one_over_the_energy():
    counts = np.zeros(100)
    for seed in range(200):
        search = GeneticSearch(40, np.random.default_rng(seed))
        rows = {s.tobytes(): i for i, s in enumerate(search.ask())}
        search.tell(np.where(np.arange(100) < 50, 1.0, 3.0))
        for s in search.ask()[20:40]:
            counts[rows[s.tobytes()]] += 1
    # Drawn without putting back, so somewhat less than three times as often.
    assert 2.2 < counts[:50].sum() / counts[50:].sum() < 3.0


def test_children_change_parents_at_three_points():
    search = GeneticSearch(50, np.random.default_rng(3))
    zeros, ones = np.zeros(50, bool), np.ones(50, bool)
    for _ in range(20):
        child = search._crossover(zeros, ones)
        assert np.count_nonzero(np.diff(child.astype(int))) == 3
        assert not child[0]


def test_mutation_falls_from_start_to_end():
    search = GeneticSearch(20, np.random.default_rng(0), SHORT)
    rates = []
    while not search.finished:
        rates.append(search.mutation)
        search.tell(np.ones(100))
    assert rates[0] == pytest.approx(.2)
    assert rates[-1] == pytest.approx(.02)
    assert np.all(np.diff(rates) < 0)


def test_the_best_ever_seen_is_the_answer():
    search = GeneticSearch(20, np.random.default_rng(0), GeneticConfig(elite=0.0, iterations=5))
    first = search.ask()
    search.tell(np.arange(100) + 1.0)
    for _ in range(4):
        search.tell(np.full(100, 50.0))
    assert search.best_energy == 1.0
    assert np.array_equal(search.best_mask, first[0])


def test_no_subset_exceeds_max_per_group():
    group = np.repeat(np.arange(8), 5)
    search = GeneticSearch(40, np.random.default_rng(0), SHORT, group, 1)
    while not search.finished:
        population = search.ask()
        counts = population.reshape(100, 8, 5).sum(2)
        assert counts.max() == 1
        search.tell(population.sum(1) + 1.0)


def test_time_is_up():
    calls = []
    result = genetic_search(10, quadratic(0), np.random.default_rng(0), SHORT,
                            stop=lambda: calls.append(1) or len(calls) == 3)
    assert not result[2]
    assert np.isfinite(result[1])


def test_one_thing_and_nothing():
    assert genetic_search(1, lambda m: 2.0 - m[0], np.random.default_rng(0), SHORT)[0].all()
    mask, value, _ = genetic_search(0, lambda m: 2.0, np.random.default_rng(0), SHORT)
    assert (len(mask), value) == (0, 2.0)
