# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The same results from a Dask cluster as from this process; one sentence where there is none."""

import json
import os
import socket
import sys

from hooc_perception import executor as module
from hooc_perception.cli.main import main
from hooc_perception.core.geometry import stage_rng
from hooc_perception.errors import HoocError
from hooc_perception.executor import executor
from hooc_perception.objects.derive import derive
from hooc_perception.synthesis import twin
from hooc_perception.synthesis.rigs import ring
from hooc_perception.training.fit_forest import FitConfig
from hooc_perception.training.fit_pixels import PixelFitConfig
from hooc_perception.training.fit_verifier import VerifierConfig
from hooc_perception.training.fused_scenes import FusedScenesConfig
from hooc_perception.training.train import train_classifier
import joblib
import numpy as np
import pytest
import trimesh

distributed = pytest.importorskip('distributed')

SHAPES = {'can': trimesh.creation.cylinder(0.035, 0.12, sections=24),
          'plate': trimesh.creation.cylinder(0.1, 0.02, sections=24),
          'box': trimesh.creation.box((0.07, 0.15, 0.2))}
TINY = {
    'paper': (PixelFitConfig(structure_scenes=9, leaf_scenes=9, trees=2, structure_pixels=40,
                             leaf_pixels=60, tests_per_node=20),),
    'fast': (FusedScenesConfig(scenes=8, quantile_scenes=4, objects_low=2, objects_high=4),
             FitConfig(trees=3, features_per_node=20, min_leaf=5),
             VerifierConfig(verifier_scenes=4, unfamiliar_scenes=0,
                            forest=FitConfig(trees=3, min_leaf=5))),
}

CHEAP = [word for text in ('propose.samples=6000', 'propose.pool=30', 'propose.polish=6',
                           'propose.per_category=4', 'parse.rounds=0')
         for word in ('--set-parameter', text)]


@pytest.fixture(scope='module')
def models():
    """Return three GenericModels."""
    return tuple(derive(name, mesh, stage_rng(0, 'model', i))
                 for i, (name, mesh) in enumerate(SHAPES.items()))


@pytest.fixture(scope='module')
def cluster():
    """Return the address of a scheduler on this machine with two worker processes."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True,
                                  host='127.0.0.1', dashboard_address=':0') as cluster:
        yield cluster.scheduler_address


@pytest.fixture(scope='module')
def small_set(tmp_path_factory):
    """Return the folder of a twin with two scenes of few objects, seen by one camera."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(twin, 'SCENES', {'a': 3, 'b': 2})
        return str(twin.write_twin(tmp_path_factory.mktemp('small') / 'set', 5,
                                   twin.TwinOptions(cameras=1)))


def test_work_goes_to_the_cluster_inside_of_the_block_only(cluster):
    with executor(f'dask={cluster}'):
        # n_jobs is of no account there: as many at once as the cluster has cores.
        away = joblib.Parallel(n_jobs=1)(joblib.delayed(os.getpid)() for _ in range(8))
    home = joblib.Parallel(n_jobs=1)(joblib.delayed(os.getpid)() for _ in range(2))
    assert os.getpid() not in away and set(home) == {os.getpid()}


@pytest.mark.parametrize('profile', list(TINY))
def test_a_cluster_learns_the_same_model_bit_for_bit(cluster, models, profile):
    cameras = ring(np.random.default_rng(0), 2, 128, 106, 91.0)
    here = train_classifier(models, cameras, profile, 3, 2, TINY[profile], jobs=1)
    with executor(f'dask={cluster}'):
        there = train_classifier(models, cameras, profile, 3, 2, TINY[profile], jobs=2)
    assert set(here) == set(there)
    assert ('verifier_feature' in here) == (profile == 'fast')
    for key, value in here.items():
        assert value.dtype == there[key].dtype and np.array_equal(value, there[key]), key


