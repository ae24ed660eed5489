# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The joint energy of subsets against a dense composition in numpy."""

from types import SimpleNamespace

from hooc_perception.core.energy.joint import JointEnergy
from hooc_perception.core.energy.overlap import union_shares
from hooc_perception.core.frame.costs import ObjectCosts, PixelCosts
from hooc_perception.core.frame.evidence import hypotheses_of
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.types import Candidates
import numpy as np
import pytest

CONFIG = ObjectCosts()


def energy_of_pool(desk, pool, config=CONFIG, max_instances=0):
    """Return (JointEnergy over all pixels, stats, lists, evidence)."""
    evidence, shapes = desk.frame.evidence, desk.frame.shapes
    stats, lists = evidence.compare_pixels(hypotheses_of(pool, shapes), shapes.of(pool),
                                           PixelCosts().weights())
    return (JointEnergy(evidence, pool, stats, lists, desk.models, config, max_instances), stats,
            lists, evidence)


@pytest.fixture(scope='module')
def setting(desk, desk_pool):
    """Return a pool of true and proposed candidates and its energy."""
    pool = desk.truth.extended(desk_pool)
    energy, stats, lists, evidence = energy_of_pool(desk, pool)
    rng = np.random.default_rng(0)
    subsets = [rng.random(len(pool)) < share for share in (0.0, 0.1, 0.2, 0.4, 1.1)]
    subsets.append(np.arange(len(pool)) < 3)
    return SimpleNamespace(pool=pool, energy=energy, stats=stats, lists=lists,
                           evidence=evidence, subsets=subsets)


def dense(setting, mask, models, config=CONFIG):
    """Return the energy of a subset, pixel by pixel and object by object."""
    depth = np.full(len(setting.evidence.views.depth), np.inf)
    cost = setting.evidence.cost_none.astype(float)
    total = 0.0
    for k in np.flatnonzero(mask):
        mine = slice(*setting.lists.offsets[k:k + 2])
        pixel, z = setting.lists.pixel[mine], setting.lists.depth[mine]
        nearer = z < depth[pixel]
        depth[pixel[nearer]] = z[nearer]
        cost[pixel[nearer]] = setting.lists.cost[mine][nearer]
        extents = models[setting.pool.category[k] - 1].extents
        prior = (np.log(setting.pool.size[k] / extents) ** 2).sum()
        total += config.base_cost + setting.stats[k, stat.SHOWN] * (
            config.complexity + config.size_prior * prior)
    chosen = setting.pool.take(mask)
    overlap = union_shares(chosen, models, 256).sum() if len(chosen) else 0.0
    return total + cost.sum() + config.overlap * overlap


def test_energies_are_those_of_a_dense_composition(setting, desk):
    for mask in setting.subsets:
        expected = dense(setting, mask, desk.models)
        assert setting.energy.evaluate(mask) == pytest.approx(expected, abs=0.02)
        setting.energy.reset(mask)
        assert setting.energy.value == pytest.approx(expected, abs=0.02)
        np.testing.assert_array_equal(setting.energy.mask, mask)


def test_deltas_are_what_flips_change(setting):
    for mask in setting.subsets[:4]:
        setting.energy.reset(mask)
        deltas, value = setting.energy.deltas(), setting.energy.value
        for k in range(0, len(mask), 3):
            flipped = mask.copy()
            flipped[k] = ~flipped[k]
            rise = setting.energy.evaluate(flipped) - value
            assert deltas[k] == pytest.approx(rise, abs=1e-6)
            setting.energy.flip(k)
            assert setting.energy.value == pytest.approx(value + rise, abs=1e-6)
            setting.energy.flip(k)
        np.testing.assert_array_equal(setting.energy.mask, mask)


def test_deltas_without_a_member_equal_those_after_its_flip(setting, deltas_by_flips):
    for mask in setting.subsets:
        setting.energy.reset(mask)
        members = np.flatnonzero(mask)
        assert np.array_equal(setting.energy.deltas_without(members),
                              deltas_by_flips(setting.energy, members))


def test_nothing_chosen_costs_the_foreground(setting, desk):
    none = np.zeros(len(setting.pool), bool)
    foreground = sum(v.foreground.sum() for v in desk.observation.views)
    assert setting.energy.evaluate(none) == pytest.approx(foreground)


def test_the_truth_costs_least(setting):
    truth = np.arange(len(setting.pool)) < 3
    best = setting.energy.evaluate(truth)
    for k in range(3):
        without = truth.copy()
        without[k] = False
        assert setting.energy.evaluate(without) > best + 100
    rng = np.random.default_rng(3)
    for _ in range(20):
        other = rng.random(len(truth)) < 0.15
        assert setting.energy.evaluate(other) > best


def test_two_in_one_place_pay_for_their_overlap(desk):
    twice = desk.truth.take([0, 0])
    free, paid = (energy_of_pool(desk, twice, ObjectCosts(overlap=w))[0] for w in (0.0, 300.0))
    both = np.ones(2, bool)
    assert paid.evaluate(both) - free.evaluate(both) == pytest.approx(600, rel=0.02)
    one = np.array([True, False])
    assert paid.evaluate(one) == free.evaluate(one)


def test_a_full_category_takes_no_more(desk, desk_pool):
    pool = desk.truth.extended(desk_pool)
    energy, *_ = energy_of_pool(desk, pool, max_instances=1)
    energy.reset(np.arange(len(pool)) == 0)
    closed = np.isinf(energy.deltas())
    np.testing.assert_array_equal(closed, (pool.category == 1) & (np.arange(len(pool)) > 0))
    assert np.isfinite(energy.joining_costs()).all()
    np.testing.assert_allclose(energy.joining_costs()[~closed], energy.deltas()[~closed])
    energy.flip(0)
    assert np.isfinite(energy.deltas()).all()


def test_no_candidates(desk):
    energy, *_ = energy_of_pool(desk, Candidates.empty())
    assert energy.n == len(energy.deltas()) == 0
    foreground = sum(v.foreground.sum() for v in desk.observation.views)
    assert energy.value == pytest.approx(foreground)
