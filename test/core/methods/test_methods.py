# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parsing: exactly what stands there, under every limit that can be set."""

from dataclasses import replace

from hooc_perception.core.energy.eq1 import energy_of
from hooc_perception.core.frame.costs import PixelCosts
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.hypotheses.propose import propose, propose_more
from hooc_perception.core.methods.genetic import GeneticConfig
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.methods.paper import PaperMethod, PaperParseConfig
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.types import Candidates
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


class Joint(JointMethod):
    """The joint method, with re-proposal by the test or not at all."""

    def __init__(self, config, more=None):
        super().__init__(parse=config)
        self._more = more

    def propose_more(self, frame, objects, turn, seed):
        return self._more(objects, turn) if self._more else Candidates.empty()


def parsed(desk, pool, config=ParseConfig(), max_instances=0, more=None, seed=0):
    """Return the ParsedScene of a desk by the joint method."""
    return Joint(config, more).parse(desk.frame, pool, seed, max_instances)


def parsed_as_in_the_paper(desk, pool, iterations, max_instances=0, **config):
    """Return the ParsedScene of a desk by the paper's method."""
    config = PaperParseConfig(genetic=GeneticConfig(iterations=iterations), **config)
    return PaperMethod(parse=config).parse(desk.frame, pool, 0, max_instances)


def assert_found(scene, desk, within_m=0.008):
    """Assert that the answer is the desk's truth, each object once, in place and size."""
    assert sorted(scene.objects.category) == sorted(desk.truth.category)
    left = list(range(len(desk.truth)))
    for i in range(len(scene.objects)):
        away = [np.linalg.norm(scene.objects.translation[i] - desk.truth.translation[j])
                if scene.objects.category[i] == desk.truth.category[j] else np.inf for j in left]
        j = left.pop(int(np.argmin(away)))
        assert min(away) < within_m
        np.testing.assert_allclose(np.sort(scene.objects.size[i]), np.sort(desk.truth.size[j]),
                                   rtol=0.25)


@pytest.fixture(scope='module')
def answer(desk, desk_pool, cheap):
    """Return the ParsedScene of the desk from what was proposed, with re-proposal."""
    def more(objects, turn):
        return propose_more(desk.frame, objects, cheap, PixelCosts(),
                            stage_rng(0, 'propose', turn))

    return parsed(desk, desk_pool, more=more)


def test_exactly_the_three_objects_are_found(answer, desk):
    assert_found(answer, desk)
    assert answer.converged


def test_the_answer_carries_its_evidence(answer, desk, desk_pool):
    n = len(answer.objects)
    for name in ('visible_ratio', 'residual_m', 'energy_delta', 'n_views'):
        assert getattr(answer, name).shape == (n,)
    assert ((answer.objects.score > 0.9) & (answer.objects.score <= 1)).all()
    # They stand apart: all in sight, from everywhere.
    assert (answer.visible_ratio > 0.85).all()
    assert (answer.visible_ratio <= 1).all()
    assert (answer.n_views == 3).all()
    assert (answer.residual_m < 0.004).all()
    assert (answer.energy_delta > 100).all()
    assert answer.seconds['parse'] > 0
    assert len(answer.pool) >= len(desk_pool)
    energy = energy_of(desk.observation, desk.probabilities, answer.objects, desk.models)
    assert answer.energy.total == pytest.approx(energy.total)


def test_what_is_half_hidden_says_so(things, make_desk):
    # The ball lies on the box, which the can hides from one side.
    truth = Candidates(
        np.array([1, 2, 3], np.uint16),
        np.array([[0.0, 0.0, 0.03], [0.0, 0.0, 0.10], [0.115, 0.0, 0.06]]),
        np.tile([0, 0, 0, 1.0], (3, 1)), np.array([m.extents for m in things], np.float32),
        np.ones(3, np.float32))
    desk = make_desk(truth)
    scene = parsed(desk, truth, ParseConfig(rounds=0))
    assert_found(scene, desk)
    order = np.argsort(scene.objects.category)
    assert scene.visible_ratio[order][1] > scene.visible_ratio[order][0] + 0.1


def test_an_empty_table_gives_an_empty_answer(empty_desk):
    scene = parsed(empty_desk, Candidates.empty(), more=lambda *_: Candidates.empty())
    assert len(scene.objects) == len(scene.pool) == len(scene.energy_delta) == 0
    assert scene.converged
    assert scene.energy.probability == scene.energy.overlap == 0
    assert scene.energy.depth < 0.05


def test_on_an_empty_table_nothing_is_made_up(empty_desk, desk):
    assert len(parsed(empty_desk, desk.truth).objects) == 0


def test_nothing_proposed_leaves_the_table_unexplained(desk):
    scene = parsed(desk, Candidates.empty())
    assert len(scene.objects) == 0
    assert scene.energy.total > 0.1


@pytest.mark.parametrize('rounds', [0, 2])
def test_from_the_true_poses_alone_every_object_is_found(desk, rounds):
    scene = parsed(desk, desk.truth, ParseConfig(rounds=rounds))
    assert_found(scene, desk)


def test_copies_of_an_object_are_not_chosen_twice(desk):
    copies = desk.truth.extended(desk.truth).extended(
        replace(desk.truth, translation=desk.truth.translation + [0.004, 0, 0]))
    assert_found(parsed(desk, copies), desk)