def test_a_cluster_writes_the_same_twin_byte_for_byte(cluster, tmp_path, monkeypatch):
    monkeypatch.setattr(twin, 'CATALOGUE', {n: (lambda m=m: m) for n, m in SHAPES.items()})
    monkeypatch.setattr(twin, 'SCENES', {'a': 2, 'b': 3})
    twin.write_twin(tmp_path / 'here', 5)
    assert main(['twin', '--out', str(tmp_path / 'there'), '--seed', '5',
                 '--executor', f'dask={cluster}']) == 0
    here, there = ({p.relative_to(folder): p.read_bytes()
                    for p in folder.rglob('*') if p.is_file()}
                   for folder in (tmp_path / 'here', tmp_path / 'there'))
    assert len(here) > 8 and here == there


def test_a_cluster_finds_the_same_objects(cluster, repository, small_set, tmp_path):
    answers = []
    for name, more in (('here', []), ('there', ['--executor', f'dask={cluster}'])):
        out = tmp_path / f'{name}.json'
        assert main(['parse', small_set, '--model', str(repository / 'models' / 'demo'),
                     '--out', str(out), *CHEAP, *more]) == 0
        answers.append([(scene['scene'], scene['objects'], scene['energy'])
                        for scene in json.loads(out.read_text())['scenes']])
    assert [scene for scene, _, _ in answers[0]] == ['a', 'b']
    assert any(objects for _, objects, _ in answers[0])
    assert answers[0] == answers[1]


def test_a_cluster_says_the_same_about_the_stages(cluster, repository, small_set, tmp_path):
    contents = []
    for name, more in (('here', []), ('there', ['--executor', f'dask={cluster}'])):
        out = tmp_path / f'{name}.json'
        assert main(['stages', small_set, '--model', str(repository / 'models' / 'demo'),
                     '--scene', 'a', '--json', str(out), *more]) == 0
        contents.append(without(json.loads(out.read_text()), 'seconds'))
    assert set(contents[0]['stages']) == {'a'}
    assert contents[0] == contents[1]


def without(content, key):
    """Return JSON content without the values under a key, at any depth."""
    if isinstance(content, dict):
        return {k: without(v, key) for k, v in content.items() if k != key}
    return [without(v, key) for v in content] if isinstance(content, list) else content


def test_workers_with_other_code_are_refused(cluster, monkeypatch):
    real = module.check
    monkeypatch.setattr(module, 'check', lambda answers, ours: real(
        answers, dict(ours, numba='0.1')))
    with pytest.raises(HoocError, match='has numba .*, here it is 0.1'), \
            executor(f'dask={cluster}'):
        pass


def test_workers_without_the_package_are_named():
    with pytest.raises(HoocError, match='tcp://b of the cluster cannot run .*No module'):
        module.check({'tcp://a': module.versions(),
                      'tcp://b': ModuleNotFoundError('No module named x')}, module.versions())


def test_a_scheduler_without_workers_is_named():
    with distributed.LocalCluster(n_workers=0, processes=False, host='127.0.0.1',
                                  protocol='tcp', dashboard_address=':0') as empty:
        with pytest.raises(HoocError, match='has no workers'), \
                executor(f'dask={empty.scheduler_address}'):
            pass


def test_nobody_at_the_address(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(module, 'CONNECT_S', 0.5)
    with socket.socket() as taken:
        taken.bind(('127.0.0.1', 0))        # bound, but nobody listens
        address = f'tcp://127.0.0.1:{taken.getsockname()[1]}'
        assert main(['twin', '--out', str(tmp_path / 't'), '--executor', f'dask={address}']) == 1
    error = capsys.readouterr().err
    assert error.startswith(f'hooc: no Dask scheduler answers at {address!r}')
    assert error.count('\n') == 1 and not (tmp_path / 't').exists()


@pytest.mark.parametrize('text', ['', 'dask', 'dask=', 'spark=host', 'local=2'])
def test_another_executor_is_refused(text):
    with pytest.raises(HoocError, match='dask=ADDRESS'), executor(text):
        pass


@pytest.mark.parametrize('address', ['no such host:1', 'ftp://127.0.0.1:1', 'tcp://127.0.0.1'])
def test_an_impossible_address_is_one_sentence(address, monkeypatch):
    monkeypatch.setattr(module, 'CONNECT_S', 0.5)
    with pytest.raises(HoocError, match='no Dask scheduler answers'), executor(f'dask={address}'):
        pass


def test_without_the_library_the_mend_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(HoocError, match=r'hooc_perception\[dask\]'), executor('dask=tcp://x:1'):
        pass
