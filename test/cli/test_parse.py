# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc parse`: results of a small set, and one sentence for every mistake."""

from dataclasses import replace
import json
import re
import shutil

from hooc_perception import Parser
from hooc_perception import parser as parser_module
from hooc_perception.cli.main import main
from hooc_perception.cli.overrides import overrides_of
from hooc_perception.core.geometry import back_project
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, PixelProbabilities
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.results import load_results
from hooc_perception.io.scenes.scene_set import NewScene, TrueObject, write_scene_set
from hooc_perception.objects.derive import derive
from hooc_perception.trained.folder import save_model_folder
import numpy as np
import pytest
import trimesh

MESHES = {'ball': trimesh.creation.icosphere(3, 0.04),
          'box': trimesh.creation.box((0.14, 0.10, 0.06))}
PLACES = {'ball': np.array([0.09, 0.0, 0.04]), 'box': np.array([-0.06, 0.03, 0.03])}
CHEAP = [word for text in ('propose.samples=6000', 'propose.pool=30', 'propose.polish=6',
                           'propose.per_category=4', 'parse.rounds=0')
         for word in ('--set-parameter', text)]


def camera(name, azimuth):
    """Return a camera that looks at the middle of the table."""
    position = 0.75 * np.array([0.73 * np.cos(azimuth), 0.73 * np.sin(azimuth), 0.68])
    z = -position / np.linalg.norm(position)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.column_stack([x, np.cross(z, x), z]), position
    K = np.array([[190.0, 0, 79.5], [0, 190, 59.5], [0, 0, 1]])
    return Camera(name, 160, 120, K, np.zeros(5), T)


CAMERAS = (camera('left', 0.3), camera('right', 2.6))


def depth_of(names):
    """Return the depth images of some things on the table."""
    ground = 0.5 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    meshes = [(MESHES[n].vertices + PLACES[n], MESHES[n].faces.astype(np.int32)) for n in names]
    meshes.append((ground, np.array([[0, 1, 2], [0, 2, 3]], np.int32)))
    drawn = [render_depth(meshes, c)[0] for c in CAMERAS]
    return tuple(np.where(np.isfinite(d), d, np.nan) for d in drawn)


def truth_of(names):
    """Return the TrueObjects of some things."""
    return tuple(TrueObject(n, PLACES[n], np.array([0, 0, 0, 1.0]), MESHES[n].extents)
                 for n in names)


@pytest.fixture(scope='module')
def models():
    """Return the GenericModels."""
    return tuple(derive(n, m, np.random.default_rng(0)) for n, m in MESHES.items())


@pytest.fixture(scope='module')
def scene_set(tmp_path_factory):
    """Return the folder of a set: scenes both, none, and `unknown`, which has no truth."""
    scenes = [NewScene('both', depth_of(['ball', 'box']), truth_of(['ball', 'box'])),
              NewScene('none', depth_of([]), ()), NewScene('unknown', depth_of(['ball']))]
    return write_scene_set(tmp_path_factory.mktemp('parse') / 'set', 'pair', MESHES, CAMERAS,
                           scenes, 1)


@pytest.fixture(scope='module')
def annotated(tmp_path_factory):
    """Return the folder of a set with two scenes, both with a truth."""
    scenes = [NewScene('both', depth_of(['ball', 'box']), truth_of(['ball', 'box'])),
              NewScene('none', depth_of([]), ())]
    return write_scene_set(tmp_path_factory.mktemp('parse') / 'set', 'pair', MESHES, CAMERAS,
                           scenes, 1)


@pytest.fixture(scope='module')
def model(tmp_path_factory, models):
    """Return a model folder whose classifier is none; see `oracle`."""
    folder = tmp_path_factory.mktemp('parse') / 'model'
    save_model_folder(folder, 'pair', models, {'nothing': np.zeros(1)}, 'best', 3, CAMERAS, 1)
    return folder


@pytest.fixture(autouse=True)
def oracle(monkeypatch):
    """Classify every pixel as the thing that stands next to it."""
    def classify(observation, classifier, config):
        rows = [[], [], []]
        for k, view in enumerate(observation.views):
            v, u = np.nonzero(view.foreground)
            points = back_project(view.depth, view.camera)[v, u]
            near = np.argmin([np.linalg.norm(points - PLACES[n], axis=1) for n in MESHES], axis=0)
            p = np.full((len(u), 3), 10, np.uint8)
            p[np.arange(len(u)), near + 1] = 235
            for row, value in zip(rows, (np.full(len(u), k, np.uint8),
                                         np.column_stack([u, v]).astype(np.uint16), p)):
                row.append(value)
        return PixelProbabilities(*map(np.concatenate, rows))

    monkeypatch.setattr(parser_module, 'classify', classify)


