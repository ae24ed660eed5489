# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The verifier: margins by brute force, features of right and wrong, and its say in parsing."""

from dataclasses import replace

from hooc_perception.core.energy.joint import JointEnergy
from hooc_perception.core.frame.costs import ObjectCosts, PixelCosts
from hooc_perception.core.frame.evidence import hypotheses_of
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.parsing.search import Search, search_scene
from hooc_perception.core.parsing.verifier import (
    FEATURES,
    features,
    FIRST_FEATURES,
    margins,
    siblings_of,
    Verifier,
)
from hooc_perception.core.types import Candidates
from hooc_perception.errors import HoocError
import numpy as np
import pytest

CONFIG = ParseConfig()


class Alone(JointMethod):
    """The joint method without re-proposal."""

    def propose_more(self, frame, objects, turn, seed):
        return Candidates.empty()


class Says:
    """A verifier with an opinion of its own."""

    def __init__(self, opinion):
        """Take a callable features (n, F) -> probabilities (n,)."""
        self.probability = opinion


@pytest.fixture(scope='module')
def state(desk, desk_pool):
    """Return the Search of the desk at its optimum; in its pool are things at others' places."""
    wrong = replace(desk.truth, category=np.roll(desk.truth.category, 1))
    found, _, _ = search_scene(desk.frame, desk_pool.extended(wrong), CONFIG,
                               stage_rng(0, 'parse'))
    return found


def test_margins_are_what_one_exchange_leaves_to_gain(desk):
    pool = desk.truth.extended(desk.truth)
    pool.translation[3:] += [0.015, 0.0, 0.0]
    evidence, shapes = desk.frame.coarse, desk.frame.shapes
    stats, lists = evidence.compare_pixels(hypotheses_of(pool, shapes), shapes.of(pool),
                                           PixelCosts().weights())
    energy = JointEnergy(evidence, pool, stats, lists, desk.models, ObjectCosts(), 1)
    start = np.array([True, True, False, False, False, False])
    energy.reset(start)
    siblings = siblings_of(pool, desk.models)
    np.testing.assert_array_equal(siblings, np.tile(np.eye(3, dtype=bool), (2, 2)))

    def cost(*flips):
        mask = start.copy()
        mask[list(flips)] ^= True
        return energy.evaluate(mask) - energy.evaluate(start)

    # Both objects that are in have a sibling each; the can and its sibling are out.
    without = [min(cost(a), *(cost(a, k) for k in (2, 5))) for a in (0, 1)]
    expected = [-without[0], -without[1], min(cost(2), cost(0, 2), cost(1, 2)),
                cost(0, 3) - without[0], cost(1, 4) - without[1],
                min(cost(5), cost(0, 5), cost(1, 5))]
    found = margins(energy, siblings)
    np.testing.assert_allclose(found, expected, atol=0.02)
    np.testing.assert_array_equal(energy.mask, start)


def test_features_tell_right_from_wrong(desk, state):
    x = features(state)
    assert x.shape == (len(state.pool), len(FEATURES)) and x.dtype == np.float32
    assert np.isfinite(x).all()
    column = dict(zip(FEATURES, x.T))
    both = desk.truth.extended(state.pool)
    right = siblings_of(both, desk.models)[:3, 3:].any(0)
    assert right.any() and not right.all()
    assert (column['margin'][right] < -1).all() and (column['margin'][~right] > -1).all()
    # The classifier of the desk is sure.
    assert column['own p'][right].min() > 0.6 and (column['rank of p'][right] == 0).all()
    assert column['agree'][right].mean() > column['agree'][~right].mean()


def test_no_candidates_have_no_features(desk):
    none = Search(desk.frame.coarse, desk.models, CONFIG, 0)
    assert features(none).shape == (0, len(FEATURES))


def test_its_probability_is_the_score_and_decides(desk, desk_pool):
    def run(verifier):
        return Alone(parse=CONFIG, verifier=verifier).parse(desk.frame, desk_pool, 0, 1)

    sure = run(Says(lambda x: np.full(len(x), 0.9)))
    assert sorted(sure.objects.category) == [1, 2, 3]
    np.testing.assert_allclose(sure.objects.score, 0.9)
    # It can talk small things out of the answer, not what the images leave no doubt of.
    no_ball = run(Says(lambda x: np.where(x[:, FEATURES.index('category')] == 2, 0.0, 0.9)))
    assert sure.energy_delta.min() > no_ball.energy_delta.min()


def test_a_model_without_one_is_served_and_a_foreign_one_refused(state):
    assert Verifier.from_arrays({'forest_feature': np.zeros(1)}) is None
    leaf = {'verifier_feature': np.array([-1], np.int32),
            'verifier_threshold': np.zeros(1, np.float32),
            'verifier_left': np.zeros(1, np.int32), 'verifier_roots': np.zeros(1, np.int32),
            'verifier_leaf': np.zeros(1, np.int32),
            'verifier_leaf_p': np.array([[51, 204]], np.uint8),
            'verifier_features': np.uint8(len(FEATURES))}
    x = np.zeros((2, len(FEATURES)), np.float32)
    np.testing.assert_allclose(Verifier.from_arrays(leaf).probability(x), 0.8)
    # One from before the outline was looked at reads the features that it knows.
    before = {**leaf, 'verifier_features': np.uint8(FIRST_FEATURES)}
    np.testing.assert_allclose(Verifier.from_arrays(before).probability(x), 0.8)
    asks = {'verifier_feature': np.array([FIRST_FEATURES, -1, -1], np.int32),
            'verifier_threshold': np.zeros(3, np.float32),
            'verifier_left': np.array([1, 0, 0], np.int32),
            'verifier_leaf': np.zeros(3, np.int32)}
    np.testing.assert_allclose(Verifier.from_arrays({**leaf, **asks}).probability(x), 0.8)
    for foreign in ({'verifier_features': np.uint8(3)},
                    {'verifier_features': np.uint8(len(FEATURES) + 1)},
                    {**asks, 'verifier_features': np.uint8(FIRST_FEATURES)}):
        with pytest.raises(HoocError, match='train again'):
            Verifier.from_arrays({**leaf, **foreign})
