# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Results files: there and back, atomically, with a sentence for every error."""

import copy
import json

from hooc_perception.core.types import Candidates, Energy, ParsedScene
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.results import load_results, scene_result, write_results
import numpy as np
import pytest


@pytest.fixture
def parsed():
    objects = Candidates(np.array([2, 1], np.uint16), np.array([[0.1, 0.2, 0.3], [0, 0, 1.0]]),
                         np.array([[0, 0, 0, 1.0], [0.6, 0, 0, 0.8]]),
                         np.array([[0.1, 0.1, 0.2], [1, 2, 3]], np.float32),
                         np.array([0.9, 0.5], np.float32), np.array([3, 0], np.uint16))
    return ParsedScene(objects, Energy(0.5, 0.75, 0.125), np.array([1, 0.5], np.float32),
                       np.array([0.002, np.nan], np.float32), np.array([0.1, 0.2], np.float32),
                       np.array([3, 1], np.uint8), objects, True, {'parse': 0.5})


def test_there_and_back(tmp_path, parsed):
    entry = scene_result('10_1', parsed, ('ball', 'box'), 1.5, seed=4)
    file = tmp_path / 'new' / 'results.json'
    write_results(file, 'kitchen', [entry], profile='best')
    content = load_results(file)
    assert content['format'] == 'hooc-results/1'
    assert (content['dataset'], content['profile']) == ('kitchen', 'best')
    scene, = content['scenes']
    assert (scene['scene'], scene['seconds'], scene['seed']) == ('10_1', 1.5, 4)
    assert scene['energy'] == {'total': 1.375, 'depth': 0.5, 'probability': 0.75,
                               'overlap': 0.125}
    first, second = scene['objects']
    assert (first['category'], second['category']) == ('box', 'ball')
    assert (first['member'], second['member']) == (3, 0)
    assert first['translation'] == [0.1, 0.2, 0.3]
    assert second['rotation_xyzw'] == [0.6, 0, 0, 0.8]
    assert second['size'] == [1, 2, 3]
    assert second['residual_m'] is None
    assert [p.name for p in file.parent.iterdir()] == ['results.json']


def test_ids_are_kept(tmp_path):
    content = copy.deepcopy(GOOD)
    content['scenes'][0]['objects'][0]['id'] = 7
    content['scenes'][0]['unknown'] = [{'id': 2 ** 32 - 1, 'translation': [0, 0, 0],
                                        'rotation_xyzw': [0, 0, 0, 1], 'size': [1, 1, 1]}]
    write_results(tmp_path / 'r.json', 'kitchen', content['scenes'])
    assert load_results(tmp_path / 'r.json') == content


def test_an_empty_scene_is_a_result(tmp_path, parsed):
    nothing = ParsedScene(Candidates.empty(), parsed.energy, *([np.zeros(0)] * 4),
                          Candidates.empty())
    write_results(tmp_path / 'r.json', 'd', [scene_result('a', nothing, (), 0.1)])
    assert load_results(tmp_path / 'r.json')['scenes'][0]['objects'] == []


GOOD = {'format': 'hooc-results/1', 'dataset': 'kitchen', 'scenes': [
    {'scene': '10_1', 'seconds': 1.9,
     'energy': {'total': 1.36, 'depth': 0.52, 'probability': 0.78, 'overlap': 0.01},
     'objects': [{'category': 'teacup', 'score': 0.93, 'translation': [0.1, 0, 0.04],
                  'rotation_xyzw': [0, 0, 0, 1], 'size': [0.12, 0.09, 0.08]}]}]}

ERRORS = [
    (lambda r, s, o: r.update(format='hooc-results/2'), ('format', 'hooc-results/2')),
    (lambda r, s, o: r.pop('format'), ('format', 'missing')),
    (lambda r, s, o: r.update(dataset=3), ('dataset', '3')),
    (lambda r, s, o: r.update(scenes={}), ('scenes',)),
    (lambda r, s, o: r['scenes'].append(dict(s)), ('scenes', '10_1', 'twice')),
    (lambda r, s, o: s.pop('scene'), ('scenes[0]', 'scene', 'missing')),
    (lambda r, s, o: s.pop('seconds'), ('10_1', 'seconds', 'missing')),
    (lambda r, s, o: s.update(seconds=-1), ('10_1', 'seconds', 'negative')),
    (lambda r, s, o: s['energy'].pop('overlap'), ('10_1', 'energy', 'overlap')),
    (lambda r, s, o: s['energy'].update(total='low'), ('10_1', 'energy', 'total', 'low')),
    (lambda r, s, o: s.pop('objects'), ('10_1', 'objects', 'missing')),
    (lambda r, s, o: o.pop('category'), ('10_1', 'objects[0]', 'category')),
    *((lambda r, s, o, bad=bad: o.update(member=bad), ('10_1', 'objects[0]', 'member', str(bad)))
      for bad in (-1, 1.5, 'first', 10 ** 6)),
    *((lambda r, s, o, bad=bad: o.update(id=bad), ('10_1', 'objects[0]', 'id', str(bad)))
      for bad in (-1, 1.5, 'first', True, 2 ** 32)),
    (lambda r, s, o: o.update(score='good'), ('10_1', 'objects[0]', 'score', 'good')),
    (lambda r, s, o: o.update(translation=[0, 0]), ('10_1', 'objects[0]', 'translation')),
    (lambda r, s, o: o.update(rotation_xyzw=[0, 0, 0, 0]), ('10_1', 'rotation_xyzw', 'unit')),
    (lambda r, s, o: o.update(size=[1, 1, -1]), ('10_1', 'objects[0]', 'size')),
]


@pytest.mark.parametrize('change, words', ERRORS, ids=['-'.join(w) for _, w in ERRORS])
def test_errors_name_file_scene_and_field(tmp_path, change, words):
    content = copy.deepcopy(GOOD)
    change(content, content['scenes'][0], content['scenes'][0]['objects'][0])
    file = tmp_path / 'r.json'
    file.write_text(json.dumps(content))
    with pytest.raises(HoocError) as error:
        load_results(file)
    for word in (*words, 'r.json', ';'):
        assert word in str(error.value)


@pytest.mark.parametrize('text', ['', '{', '[]', '[' * 100_000, '{"format": NaN}'])
def test_a_file_that_is_none(tmp_path, text):
    (tmp_path / 'r.json').write_text(text)
    with pytest.raises(HoocError, match='r.json'):
        load_results(tmp_path / 'r.json')


def test_a_failed_write_leaves_the_old_file(tmp_path, parsed):
    file = tmp_path / 'r.json'
    write_results(file, 'kitchen', [])
    broken = scene_result('a', parsed, ('ball', 'box'), float('nan'))
    with pytest.raises(HoocError, match='seconds'):
        write_results(file, 'kitchen', [broken])
    assert load_results(file)['scenes'] == []
    assert len(list(tmp_path.iterdir())) == 1
