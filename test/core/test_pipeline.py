# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The whole chain in one process, with a classifier that knows the truth."""

from dataclasses import replace

from hooc_perception.core import pipeline
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.hypotheses.propose import propose, propose_more
from hooc_perception.core.parsing.calibration import finished
from hooc_perception.core.parsing.parse import parse, ParseConfig
from hooc_perception.core.pipeline import Pipeline
from hooc_perception.core.profiles import profile
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Candidates
from hooc_perception.errors import HoocError
import numpy as np
import pytest

SAME = ('category', 'translation', 'rotation_xyzw', 'size', 'score')


@pytest.fixture
def oracle(desk, monkeypatch):
    """Put the true classes in the place of a classifier; return the calls it got."""
    calls = []

    def classify(observation, classifier, config):
        calls.append((observation, classifier, config))
        return desk.probabilities

    monkeypatch.setattr(pipeline, 'classify', classify)
    return calls


@pytest.fixture
def small_profile(cheap):
    """Return a profile for three things."""
    return replace(profile('best'), propose=cheap, parse=ParseConfig(rounds=1))


def test_from_depth_images_to_the_objects(desk, oracle, small_profile):
    scene = Pipeline(list(desk.models), {'known': 1}, small_profile).parse_scene(desk.views)
    order = np.argsort(scene.objects.category)
    assert scene.objects.category[order].tolist() == [1, 2, 3]
    off = np.linalg.norm(scene.objects.translation[order] - desk.truth.translation, axis=1)
    assert off.max() < 0.008
    assert set(scene.seconds) == {'observe', 'classify', 'propose', 'parse'}
    assert all(s >= 0 for s in scene.seconds.values())
    (observation, classifier, config), = oracle
    assert len(observation.views) == 3
    assert classifier == {'known': 1}
    assert config == small_profile.classify


def test_the_chain_is_the_stages_one_after_the_other(desk, oracle, small_profile):
    """What separate processes do that seed themselves: the same to the last bit."""
    scene = Pipeline(desk.models, {}, small_profile, seed=5).parse_scene(desk.views)
    p = small_profile
    observation = observe([rectify(v, p.observe) for v in desk.views], p.observe)
    pool = propose(observation, desk.probabilities, desk.models, p.propose,
                   stage_rng(5, 'propose'))

    def more(objects, turn):
        again = observe([rectify(v, p.observe) for v in desk.views], p.observe)
        return propose_more(again, desk.probabilities, desk.models, objects, p.propose,
                            stage_rng(5, 'propose', turn))

    expected = parse(observation, desk.probabilities, pool, desk.models, p.parse,
                     stage_rng(5, 'parse'), 0, more)
    objects = finished(expected, observation, desk.models, p.parse).objects
    for name in SAME:
        np.testing.assert_array_equal(getattr(scene.objects, name), getattr(objects, name))
        np.testing.assert_array_equal(getattr(scene.pool, name), getattr(expected.pool, name))
    assert scene.energy == expected.energy


def test_a_pipeline_keeps_nothing_from_scene_to_scene(desk, empty_desk, oracle, small_profile,
                                                      monkeypatch):
    chain = Pipeline(desk.models, {}, small_profile)
    first = chain.parse_scene(desk.views)
    with monkeypatch.context() as m:
        m.setattr(pipeline, 'classify', lambda *_: empty_desk.probabilities)
        nothing = chain.parse_scene(empty_desk.views)
    again = chain.parse_scene(desk.views)
    assert len(nothing.objects) == len(nothing.pool) == 0
    for name in SAME:
        np.testing.assert_array_equal(getattr(first.objects, name), getattr(again.objects, name))


def test_the_pool_can_be_changed_between_the_stages(desk, oracle, small_profile):
    seen = []

    def only_truth(pool):
        seen.append(len(pool))
        return desk.truth.take([1])

    alone = replace(small_profile, parse=ParseConfig(rounds=0, polish_steps=0))
    scene = Pipeline(desk.models, {}, alone).parse_scene(desk.views, only_truth)
    assert seen[0] > 3
    np.testing.assert_array_equal(scene.objects.translation, desk.truth.translation[[1]])


@pytest.mark.parametrize('limit, expected', [(0, 2), (1, 1), (2, 2)])
def test_the_limit_of_instances_reaches_the_search(desk, oracle, small_profile, limit, expected):
    # A ball drawn out to the box's size explains the box, as long as nothing better is there.
    other = replace(desk.truth.take([0]), category=np.array([2], np.uint16))
    pool = desk.truth.take([1]).extended(other)
    alone = replace(small_profile, parse=ParseConfig(rounds=0, polish_steps=0))
    chain = Pipeline(desk.models, {}, alone, max_instances=limit)
    assert len(chain.parse_scene(desk.views, lambda _: pool).objects) == expected


def test_other_seeds_draw_other_numbers(desk, oracle, small_profile):
    a, b = (Pipeline(desk.models, {}, small_profile, seed=s) for s in (0, 1))
    assert a.rng('propose').random() == stage_rng(0, 'propose').random()
    assert a.rng('propose').random() != b.rng('propose').random()
    assert a.rng('propose').random() != a.rng('parse').random()


def test_what_a_stage_refuses_passes_through(desk, oracle, small_profile):
    chain = Pipeline(desk.models, {}, small_profile)
    with pytest.raises(HoocError, match='at least one camera'):
        chain.parse_scene([])
    blind = [replace(v, depth=np.zeros_like(v.depth)) for v in desk.views]
    with pytest.raises(HoocError, match='camera0'):
        chain.parse_scene(blind)


def test_an_untrained_classifier_is_named(desk, small_profile):
    with pytest.raises(HoocError, match='train the model again'):
        Pipeline(desk.models, {}, small_profile).parse_scene(desk.views)


def test_the_proposer_of_the_papers_profile_has_nothing_to_add(desk):
    chain = Pipeline(desk.models, {}, profile('paper'))
    more = chain.more(desk.observation, desk.probabilities)
    assert len(more(Candidates.empty(), 1)) == 0