def hooc_parse(scene_set, model, out, *words):
    """Return the exit code of the command."""
    return main(['parse', str(scene_set), '--model', str(model), '--out', str(out), *words])


def sentence(capsys):
    """Return what the command printed as its one line of error."""
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith('hooc: ')]
    assert len(error) == 1
    return error[0]


def test_every_scene_is_parsed_into_a_results_file(scene_set, model, tmp_path, capsys):
    out = tmp_path / 'results.json'
    assert hooc_parse(scene_set, model, out, *CHEAP) == 0
    results = load_results(out)
    assert (results['dataset'], results['setting']) == ('pair', 'A')
    both, none, unknown = results['scenes']
    assert [s['scene'] for s in results['scenes']] == ['both', 'none', 'unknown']
    assert sorted(o['category'] for o in both['objects']) == ['ball', 'box']
    for found in both['objects']:
        np.testing.assert_allclose(found['translation'], PLACES[found['category']], atol=0.01)
    assert none['objects'] == []
    assert [o['category'] for o in unknown['objects']] == ['ball']
    for scene in results['scenes']:
        assert (scene['profile'], scene['seed'], scene['setting']) == ('best', 3, 'A')
        assert set(scene['stage_seconds']) == {'observe', 'classify', 'propose', 'parse'}
        assert scene['seconds'] >= sum(scene['stage_seconds'].values()) - 0.01
        assert scene['converged'] is True
    assert '3 scenes, 3 objects' in capsys.readouterr().out


def test_the_same_seed_gives_the_same_objects(scene_set, model, tmp_path):
    def objects(name, *words):
        assert hooc_parse(scene_set, model, tmp_path / name, *CHEAP, *words) == 0
        return [s['objects'] for s in json.loads((tmp_path / name).read_text())['scenes']]

    assert objects('a', '--seed', '3') == objects('b')
    assert objects('c', '--seed', '4') != objects('a', '--seed', '3')


def test_chosen_scenes(scene_set, model, tmp_path):
    out = tmp_path / 'some.json'
    assert hooc_parse(scene_set, model, out, *CHEAP, '--scene', 'unknown', 'none') == 0
    assert [s['scene'] for s in load_results(out)['scenes']] == ['unknown', 'none']


def test_scenes_are_chosen_one_by_one_as_for_other_commands(scene_set, model, tmp_path):
    out = tmp_path / 'some.json'
    assert hooc_parse(scene_set, model, out, *CHEAP, '--scene', 'none', '--scene', 'unknown') == 0
    assert [s['scene'] for s in load_results(out)['scenes']] == ['none', 'unknown']


def test_true_poses_are_among_the_candidates(annotated, model, tmp_path, monkeypatch):
    pools, plain = [], Parser.decide

    def decide(self, frame, pool, seed):
        pools.append(pool)
        return plain(self, frame, pool, seed)

    monkeypatch.setattr(Parser, 'decide', decide)
    out = tmp_path / 'b.json'
    assert hooc_parse(annotated, model, out, *CHEAP, '--true-poses') == 0
    both, none = pools
    np.testing.assert_allclose(both.translation[-2:], [PLACES['ball'], PLACES['box']], atol=1e-6)
    assert both.category[-2:].tolist() == [1, 2]
    assert len(none) == 0
    results = load_results(out)
    assert results['setting'] == 'B'
    assert sorted(o['category'] for o in results['scenes'][0]['objects']) == ['ball', 'box']


def test_true_poses_without_truth_are_refused(scene_set, model, tmp_path, capsys):
    assert hooc_parse(scene_set, model, tmp_path / 'b.json', *CHEAP, '--true-poses') == 1
    said = sentence(capsys)
    assert 'scene unknown has no ground_truth.yaml' in said
    assert '--true-poses' in said


def test_a_scene_named_twice_is_parsed_once(scene_set, model, tmp_path):
    out = tmp_path / 'some.json'
    assert hooc_parse(scene_set, model, out, *CHEAP, '--scene', 'none', 'none') == 0
    assert [s['scene'] for s in load_results(out)['scenes']] == ['none']


def test_a_broken_scene_does_not_cost_the_others(scene_set, model, tmp_path, capsys):
    broken = tmp_path / 'set'
    shutil.copytree(scene_set, broken)
    (broken / 'scenes' / 'none' / 'left.png').write_bytes(b'no image')
    out = tmp_path / 'r.json'
    assert hooc_parse(broken, model, out, *CHEAP) == 1
    assert [s['scene'] for s in load_results(out)['scenes']] == ['both', 'unknown']
    assert sentence(capsys).startswith('hooc: scene none: ')
    assert hooc_parse(broken, model, tmp_path / 'none.json', *CHEAP, '--scene', 'none') == 1
    assert not (tmp_path / 'none.json').exists()


