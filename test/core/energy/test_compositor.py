# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The compositor against a plain numpy z-minimum."""

from hooc_perception.core.energy import compositor
from hooc_perception.core.energy.compositor import Compositor
from hooc_perception.errors import HoocError
import numpy as np
import pytest


def random_lists(rng, n=12, n_pixels=60, ties=False):
    """Return (offsets, pixel, depth, cost, cost_none, unary) of n overlapping candidates."""
    pixels = [np.sort(rng.choice(n_pixels - 5, rng.integers(0, 30), replace=False))
              for _ in range(n)]
    offsets = np.cumsum([0] + [len(p) for p in pixels])
    depth = rng.uniform(.5, 1.5, offsets[-1]).astype(np.float32)
    if ties:
        depth = np.round(depth, 0)
    return (offsets, np.concatenate(pixels), depth, rng.uniform(0, 2, offsets[-1]),
            rng.uniform(0, 2, n_pixels), rng.normal(0, 3, n))


def reference(mask, offsets, pixel, depth, cost, cost_none, unary):
    """Return (energy, shown (P,)) by painting from far to near."""
    total = cost_none.copy()
    nearest = np.full(len(total), np.inf)
    shown = np.full(len(total), -1)
    for k in np.flatnonzero(mask):
        for e in range(offsets[k], offsets[k + 1]):
            if depth[e] < nearest[pixel[e]]:
                nearest[pixel[e]], shown[pixel[e]] = depth[e], k
                total[pixel[e]] = cost[e]
    return total.sum() + unary[mask].sum(), shown


@pytest.mark.parametrize('ties', [False, True])
def test_every_flip_of_a_long_walk_agrees_with_the_reference(ties):
    rng = np.random.default_rng(1)
    lists = random_lists(rng, ties=ties)
    energy = Compositor(*lists)
    mask = np.zeros(12, bool)
    for _ in range(200):
        value, shown = reference(mask, *lists)
        assert energy.value == pytest.approx(value, abs=1e-4)
        assert energy.value == energy.evaluate(mask)
        assert np.array_equal(energy.shown(), shown[energy.pixels])
        for k, delta in enumerate(energy.deltas()):
            flipped = mask.copy()
            flipped[k] ^= True
            assert energy.evaluate(flipped) - energy.value == delta
        k = rng.integers(12)
        energy.flip(k)
        mask[k] ^= True
        assert np.array_equal(energy.mask, mask)


@pytest.mark.parametrize('most', [0, 1, 2])
@pytest.mark.parametrize('ties', [False, True])
def test_deltas_without_a_member_equal_those_after_its_flip(ties, most, deltas_by_flips):
    rng = np.random.default_rng(7)
    energy = Compositor(*random_lists(rng, 30, ties=ties), np.arange(30) % 7, most)
    for share in (0.0, 0.1, 0.4, 0.9):
        energy.reset(rng.random(30) < share)
        members, before = np.flatnonzero(energy.mask), energy.deltas()
        without = energy.deltas_without(members)
        assert np.array_equal(energy.deltas(), before)
        assert np.array_equal(without, deltas_by_flips(energy, members))


def test_reset_equals_the_flips_that_lead_there():
    rng = np.random.default_rng(2)
    lists = random_lists(rng)
    a, b = Compositor(*lists), Compositor(*lists)
    for k in (3, 7, 1, 3, 9):
        a.flip(k)
    b.reset(a.mask)
    assert a.value == b.value
    assert np.array_equal(a.deltas(), b.deltas())


def test_new_prices_equal_a_new_energy_with_them():
    rng = np.random.default_rng(4)
    *lists, unary = random_lists(rng)
    energy, mask = Compositor(*lists, np.zeros(len(unary))), rng.random(len(unary)) < .4
    energy.reset(mask)
    energy.reprice(unary)
    other = Compositor(*lists, unary)
    other.reset(mask)
    assert energy.value == other.value == other.evaluate(mask)
    assert np.array_equal(energy.deltas(), other.deltas())


