# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Profiles by name, and single parameters changed."""

from hooc_perception.chain import PROFILES
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.methods.paper import PaperMethod
from hooc_perception.core.profiles import Profile, profile, with_overrides
from hooc_perception.errors import HoocError
import pytest


@pytest.mark.parametrize('name', PROFILES)
def test_every_profile_goes_by_its_name(name):
    assert profile(name).name == name
    assert profile(name) == profile(name)


def test_the_profiles_are_what_they_say():
    best, fast, paper = (profile(name) for name in ('best', 'fast', 'paper'))
    assert best == Profile()
    assert isinstance(paper.method(), PaperMethod)
    # The paper's numbers, which tuning must not touch.
    assert (paper.propose.draws, paper.propose.keep) == (200, 5)
    genetic = paper.parse.genetic
    assert (genetic.population, genetic.start_size) == (100, 10.0)
    assert (genetic.elite, genetic.drawn, genetic.new) == (0.2, 0.2, 0.1)
    assert genetic.cuts == 3
    assert isinstance(fast.method(), JointMethod) and isinstance(best.method(), JointMethod)
    assert fast.propose.samples < best.propose.samples
    assert fast.parse.rounds <= best.parse.rounds


def test_an_unknown_profile_is_named_with_those_that_there_are():
    with pytest.raises(HoocError, match="no profile 'bset'; choose one of paper, best, fast"):
        profile('bset')


def test_single_parameters_change_and_the_rest_stays():
    best = profile('best')
    changed = with_overrides(best, {'parse.deadline_s': 2, 'propose.samples': 500,
                                    'parse.rounds': 0, 'observe.max_depth_m': 3.0})
    assert (changed.parse.deadline_s, changed.parse.rounds) == (2.0, 0)
    assert changed.propose.samples == 500
    assert changed.observe.max_depth_m == 3.0
    assert changed.classify == best.classify
    assert changed.name == 'best'
    for stage in ('observe', 'propose', 'parse'):
        a, b = best.stage(stage).values(), changed.stage(stage).values()
        differing = {name for name in a if a[name] != b[name]}
        assert differing <= {'deadline_s', 'rounds', 'samples', 'max_depth_m'}
    assert best == profile('best')
    assert with_overrides(best, {}) == best


@pytest.mark.parametrize('key', ['parse.deadline', 'prase.deadline_s', 'deadline_s', 'parse',
                                 'name.x', 'name', '', '.', 'parse.', '.rounds'])
def test_an_unknown_parameter_is_named(key):
    with pytest.raises(HoocError, match='no parameter .* observe, classify, propose, parse') as e:
        with_overrides(profile('best'), {key: 1})
    assert repr(key) in str(e.value)


@pytest.mark.parametrize('key', ['__doc__.x', '__class__.name'])
def test_an_odd_name_is_named_too(key):
    with pytest.raises(HoocError, match='no parameter'):
        with_overrides(profile('best'), {key: 1})


@pytest.mark.parametrize('key, value, sentence', [
    ('parse.swaps', 'yes', 'swaps is .yes., but must be of type bool'),
    ('parse.rounds', 1.5, 'rounds is 1.5, but must be of type int'),
    ('propose.samples', -1, 'samples is -1, outside'),
    ('observe.max_depth_m', None, 'max_depth_m is None')])
def test_a_value_that_is_refused_is_named(key, value, sentence):
    with pytest.raises(HoocError, match=sentence):
        with_overrides(profile('fast'), {key: value})


@pytest.mark.parametrize('name, key, belongs_to', [
    ('best', 'parse.elite', 'paper'), ('fast', 'propose.draws', 'paper'),
    ('paper', 'parse.tolerance_m', 'best and fast'),
    ('paper', 'propose.samples', 'best and fast')])
def test_a_parameter_without_effect_is_refused_by_name(name, key, belongs_to):
    with pytest.raises(HoocError, match=f'{key} has no effect in the profile {name}: only the '
                                        f'method of {belongs_to} has it'):
        with_overrides(profile(name), {key: 0.5})


@pytest.mark.parametrize('name', PROFILES)
def test_every_parameter_can_be_set_by_its_flat_name(name):
    chosen = profile(name)
    texts = {'workspace': '[[0, 0], [1, 1]]', 'ignore': '[[[0, 0], [1, 1]]]', 'table': 'find'}
    for stage in ('observe', 'classify', 'propose', 'parse'):
        for parameter, value in chosen.stage(stage).values().items():
            other = (not value if isinstance(value, bool) else value + 1 if isinstance(value, int)
                     else texts[parameter] if isinstance(value, str) else 0.99 * value)
            changed = with_overrides(chosen, {f'{stage}.{parameter}': other})
            assert changed.stage(stage).values()[parameter] == other
