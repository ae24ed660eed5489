# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Proposals: a right pose of everything that stands there, and more where asked."""

from dataclasses import replace

from hooc_perception.core.frame.costs import PixelCosts
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.hypotheses.propose import propose, propose_more
from hooc_perception.core.types import Candidates
import numba
import numpy as np
import pytest


def proposed(desk, config, seed=0):
    """Return the pool of a desk."""
    return propose(desk.frame, config, PixelCosts(), stage_rng(seed, 'propose'))


def assert_same(a, b):
    """Compare two Candidates bit for bit."""
    for name in ('category', 'translation', 'rotation_xyzw', 'size', 'score'):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def off(pool, desk, c):
    """Return (distance (n,) metres, relative error of size (n,)) of the candidates of class c."""
    mine = pool.take(pool.category == c)
    true = desk.truth.take(desk.truth.category == c)
    size = np.abs(np.sort(mine.size, 1) / np.sort(true.size, 1) - 1).max(1)
    return np.linalg.norm(mine.translation - true.translation, axis=1), size


@pytest.mark.parametrize('c', [1, 2, 3])
def test_a_right_pose_of_each_object_is_in_the_pool(desk, desk_pool, c):
    distance, size = off(desk_pool, desk, c)
    assert ((distance < 0.01) & (size < 0.25)).any()
    # The first is the best of its category, and here nothing looks alike.
    assert distance[0] < 0.02


def test_a_right_pose_is_in_the_pool_whatever_the_seed(desk, cheap):
    pool = proposed(desk, cheap, seed=11)
    assert all(off(pool, desk, c)[0].min() < 0.01 for c in (1, 2, 3))


def test_candidates_are_ordered_limited_and_of_the_right_types(desk_pool, cheap):
    assert (np.bincount(desk_pool.category, minlength=4)[1:] <= cheap.per_category).all()
    assert (np.diff(desk_pool.category.astype(int)) >= 0).all()
    for c in (1, 2, 3):
        assert (np.diff(desk_pool.score[desk_pool.category == c]) <= 0).all()
    assert desk_pool.category.dtype == np.uint16
    assert desk_pool.translation.dtype == desk_pool.rotation_xyzw.dtype == np.float64
    assert desk_pool.size.dtype == desk_pool.score.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(desk_pool.rotation_xyzw, axis=1), 1, atol=1e-12)
    assert (desk_pool.size > 0).all()


def test_the_same_seed_gives_the_same_pool_whatever_the_threads(desk, desk_pool, cheap):
    known = numba.get_num_threads()
    try:
        for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
            numba.set_num_threads(threads)
            assert_same(proposed(desk, cheap), desk_pool)
    finally:
        numba.set_num_threads(known)
    other = proposed(desk, cheap, seed=1)
    assert len(other) != len(desk_pool) or (other.translation != desk_pool.translation).any()


def test_an_empty_table_has_no_candidates(empty_desk, cheap):
    assert len(proposed(empty_desk, cheap)) == 0
    more = propose_more(empty_desk.frame, Candidates.empty(), cheap, PixelCosts(),
                        stage_rng(0, 'propose', 1))
    assert len(more) == 0


def test_things_that_fit_nowhere_are_not_proposed(desk, cheap):
    giant = replace(desk.models[0], **{
        name: getattr(desk.models[0], name) * 20 for name in
        ('vertices', 'extents', 'surface_points')})
    none = replace(desk.probabilities, p=np.ascontiguousarray(desk.probabilities.p[:, :2]))
    pool = propose(Frame(desk.observation, none, (giant,)), cheap, PixelCosts(),
                   stage_rng(0, 'propose'))
    assert len(pool) == 0


def more_for(desk, objects, config, turn=1):
    """Return what is proposed further beside `objects`."""
    return propose_more(desk.frame, objects, config, PixelCosts(), stage_rng(0, 'propose', turn))


def test_where_all_is_explained_nothing_good_is_offered(desk, cheap):
    more = more_for(desk, desk.truth, cheap)
    assert not (more.score > 0.1).any()


@pytest.mark.parametrize('missing', [1, 2, 3])
def test_what_is_offered_explains_what_is_left(desk, cheap, missing):
    more = more_for(desk, desk.truth.take(desk.truth.category != missing), cheap)
    distance, _ = off(more, desk, missing)
    assert distance[0] < 0.015
    gone = desk.truth.translation[missing - 1]
    good = more.score > 0.1
    assert (np.linalg.norm(more.translation[good] - gone, axis=1) < 0.1).all()
    assert (np.bincount(more.category, minlength=4) <= cheap.round_per_category).all()


def test_without_objects_all_is_left(desk, cheap):
    more = more_for(desk, Candidates.empty(), replace(cheap, round_samples=4000))
    assert all(off(more, desk, c)[0].min() < 0.015 for c in (1, 2, 3))


def test_few_candidates_are_drawn_for_a_little_that_is_left(desk, cheap):
    config = replace(cheap, round_per_category=10, round_pool=40, least_effort=0.3)
    little = more_for(desk, desk.truth.take(desk.truth.category != 1), config)
    everything = more_for(desk, Candidates.empty(), config)
    whole = more_for(desk, desk.truth.take(desk.truth.category != 1),
                     replace(config, least_effort=1.0))
    assert len(little) < len(whole)
    assert np.bincount(everything.category).max() > 0.3 * 10


def test_rounds_draw_numbers_of_their_own(desk, cheap):
    two = desk.truth.take([0, 2])
    first, again, second = (more_for(desk, two, cheap, turn) for turn in (1, 1, 2))
    assert_same(first, again)
    assert len(first) != len(second) or (first.translation != second.translation).any()


def test_pixel_costs_reach_the_ranking(desk, cheap):
    """A tolerance in which everything fits makes all hypotheses alike to the images."""
    loose = propose(desk.frame, cheap, PixelCosts(tolerance_m=0.5), stage_rng(0, 'propose'))
    usual = proposed(desk, cheap)
    assert len(loose) != len(usual) or (loose.score != usual.score).any()