def test_the_number_of_threads_changes_nothing(monkeypatch):
    lists = random_lists(np.random.default_rng(5), ties=True)
    shown = []
    for threads in (1, 2, 7):
        monkeypatch.setattr(compositor.nb, 'get_num_threads', lambda threads=threads: threads)
        energy = Compositor(*lists)
        energy.reset(np.ones(energy.n, bool))
        shown.append((energy.value, *energy.shown(), *energy.deltas()))
    assert shown[0] == shown[1] == shown[2]


def test_a_million_flips_do_not_drift():
    rng = np.random.default_rng(3)
    energy = Compositor(*random_lists(rng, n=4, n_pixels=40))
    empty = energy.value
    for k in np.tile([0, 1, 2, 3, 2, 0, 3, 1], 5000):
        energy.flip(k)
    assert energy.value == empty


def test_full_groups_let_nobody_join():
    offsets, pixel, depth, cost, cost_none, unary = random_lists(np.random.default_rng(4))
    group = np.repeat([5, 9, 11], 4)
    energy = Compositor(offsets, pixel, depth, cost, cost_none, unary, group, 2)
    energy.flip(0)
    assert np.isfinite(energy.deltas()).all()
    energy.flip(3)
    assert np.array_equal(np.isinf(energy.deltas()), [0, 1, 1, 0] + [0] * 8)
    energy.flip(0)
    assert np.isfinite(energy.deltas()).all()


def test_no_candidates_and_no_pixels():
    energy = Compositor([0], [], [], [], [1.0, 2.0])
    assert energy.value == 3.0
    assert len(energy.deltas()) == 0
    energy = Compositor([0, 0], [], [], [], [], unary=[2.0])
    assert np.array_equal(energy.deltas(), [2.0])


@pytest.mark.parametrize('change, message', [
    ({'cost': [1.0]}, 'disagree in length'),
    ({'cost': [np.nan, 1.0]}, 'must be finite'),
    ({'pixel': [0, 7]}, 'outside 0..1')])
def test_bad_lists_are_named(change, message):
    lists = {'offsets': [0, 2], 'pixel': [0, 1], 'depth': [1.0, 1.0], 'cost': [1.0, 1.0],
             'cost_none': [0.0, 0.0], **change}
    with pytest.raises(HoocError, match=message):
        Compositor(**lists)


def test_pixels_with_the_same_candidates_in_the_same_order_are_merged():
    energy = Compositor([0, 3, 6], [0, 1, 2, 1, 2, 3], [1, 1, 1, .5, .5, .5], [1, 2, 4, 8, 16, 32],
                        [64., 128, 256, 512, 1024])
    assert energy.n_merged == 3
    values = {mask: energy.evaluate(np.array(mask, bool)) for mask in (
        (0, 0), (1, 0), (0, 1), (1, 1))}
    assert values == {(0, 0): 1984, (1, 0): 1543, (0, 1): 1144, (1, 1): 1081}
    assert np.array_equal(energy.entries_shown(np.array([True, True])), [0, 3, 4, 5])
    assert np.array_equal(energy.entries_shown(np.array([True, False])), [0, 1, 2, -1])


def test_colliding_fingerprints_change_nothing(monkeypatch):
    lists = random_lists(np.random.default_rng(5))
    expected = Compositor(*lists)
    monkeypatch.setattr(compositor.layout, 'fingerprints',
                        lambda start, owner: np.zeros(len(start) - 1, np.uint64))
    colliding = Compositor(*lists)
    mask = np.arange(12) % 3 == 0
    for energy in (expected, colliding):
        energy.reset(mask)
    assert expected.value == colliding.value
    assert np.array_equal(expected.deltas(), colliding.deltas())
    assert np.array_equal(expected.shown(), colliding.shown())
