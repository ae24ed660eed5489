# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Config dataclasses as parameters: declared once, refused with a reason."""

from dataclasses import dataclass

from hooc_perception.core.config import Config, param
from hooc_perception.errors import HoocError
import pytest

pytest.importorskip('rclpy')

from hooc_perception.ros.lifecycle.parameters import descriptor, Parameters
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402


@dataclass(frozen=True)
class Knobs(Config):
    gain: float = param(0.5, 'How loud.', 'V', 0.0, 1.0, runtime=True)
    limit: int = param(3, 'How many.', '', 0, None)
    mode: str = param('a', 'Which way.', choices=('a', 'b'))
    fast: bool = param(False, 'Hurry.', runtime=True)
    names: tuple = param((), 'Who.')
    output: str = param('auto', 'Whether.', choices=('auto', 'on', 'off'), runtime=True)


def declared(context, overrides=(), unconfigured=True):
    state = {'unconfigured': True}
    node = Node('n', context=context, parameter_overrides=[
        Parameter(name, value=value) for name, value in dict(overrides).items()])
    parameters = Parameters(node, lambda: state['unconfigured'])
    parameters.declare('', Knobs())
    parameters.declare('deep', Knobs(gain=0.25))
    state['unconfigured'] = unconfigured
    return node, parameters


def test_defaults_come_from_the_instance(context):
    _, parameters = declared(context)
    assert parameters[''] == Knobs() and parameters['deep'] == Knobs(gain=0.25)


def test_overrides_apply(context):
    _, parameters = declared(context, {'deep.limit': 9, 'names': ['x', 'y'], 'mode': 'b'})
    assert parameters['deep'].limit == 9
    assert parameters[''].names == ('x', 'y') and parameters[''].mode == 'b'


@pytest.mark.parametrize('value, means', [
    (True, 'on'), (False, 'off'), ('on', 'on'), ('auto', 'auto')])
def test_yaml_reads_on_and_off_as_booleans(context, value, means):
    node, parameters = declared(context, {'output': value}, unconfigured=False)
    assert parameters[''].output == means
    for other, text in ((not value, 'on' if not value else 'off'), ('auto', 'auto')):
        assert node.set_parameters([Parameter('output', value=other)])[0].successful
        assert parameters[''].output == text
    assert not node.set_parameters([Parameter('output', value='maybe')])[0].successful


@pytest.mark.parametrize('name, value', [
    ('deep.gain', 2.0), ('limit', -1), ('deep.mode', 'c'), ('limit', 'three'), ('names', 5)])
def test_bad_overrides_name_the_parameter(context, name, value):
    with pytest.raises(HoocError, match=name):
        declared(context, {name: value})


def test_runtime_changes(context):
    node, parameters = declared(context, unconfigured=False)
    assert node.set_parameters([Parameter('deep.gain', value=0.75)])[0].successful
    assert parameters['deep'].gain == 0.75 and parameters[''].gain == 0.5


@pytest.mark.parametrize('name, value, word', [
    ('limit', 4, 'clean up'), ('deep.mode', 'b', 'clean up'), ('gain', 3.0, 'range'),
    ('fast', 7, 'type')])
def test_refused_changes_say_why(context, name, value, word):
    node, parameters = declared(context, unconfigured=False)
    before = dict(parameters.configs)
    result = node.set_parameters([Parameter(name, value=value)])[0]
    assert not result.successful and word in result.reason and len(result.reason) > 20
    assert parameters.configs == before


def test_start_up_parameters_change_while_unconfigured(context):
    node, parameters = declared(context)
    assert node.set_parameters([Parameter('deep.mode', value='b')])[0].successful
    assert parameters['deep'].mode == 'b'
    result = node.set_parameters([Parameter('deep.mode', value='c')])[0]
    assert 'deep.mode' in result.reason and 'choose one of' in result.reason


def test_all_or_nothing(context):
    node, parameters = declared(context)
    result = node.set_parameters_atomically(
        [Parameter('limit', value=5), Parameter('mode', value='zzz')])
    assert not result.successful and parameters[''].limit == 3
    assert node.get_parameter('limit').value == 3


def test_descriptors_carry_meaning_unit_and_range():
    fields = Knobs.__dataclass_fields__
    gain = descriptor(fields['gain'])
    assert gain.description == 'How loud. [V]'
    assert (gain.floating_point_range[0].from_value,
            gain.floating_point_range[0].to_value) == (0.0, 1.0)
    limit = descriptor(fields['limit'])
    assert limit.integer_range[0].from_value == 0
    assert limit.integer_range[0].to_value == 2 ** 63 - 1
    assert "'a', 'b'" in descriptor(fields['mode']).additional_constraints
    assert not descriptor(fields['fast']).integer_range
