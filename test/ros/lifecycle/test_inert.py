# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that only another profile's method has are rejected by name."""

from hooc_perception.core.profiles import profile
from hooc_perception.ros.lifecycle.misaddressed import inert, known_elsewhere
import pytest


def stages_of(name):
    """Return {stage: Config} as a node that proposes and parses declares them."""
    return {stage: profile(name).stage(stage) for stage in ('propose', 'parse')}


@pytest.mark.parametrize('name, given, other', [
    ('best', 'parse.elite', 'paper'), ('fast', 'propose.draws', 'paper'),
    ('paper', 'parse.tolerance_m', 'best')])
def test_what_another_method_has_is_named(name, given, other):
    sentence, = inert([given, 'seed', 'parse.deadline_s'], stages_of(name))
    assert given in sentence and f'profile {other}' in sentence


def test_what_the_method_has_or_nobody_knows_is_passed_over():
    given = ['parse.tolerance_m', 'parse.patience', 'parse.typo', 'observe.max_depth_m', 'model']
    assert not inert(given, stages_of('best'))


def test_parameters_of_all_methods_are_known():
    assert {'parse.elite', 'parse.tolerance_m', 'propose.draws', 'seed'} <= known_elsewhere()