def test_the_wrong_class_in_the_right_place_loses(desk):
    wrong = desk.truth.take([2])
    wrong = replace(wrong, category=np.array([1], np.uint16))
    scene = parsed(desk, desk.truth.extended(wrong), ParseConfig(rounds=0))
    assert_found(scene, desk)


def test_refinement_mends_poses_that_are_a_little_off(desk):
    rng = np.random.default_rng(5)
    turn = Rotation.from_rotvec(rng.normal(0, 0.06, (3, 3)))
    rough = replace(
        desk.truth, translation=desk.truth.translation + [[0.006, -0.005, 0.0]],
        rotation_xyzw=(turn * Rotation.from_quat(desk.truth.rotation_xyzw)).as_quat(),
        size=(desk.truth.size * [[1.06, 0.95, 1.05]]).astype(np.float32))

    def off(config):
        scene = parsed(desk, rough, config)
        assert sorted(scene.objects.category) == [1, 2, 3]
        order = np.argsort(scene.objects.category)
        return (np.linalg.norm(scene.objects.translation[order] - desk.truth.translation, axis=1),
                scene.residual_m)

    before, residual_before = off(ParseConfig(rounds=0, polish_steps=0))
    after, residual = off(ParseConfig(rounds=2, polish_steps=60))
    assert after.max() < before.max()
    assert np.median(after) < 0.7 * np.median(before)
    assert np.median(residual) < np.median(residual_before)


def test_what_is_missing_is_asked_for_and_found(desk, cheap):
    asked = []

    def more(objects, turn):
        asked.append((sorted(objects.category.tolist()), turn))
        return propose_more(desk.frame, objects, cheap, PixelCosts(),
                            stage_rng(0, 'propose', turn))

    scene = parsed(desk, desk.truth.take([0, 2]), ParseConfig(rounds=2), more=more)
    assert asked[0] == ([1, 3], 1)
    assert [turn for _, turn in asked] == [1, 2]
    assert asked[1][0] == [1, 2, 3]
    assert_found(scene, desk)


@pytest.mark.parametrize('search', ['joint', 'genetic'])
def test_a_deadline_ends_the_search_with_an_answer(desk, desk_pool, search):
    scene = (parsed(desk, desk_pool, ParseConfig(deadline_s=1e-6)) if search == 'joint'
             else parsed_as_in_the_paper(desk, desk_pool, 300, deadline_s=1e-6))
    assert not scene.converged
    assert len(scene.objects) == len(scene.n_views) <= len(desk_pool)
    assert np.isfinite(scene.energy.total)
    assert parsed(desk, desk.truth, ParseConfig(deadline_s=3600.0)).converged


def test_no_category_has_more_than_its_limit(things, make_desk):
    truth = Candidates(
        np.array([2, 2, 3], np.uint16),
        np.array([[0.08, 0.05, 0.04], [-0.08, 0.03, 0.04], [0.0, -0.09, 0.06]]),
        np.tile([0, 0, 0, 1.0], (3, 1)),
        np.array([things[c - 1].extents for c in (2, 2, 3)], np.float32), np.ones(3, np.float32))
    desk = make_desk(truth)
    pool = truth.extended(replace(truth, translation=truth.translation + [0, 0.003, 0]))
    for limit, expected in ((0, [2, 2, 3]), (1, [2, 3]), (2, [2, 2, 3])):
        scene = parsed(desk, pool, max_instances=limit)
        assert sorted(scene.objects.category) == expected
    genetic = parsed_as_in_the_paper(desk, pool, 20, max_instances=1)
    assert np.bincount(genetic.objects.category).max() <= 1


def test_the_papers_search_finds_them_from_the_true_poses(desk):
    pool = desk.truth.extended(replace(desk.truth, translation=desk.truth.translation + 0.2))
    scene = parsed_as_in_the_paper(desk, pool, 30)
    assert_found(scene, desk, 1e-6)
    assert scene.converged
    energy = energy_of(desk.observation, desk.probabilities, desk.truth, desk.models)
    assert scene.energy.total == pytest.approx(energy.total)
    assert (scene.energy_delta > 0).all()


def test_the_same_seed_gives_the_same_answer(desk, desk_pool):
    a, b = (parsed(desk, desk_pool, ParseConfig(rounds=1)) for _ in range(2))
    for name in ('category', 'translation', 'rotation_xyzw', 'size', 'score'):
        np.testing.assert_array_equal(getattr(a.objects, name), getattr(b.objects, name))
    np.testing.assert_array_equal(a.energy_delta, b.energy_delta)
    assert a.energy == b.energy


def test_proposing_and_parsing_leave_the_frame_as_it_is(desk, cheap):
    # Whoever proposes first must not change what parsing finds, and the other way round.
    first = parsed(desk, desk.truth, ParseConfig(rounds=1))
    propose(desk.frame, cheap, PixelCosts(), stage_rng(4, 'propose'))
    again = parsed(desk, desk.truth, ParseConfig(rounds=1))
    np.testing.assert_array_equal(first.objects.translation, again.objects.translation)


def test_the_energies_are_of_the_frame_that_is_given(desk, empty_desk):
    """No state is shared between frames: two of them taken in turns do not mix."""
    other = Frame(desk.observation, desk.probabilities, desk.models)
    a, nothing, b = (Joint(ParseConfig(rounds=0)).parse(frame, desk.truth, 0)
                     for frame in (desk.frame, empty_desk.frame, other))
    assert len(nothing.objects) == 0
    np.testing.assert_array_equal(a.objects.translation, b.objects.translation)