def test_a_place_that_cannot_be_written_is_refused_before_the_work(
        scene_set, model, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(parser_module, 'classify', None)
    (tmp_path / 'file').touch()
    assert hooc_parse(scene_set, model, tmp_path) == 1
    assert f'--out {tmp_path} is a folder; name a file' in sentence(capsys)
    assert hooc_parse(scene_set, model, tmp_path / 'file' / 'r.json') == 1
    assert 'is not a folder; choose another place' in sentence(capsys)


@pytest.fixture
def other_model(tmp_path, models):
    """Return a model folder that knows the ball and a cup, but no box."""
    known = tuple(replace(m, name={'box': 'cup'}.get(m.name, m.name)) for m in models)
    save_model_folder(tmp_path / 'other', 'other', known, {'nothing': np.zeros(1)}, 'best', 3,
                      CAMERAS, 1)
    return tmp_path / 'other'


def test_a_model_of_other_categories_is_noticed(annotated, other_model, tmp_path, capsys):
    out = tmp_path / 'r.json'
    assert hooc_parse(annotated, other_model, out, *CHEAP, '--true-poses') == 1
    assert 'it does not know box' in sentence(capsys) and not out.exists()
    assert hooc_parse(annotated, other_model, out, *CHEAP) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith('[WARN]')]
    assert len(said) == 1 and 'does not know box' in said[0] and 'does not list cup' in said[0]


def test_results_say_where_their_set_is(annotated, model, tmp_path):
    out = tmp_path / 'deep' / 'r.json'
    assert hooc_parse(annotated, model, out, *CHEAP, '--scene', 'none') == 0
    named = json.loads(out.read_text())['set']
    assert not named.startswith('/') and (out.parent / named).resolve() == annotated.resolve()
    assert main(['report', str(out), '--out', str(tmp_path / 'r.html')]) == 0
    assert '>none<' in (tmp_path / 'r.html').read_text()


def test_a_set_that_is_not_there(model, tmp_path, capsys):
    assert hooc_parse(tmp_path / 'nowhere', model, tmp_path / 'r.json') == 1
    said = sentence(capsys)
    assert f'{tmp_path / "nowhere"}: there is no such folder' in said


@pytest.mark.parametrize('kind', ['missing', 'file', 'empty'])
def test_a_model_that_is_no_model_folder(scene_set, tmp_path, capsys, kind):
    path = tmp_path / 'model'
    if kind == 'file':
        path.write_text('weights')
    elif kind == 'empty':
        path.mkdir()
    assert hooc_parse(scene_set, path, tmp_path / 'r.json') == 1
    assert f'{path} is not a model folder' in sentence(capsys)


@pytest.mark.parametrize('text, said', [
    ('parse.deadline=2', "no parameter 'parse.deadline'"),
    ('parse.swaps=luck', 'swaps is .luck., but must be of type bool'),
    ('parse.elite=0.1', 'parse.elite has no effect in the profile best'),
    ('parse.rounds=-1', 'rounds is -1, outside its range'),
    ('rounds=1', "'rounds=1' does not set a parameter; write STAGE.NAME=VALUE"),
    ('parse.rounds', "'parse.rounds' does not set a parameter")])
def test_a_parameter_that_is_not_one(scene_set, model, tmp_path, capsys, text, said):
    assert hooc_parse(scene_set, model, tmp_path / 'r.json', '--set-parameter', text) == 1
    assert re.search(said, sentence(capsys))
    assert not (tmp_path / 'r.json').exists()


def test_an_unknown_profile_and_missing_arguments_end_with_the_usage(scene_set, model, capsys):
    for words in (['parse', str(scene_set), '--model', str(model), '--out', 'x',
                   '--profile', 'bset'], ['parse', str(scene_set)]):
        with pytest.raises(SystemExit) as exit_:
            main(words)
        assert exit_.value.code == 2
        assert 'usage: hooc parse' in capsys.readouterr().err


def test_texts_become_values():
    found = overrides_of(['parse.deadline_s=2.0', 'parse.rounds=0', 'parse.swaps=false',
                          'parse.search=joint', 'propose.samples=400', 'parse.rounds=1'])
    assert found == {'parse.deadline_s': 2.0, 'parse.rounds': 1, 'parse.swaps': False,
                     'parse.search': 'joint', 'propose.samples': 400}
    assert overrides_of([]) == {}


def test_numbers_with_an_exponent_are_numbers():
    assert overrides_of(['parse.deadline_s=1e-3']) == {'parse.deadline_s': 0.001}


def test_a_garbled_value_is_named():
    with pytest.raises(HoocError, match='parse.search'):
        overrides_of(['parse.search=[joint'])
