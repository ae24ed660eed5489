# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Greedy and iterated local search against brute force on composited energies."""

from hooc_perception.core.energy import local_search as module
from hooc_perception.core.energy.compositor import Compositor
from hooc_perception.core.energy.local_search import (
    best_swap,
    descend,
    greedy,
    local_search,
    LocalSearchConfig,
)
import numpy as np
import pytest


def instance(seed, n=11, group=None, max_per_group=0):
    """Return a Compositor of n candidates that crowd 60 pixels."""
    rng = np.random.default_rng(seed)
    offsets, pixel = [0], []
    for _ in range(n):
        a = rng.integers(0, 50)
        pixel.append(np.arange(a, min(60, a + rng.integers(4, 20))))
        offsets.append(offsets[-1] + len(pixel[-1]))
    depth = np.repeat(rng.uniform(.5, 1.5, n), np.diff(offsets))
    return Compositor(offsets, np.concatenate(pixel), depth, rng.uniform(0, 2, offsets[-1]),
                      rng.uniform(.5, 2, 60), rng.uniform(0, 1.5, n), group, max_per_group)


def all_subsets(n):
    return (np.arange(2 ** n)[:, None] >> np.arange(n) & 1).astype(bool)


@pytest.mark.parametrize('seed', range(6))
def test_it_equals_brute_force(seed):
    energy = instance(seed)
    result = local_search(energy, np.random.default_rng(0))
    assert result.converged
    assert result.energy == min(map(energy.evaluate, all_subsets(11)))
    assert result.energy == energy.value == energy.evaluate(result.mask)
    assert np.array_equal(energy.mask, result.mask)


@pytest.mark.parametrize('seed', range(4))
def test_it_equals_brute_force_among_the_allowed(seed):
    group = np.array([0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 3])
    energy = instance(seed, group=group, max_per_group=1)
    result = local_search(energy, np.random.default_rng(0))
    allowed = [m for m in all_subsets(11) if np.bincount(group[m]).max(initial=0) <= 1]
    assert np.bincount(group[result.mask]).max(initial=0) <= 1
    assert result.energy == min(map(energy.evaluate, allowed))


def test_greedy_ends_where_no_flip_helps_and_descend_where_no_swap_does():
    energy = instance(3, n=40)
    greedy(energy)
    value = energy.value
    assert energy.deltas().min() >= -1e-9
    descend(energy)
    assert energy.value <= value
    assert energy.deltas().min() >= -1e-9
    here = energy.mask
    for a in np.flatnonzero(here):
        for b in np.flatnonzero(~here):
            other = here.copy()
            other[[a, b]] = False, True
            assert energy.evaluate(other) >= energy.value - 1e-9


@pytest.mark.parametrize('seed', range(5))
def test_known_optima_save_swaps_and_change_nothing(seed, monkeypatch):
    tried = []

    def counting(energy):
        tried.append(energy)
        return best_swap(energy)

    monkeypatch.setattr(module, 'best_swap', counting)
    found, swaps = [], []
    for forget in (False, True):
        if forget:
            def forgetting(energy, config, stop, optima):
                descend(energy, config, stop)
            monkeypatch.setattr(module, 'descend', forgetting)
        tried.clear()
        found.append(local_search(instance(seed, n=40), np.random.default_rng(1)))
        swaps.append(len(tried))
    assert np.array_equal(found[0].mask, found[1].mask)
    assert found[0].energy == found[1].energy
    assert swaps[0] < swaps[1]


@pytest.mark.parametrize('seed', range(5))
def test_the_best_swap_is_the_best_of_all(seed):
    energy = instance(seed, n=30, group=np.arange(30) % 11, max_per_group=1)
    greedy(energy)
    here, value = energy.mask, energy.value
    swapped = []
    for a in np.flatnonzero(here):
        for b in np.flatnonzero(~here):
            other = here.copy()
            other[[a, b]] = False, True
            if np.bincount(np.flatnonzero(other) % 11).max() <= 1:
                swapped.append((energy.evaluate(other), other))
    lowest, best = min(swapped, key=lambda pair: pair[0])
    assert best_swap(energy) == (lowest < value - module.TINY)
    assert energy.value == min(lowest, value)
    assert np.array_equal(energy.mask, best if lowest < value - module.TINY else here)


def test_a_swap_that_does_not_help_leaves_everything_alone():
    energy = instance(3, n=20)
    descend(energy)
    before, value = energy.mask, energy.value
    assert not best_swap(energy)
    assert np.array_equal(energy.mask, before)
    assert energy.value == value


def test_same_seed_same_answer():
    a, b = (local_search(instance(5, n=40), np.random.default_rng(2)) for _ in range(2))
    assert np.array_equal(a.mask, b.mask)
    assert (a.energy, a.kicks) == (b.energy, b.kicks)


@pytest.mark.parametrize('calls', [1, 2, 5, 20])
def test_any_time_it_is_stopped_it_holds_the_best_it_saw(calls):
    energy = instance(6, n=40)
    start = energy.value
    left = [calls]

    def stop():
        left[0] -= 1
        return left[0] <= 0

    result = local_search(energy, np.random.default_rng(0), stop=stop)
    assert not result.converged
    assert result.energy == energy.value == energy.evaluate(result.mask) < start


def test_more_patience_is_never_worse():
    values = [local_search(instance(8, n=60), np.random.default_rng(0),
                           LocalSearchConfig(patience=p)).energy for p in (0, 5, 50)]
    assert values == sorted(values, reverse=True)


def test_nothing_to_choose_from():
    result = local_search(Compositor([0], [], [], [], [3.0]), np.random.default_rng(0))
    assert (result.energy, result.converged, len(result.mask)) == (3.0, True, 0)


def test_members_that_nobody_sees_are_left_out():
    # Candidate 1 lies wholly behind 0 and costs nothing.
    energy = Compositor([0, 2, 4], [0, 1, 0, 1], [.5, .5, 1, 1], [0, 0, 1, 1], [2.0, 2.0])
    energy.flip(1)
    result = local_search(energy, np.random.default_rng(0))
    assert np.array_equal(result.mask, [True, False])
