# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""sequences.yaml: what it says, and a sentence for every mistake in it."""

import copy

from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.scene_set import (
    load_scene_set,
    NewScene,
    TrueObject,
    write_scene_set,
)
from hooc_perception.io.scenes.sequences import PERIOD_S
import numpy as np
import pytest
import trimesh
import yaml

EVENTS = {1: 'removed can', 2: 'placed can', 3: 'arm in'}
MOVES = [{'name': 'moves', 'period_s': 0.5, 'scenes': ['d', 'a', 'b', 'c'], 'events': EVENTS},
         {'name': 'short', 'scenes': ['e']}]


def true_object(category):
    return TrueObject(category, np.zeros(3), np.array([0, 0, 0, 1.0]), np.full(3, 0.1), 0.5)


@pytest.fixture
def path(tmp_path):
    """Return a set of six scenes: a can and a box, no can in `a`; `e` is not annotated."""
    K = np.array([[50.0, 0, 19.5], [0, 50, 14.5], [0, 0, 1]])
    T = np.diag([1.0, -1, -1, 1])
    T[2, 3] = 0.8
    both = true_object('can'), true_object('box')
    truths = {'a': both[1:], 'b': both, 'c': both, 'd': both, 'e': None, 'single': both}
    depth = np.full((30, 40), 0.8)
    mesh = trimesh.creation.box((0.1, 0.1, 0.1))
    path = write_scene_set(
        tmp_path / 'set', 'small', {'can': mesh, 'box': mesh},
        [Camera('left', 40, 30, K, np.zeros(5), T)],
        [NewScene(name, (depth,), truth) for name, truth in truths.items()])
    write(path, MOVES)
    return path


def write(path, content):
    (path / 'sequences.yaml').write_text(yaml.safe_dump(content))


def test_sequences_come_with_the_set_in_their_own_order(path):
    moves, short = load_scene_set(path).sequences
    assert (moves.name, moves.period_s, moves.scenes) == ('moves', 0.5, ('d', 'a', 'b', 'c'))
    assert moves.events == EVENTS
    assert moves.changes == {1: ('removed', 'can'), 2: ('placed', 'can')}
    assert (short.scenes, short.period_s, short.events) == (('e',), PERIOD_S, {})
    assert load_scene_set(path, with_scenes=False).sequences == ()
    (path / 'sequences.yaml').unlink()
    assert load_scene_set(path).sequences == ()


def test_a_sequence_can_be_selected_and_parts_of_one_are_none(path):
    scene_set = load_scene_set(path)
    chosen = scene_set.selected(['single', 'moves', 'b'])
    assert [scene.name for scene in chosen.scenes] == ['single', 'd', 'a', 'b', 'c']
    assert [sequence.name for sequence in chosen.sequences] == ['moves']
    assert scene_set.selected(['d', 'a', 'b', 'e']).sequences == scene_set.sequences[1:]
    assert scene_set.selected([]).sequences == scene_set.sequences


@pytest.mark.parametrize('change, words', [
    (lambda s, q: s.append(dict(q, scenes=['single'], events={})), ('moves', 'twice')),
    (lambda s, q: q.pop('name'), ('name', 'missing')),
    (lambda s, q: q.update(name='a/b'), ('name', 'a/b')),
    (lambda s, q: q.update(name='single'), ('single', 'name of a scene', 'rename')),
    (lambda s, q: q.pop('scenes'), ('scenes', 'missing')),
    (lambda s, q: q.update(scenes=[], events={}), ('scenes', 'empty')),
    (lambda s, q: q['scenes'].append('singel'), ('singel', 'single meant')),
    (lambda s, q: q['scenes'].append('d'), ("'d' twice",)),
    (lambda s, q: s[1].update(scenes=['d']), ("'d' twice",)),
    (lambda s, q: q.update(period_s=0), ('period_s', '0')),
    (lambda s, q: q.update(period_s='long'), ('period_s', 'long')),
    (lambda s, q: q.update(events=['arm in']), ('events', 'list')),
    (lambda s, q: q.update(events={4: 'arm in'}), ('events', '4', '0 to 3')),
    (lambda s, q: q.update(events={'late': 'arm in'}), ('events', 'late')),
    (lambda s, q: q.update(events={1: 'vanished can'}), ('events: 1', 'vanished can', 'removed')),
    (lambda s, q: q.update(events={1: 'removed'}), ('events: 1', 'removed')),
    (lambda s, q: q.update(events={1: 'arm up'}), ('events: 1', 'arm up', 'arm in')),
    (lambda s, q: q.update(events={1: None}), ('events: 1', 'None')),
    (lambda s, q: q.update(events={1: 'removed cann'}), ('removed cann', 'can meant')),
    (lambda s, q: q.update(events={0: 'removed can'}), ('events: 0', 'no frame set before')),
    (lambda s, q: q.update(events={2: 'removed can'}), ('events: 2', 'ground truth of a')),
    (lambda s, q: q.update(events={1: 'moved can'}), ('events: 1', 'ground truth of a')),
])
def test_mistakes_are_named_in_one_sentence(path, change, words):
    content = copy.deepcopy(MOVES)
    change(content, content[0])
    write(path, content)
    with pytest.raises(HoocError) as caught:
        load_scene_set(path)
    assert ';' in str(caught.value) and '\n' not in str(caught.value)
    for word in ('sequences.yaml', *words):
        assert word in str(caught.value)
