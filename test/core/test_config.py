# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters: declared once, checked when they are set, with a sentence that names them."""

from dataclasses import dataclass, FrozenInstanceError, replace

from hooc_perception.chain import PROFILES
from hooc_perception.core.config import Config, group, param
from hooc_perception.core.profiles import profile
from hooc_perception.errors import HoocError
import pytest


@dataclass(frozen=True)
class Kettle(Config):
    """One parameter of each type."""

    litres: float = param(1.5, 'How much it holds.', 'l', 0.1, 3.0)
    cups: int = param(4, 'How many it serves.', low=0)
    whistles: bool = param(True, 'Whether it can be heard.', runtime=True)
    fuel: str = param('gas', 'What heats it.', choices=('gas', 'power'))


def test_defaults_and_what_is_allowed():
    assert Kettle() == Kettle(1.5, 4, True, 'gas')
    kettle = Kettle(litres=0.1, cups=10**9, whistles=False, fuel='power')
    assert (kettle.litres, kettle.cups) == (0.1, 10**9)
    assert replace(kettle, litres=3.0).litres == 3.0


def test_whole_numbers_serve_as_floats():
    litres = Kettle(litres=2).litres
    assert isinstance(litres, float)
    assert litres == 2.0


@pytest.mark.parametrize('wrong, sentence', [
    ({'litres': 3.01}, 'litres is 3.01, outside its range 0.1 to 3.0'),
    ({'litres': 0}, 'litres is 0.0, outside'),
    ({'litres': float('inf')}, 'litres is inf, outside'),
    ({'cups': -1}, 'cups is -1, outside its range 0 to None'),
    ({'litres': 'many'}, "litres is 'many', but must be of type float"),
    ({'litres': True}, 'litres is True, but must be of type float'),
    ({'cups': 2.0}, 'cups is 2.0, but must be of type int'),
    ({'cups': True}, 'cups is True, but must be of type int'),
    ({'whistles': 1}, 'whistles is 1, but must be of type bool'),
    ({'fuel': None}, 'fuel is None, but must be of type str'),
    ({'fuel': 'wood'}, "fuel is 'wood'; choose one of gas, power")])
def test_what_is_refused_is_named(wrong, sentence):
    with pytest.raises(HoocError, match=f'^parameter {sentence}'):
        Kettle(**wrong)


def test_not_a_number_is_refused():
    with pytest.raises(HoocError, match='litres'):
        Kettle(litres=float('nan'))


def test_nothing_changes_afterwards():
    with pytest.raises(FrozenInstanceError):
        Kettle().cups = 3


@dataclass(frozen=True)
class Kitchen(Config):
    """Parameters of its own and those of a kettle with another default."""

    lights: int = param(2, 'How many lamps.', low=0)
    kettle: Kettle = group(Kettle(cups=6))


def test_a_group_belongs_to_the_names_of_the_outer_one():
    assert list(Kitchen.parameters()) == ['lights', 'litres', 'cups', 'whistles', 'fuel']
    assert Kitchen().values() == {'lights': 2, 'litres': 1.5, 'cups': 6, 'whistles': True,
                                  'fuel': 'gas'}
    changed = Kitchen().changed({'cups': 9, 'lights': 0})
    assert (changed.lights, changed.kettle) == (0, Kettle(cups=9))
    assert Kitchen().changed({}) == Kitchen()
    with pytest.raises(HoocError, match="no parameter 'spoons'"):
        Kitchen().changed({'spoons': 1})
    with pytest.raises(HoocError, match='cups is -1, outside'):
        Kitchen().changed({'cups': -1})


STAGES = [(name, stage) for name in PROFILES for stage in ('observe', 'classify', 'propose',
                                                           'parse')]


@pytest.mark.parametrize('name, stage', STAGES)
def test_every_parameter_says_what_it_means_and_its_default_is_allowed(name, stage):
    config = profile(name).stage(stage)
    for parameter, f in config.parameters().items():
        assert len(f.metadata['doc']) > 8, parameter
        assert type(f.default) in (float, int, bool, str), parameter
        assert isinstance(f.metadata['runtime'], bool)
        if isinstance(f.default, str):
            assert f.default in (f.metadata['choices'] or [f.default]), parameter
        elif not isinstance(f.default, bool):
            assert f.metadata['low'] is not None, f'{parameter} has no lower bound'
            with pytest.raises(HoocError, match=f'parameter {parameter} '):
                config.changed({parameter: type(f.default)(f.metadata['low'] - 1)})
