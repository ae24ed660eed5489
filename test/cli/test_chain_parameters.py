# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What `hooc run` and `hooc up` ask of the nodes; the nodes themselves are stand-ins."""

from argparse import ArgumentParser
from types import SimpleNamespace

from hooc_perception.chain import CHAIN
from hooc_perception.cli import run
from hooc_perception.errors import HoocError
import pytest

pytest.importorskip('rclpy')

from hooc_perception.nodes.ingestion_node import IngestionConfig
from hooc_perception.supervisor import bags, supervisor

MODEL = SimpleNamespace(profile='fast', seed=5)


def arguments(*words):
    """Return the arguments of `hooc run`."""
    parser = ArgumentParser()
    run.add_arguments(parser)
    return parser.parse_args(['bag', '--model', 'm', '--out', 'r.json', *words])


@pytest.fixture
def started(monkeypatch):
    """Return the list of what a Supervisor that starts nothing is made with."""
    seen = []

    class Nodes:
        def __init__(self, names, parameters, **others):
            seen.append((parameters, others))

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def get_parameters(self, name, parameters):
            return {'profile': 'best', 'seed': 7}

    monkeypatch.setattr(supervisor, 'Supervisor', Nodes)
    monkeypatch.setattr(bags, 'BagRunner', lambda *_: None)
    return seen


@pytest.mark.parametrize('words, given', [
    ([], {}), (['--seed', '0'], {'seed': 0}),
    (['--profile', 'best', '--seed', '3'], {'profile': 'best', 'seed': 3})])
def test_what_is_not_asked_for_is_up_to_the_file_and_then_to_the_model(started, words, given):
    # The results say what the nodes have worked with.
    assert run.play([], arguments(*words), MODEL) == ({}, {}, 'best', 7)
    (parameters, others), = started
    for name in CHAIN:
        assert {k: parameters[name][k] for k in ('profile', 'seed') if k in parameters[name]
                } == given
        assert others['defaults'][name] == {'profile': 'fast', 'seed': 5}


@pytest.mark.parametrize('timeout', ['1e9', '601', 'inf', '20'])
def test_any_timeout_is_one_that_the_nodes_take(started, timeout):
    run.play([], arguments('--timeout', timeout), MODEL)
    (parameters, _), = started
    waits = parameters['ingestion_node']['wait_for_answer_s']
    IngestionConfig(wait_for_answer_s=waits)
    assert waits == min(float(timeout), 600)


@pytest.mark.parametrize('seed', ['3000000000', '-1'])
def test_seeds_that_no_node_takes_are_refused_before_one_starts(started, seed):
    with pytest.raises(HoocError, match='the seed is .* from 0 to 2147483647'):
        run.play([], arguments('--seed', seed), MODEL)
    assert not started


def test_a_changed_parameter_reaches_every_node_that_declares_it(started):
    run.play([], arguments('--set-parameter', 'propose.samples=400',
                           '--set-parameter', 'classify.stride=3'), MODEL)
    (parameters, _), = started
    for key, value, nodes in (('propose.samples', 400, {'candidate_node', 'parsing_node'}),
                              ('classify.stride', 3, {'classification_node'})):
        assert {name for name in CHAIN if key in parameters[name]} == nodes
        assert all(parameters[name][key] == value for name in nodes)
