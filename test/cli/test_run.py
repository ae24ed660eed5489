# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc run` around the nodes: what fails, what is written, what it is refused for."""

import json
from pathlib import Path
from types import SimpleNamespace

from hooc_perception.cli import run as command
from hooc_perception.cli.main import main
from hooc_perception.core.types import Candidates, Energy, ParsedScene
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.supervisor.answers import FrameSetResult
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
BAG, MODEL = ROOT / 'bags' / 'demo', ROOT / 'models' / 'demo'


class Runner:
    """A BagRunner without nodes: scenes fail as they are told to."""

    def __init__(self, failing=(), dying=()):
        self.failing, self.dying, self.played, self.starts = failing, dying, [], 0

    def play(self, bag):
        self.played.append(bag.name)
        if bag.name in self.failing or bag.name in self.dying:
            raise HoocError(f'{bag.name} is too hard')
        return f'answer to {bag.name}'

    def start_over(self):
        self.starts += 1
        if self.played[-1] in self.dying:
            raise HoocError('parsing_node ended unexpectedly')


def bags(*names):
    return [SimpleNamespace(name=name, path=name, info={'sequence': None}) for name in names]


def test_a_scene_that_fails_ends_with_itself():
    runner = Runner(failing=('b',))
    answers, failures = command.play_all(runner, bags('a', 'b', 'c'))
    assert answers == {'a': ['answer to a'], 'c': ['answer to c']}
    assert list(failures) == ['b'] and runner.starts == 1


def test_without_nodes_the_rest_is_not_played():
    runner = Runner(dying=('b',))
    answers, failures = command.play_all(runner, bags('a', 'b', 'c'))
    assert list(answers) == ['a'] and runner.played == ['a', 'b']
    assert 'too hard' in str(failures['b']) and 'not played' in str(failures['c'])
    assert 'parsing_node ended unexpectedly' in str(failures['c'])


def test_all_frame_sets_of_a_sequence_are_answered_or_it_fails():
    runner, (bag,) = Runner(), bags('a')
    bag.info = {'sequence': {'frame_sets': {'a_0': None, 'a_1': None}}}
    runner.results = ['first', 'second']
    assert command.results_of(runner, bag) == ['first', 'second']
    runner.results = ['first']
    with pytest.raises(HoocError, match='a: 1 of the 2 frame sets of the sequence'):
        command.results_of(runner, bag)


@pytest.fixture
def answer():
    """Return an Answer of the bundled scene in which nothing stands."""
    none = np.zeros(0)
    parsed = ParsedScene(Candidates.empty(), Energy(0.5, 0.2, 0.0), none, none, none, none,
                         Candidates.empty())
    images = {camera.name: 0 for camera in BagScene(BAG).cameras}
    return FrameSetResult(5, parsed, 1.0, None, images, np.zeros(0, np.uint32),
                          np.zeros(0, np.uint32))


@pytest.mark.skipif(not (BAG / 'metadata.yaml').is_file(), reason='no bundled scene')
def test_the_finished_scenes_are_written_and_the_others_named(
        tmp_path, monkeypatch, capsys, answer):
    monkeypatch.setattr(command, 'play', lambda bags, args, model: (
        {bags[0].name: [answer]}, {'other': HoocError('it is too hard')}, 'best', 0))
    out = tmp_path / 'out' / 'r.json'
    assert main(['run', str(BAG), '--model', str(MODEL), '--out', str(out)]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == 'hooc: scene other: it is too hard'
    results = json.loads(out.read_text())
    scene, = results['scenes']
    assert (out.parent / scene['bag']).resolve() == BAG.resolve()
    assert (out.parent / results['model']).resolve() == MODEL.resolve()
    # So the report needs neither set nor model.
    assert main(['report', str(out), '--out', str(tmp_path / 'r.html')]) == 0
    assert f'>{scene["scene"]}<' in (tmp_path / 'r.html').read_text()


@pytest.mark.skipif(not (BAG / 'metadata.yaml').is_file(), reason='no bundled scene')
def test_bags_are_looked_at_before_anything_starts(tmp_path):
    bag = BagScene(BAG)
    with pytest.raises(HoocError, match='two bags hold the scene'):
        command.check_bags([bag, bag], None)
    (tmp_path / bag.name).mkdir()
    with pytest.raises(HoocError, match='--record .* exists already'):
        command.check_bags([bag], tmp_path)
