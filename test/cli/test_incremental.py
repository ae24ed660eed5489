# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc parse --incremental`: which frame set follows which."""

from types import SimpleNamespace

from hooc_perception.cli.incremental import in_time_order, updates
from hooc_perception.cli.main import main
from hooc_perception.core.types import Candidates, UnknownObjects
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.sequences import RecordedSequence
import pytest

# Neither the names nor the order in the set tell the order of time.
SCENES = tuple(SimpleNamespace(name=name) for name in ('a', 'b', 'c', 'd', 'e'))
SEQUENCES = (RecordedSequence('one', 0.5, ('d', 'a')), RecordedSequence('two', 0.5, ('e', 'b')))


class Following:
    """A parser that notes what follows what, and fails at some scenes."""

    models = ()

    def __init__(self, failing=()):
        self.failing, self.followed = failing, []

    def update(self, views, previous, seed):
        self.followed.append((views, previous and previous.views))
        if views in self.failing:
            raise HoocError('it is too dark')
        return SimpleNamespace(
            views=views, to_dict=lambda: {'objects': []},
            parsed=SimpleNamespace(objects=Candidates.empty(), unknown=UnknownObjects.empty(),
                                   hidden_s=None))


def results(parser, unreadable=()):
    """Return [(scene, what came of it)] of all scenes."""
    scenes = in_time_order(SCENES, SEQUENCES)
    read = (HoocError('damaged') if s.name in unreadable else (s.name, None) for s in scenes)
    return [(s.name, done) for s, (done, _) in zip(
        scenes, updates(parser, 0, scenes, read, SEQUENCES), strict=True)]


def test_frame_sets_follow_in_the_order_of_time_and_sequences_begin_anew():
    parser = Following()
    done = results(parser)
    assert [name for name, _ in done] == ['d', 'a', 'e', 'b', 'c']
    # Scenes of no sequence come at the usual pace.
    assert [entry['stamp_ns'] for _, entry in done] == [0, 5e8, 0, 5e8, 0]
    assert all(entry['events'] == [] for _, entry in done)
    assert parser.followed == [('d', None), ('a', 'd'), ('e', None), ('b', 'e'), ('c', None)]


def test_scenes_without_sequences_are_one_in_the_order_of_the_set():
    scenes = in_time_order(SCENES, ())
    assert [s.name for s in scenes] == list('abcde')
    parser = Following()
    assert len(list(updates(parser, 0, scenes, ((s.name, None) for s in scenes), ()))) == 5
    assert parser.followed[1:] == [('b', 'a'), ('c', 'b'), ('d', 'c'), ('e', 'd')]


def test_a_frame_set_that_cannot_be_parsed_is_left_out_of_its_sequence():
    parser = Following(failing=('d',))
    done = dict(results(parser, unreadable=('e',)))
    assert [name for name, d in done.items() if isinstance(d, HoocError)] == ['d', 'e']
    assert parser.followed == [('d', None), ('a', None), ('b', None), ('c', None)]


@pytest.mark.parametrize('option', [['--true-poses'], ['--executor', 'dask=tcp://localhost:1']])
def test_what_does_not_go_together(repository, tmp_path, capsys, option):
    code = main(['parse', str(repository / 'bags' / 'demo'), '--model',
                 str(repository / 'models' / 'demo'), '--out', str(tmp_path / 'r.json'),
                 '--incremental', *option])
    assert code and f'leave out {option[0]}' in capsys.readouterr().err
