# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings for the Rerun viewer: what is logged, and a real file where the SDK is there."""

from dataclasses import replace
import json
from pathlib import Path
import subprocess
import sys
from types import ModuleType, SimpleNamespace

from hooc_perception.cli.main import main
from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.errors import HoocError
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.report.recording import write_recording
import numpy as np
import pytest


class Recording:
    """What a RecordingStream was told."""

    def __init__(self, title):
        self.title, self.logged, self.now, self.path = title, [], None, None

    def save(self, path, default_blueprint):
        self.path, self.blueprint = Path(path), default_blueprint

    def set_time(self, timeline, sequence):
        self.now = timeline, sequence

    def log(self, entity, what, static=False):
        self.logged.append((None if static else self.now, entity, what))

    def flush(self):
        self.path.write_bytes(b'RRF2')

    def disconnect(self):
        pass

    def all(self, kind, sequence=0):
        """Return {entity: archetype} of a kind at a number of the timeline."""
        return {entity: what for now, entity, what in self.logged
                if now == ('scene', sequence) and what.kind == kind}


@pytest.fixture
def recordings(monkeypatch):
    """Return the recordings that a stand-in for the SDK was asked for."""
    def archetype(kind):
        return lambda *args, **given: SimpleNamespace(kind=kind, args=args, **given)

    made = []
    sdk, blueprint = ModuleType('rerun'), ModuleType('rerun.blueprint')
    sdk.RecordingStream = lambda title: made.append(Recording(title)) or made[-1]
    sdk.ViewCoordinates = SimpleNamespace(
        RDF='RDF', RIGHT_HAND_Z_UP=SimpleNamespace(kind='ViewCoordinates'))
    for kind in ('AnyValues', 'Clear', 'DepthImage', 'Mesh3D', 'Pinhole', 'Points3D',
                 'TextDocument', 'Transform3D'):
        setattr(sdk, kind, archetype(kind))
    for kind in ('Blueprint', 'Horizontal', 'Spatial2DView', 'Spatial3DView', 'TextDocumentView',
                 'Vertical'):
        setattr(blueprint, kind, archetype(kind))
    sdk.blueprint = blueprint
    monkeypatch.setitem(sys.modules, 'rerun', sdk)
    monkeypatch.setitem(sys.modules, 'rerun.blueprint', blueprint)
    return made


@pytest.fixture
def no_sdk(monkeypatch):
    monkeypatch.setitem(sys.modules, 'rerun', None)


def test_objects_and_truth_stand_where_they_are(scene, recordings, tmp_path):
    path = write_recording(tmp_path / 'new' / 'x.rrd', [scene])
    assert [p.name for p in path.parent.iterdir()] == ['x.rrd']
    meshes = recordings[0].all('Mesh3D')
    for group, things in (('objects', scene.objects), ('truth', scene.truth)):
        assert sum(entity.startswith(f'world/{group}/') for entity in meshes) == len(things)
        for i, thing in enumerate(things):
            mesh = meshes[f'world/{group}/{thing.category}/{i}']
            vertices, faces = world_mesh(thing, scene.models[thing.category])
            np.testing.assert_allclose(mesh.vertex_positions, vertices)
            np.testing.assert_array_equal(mesh.triangle_indices, faces)
    first = f'world/objects/{scene.objects[0].category}/0'
    values = recordings[0].all('AnyValues')
    assert vars(values[first]) == {'kind': 'AnyValues', 'args': (), 'score': 1.0, 'n_views': 2,
                                   'visible_ratio': 0.8, 'residual_m': 0.004}
    name = recordings[0].all('Points3D')[f'{first}/name']
    assert name.labels == [scene.objects[0].category]
    np.testing.assert_allclose(name.args[0][0], scene.objects[0].translation)


def test_cameras_see_the_points_that_are_shown(scene, recordings, tmp_path):
    write_recording(tmp_path / 'x.rrd', [scene])
    poses, lenses, depths, points = (recordings[0].all(kind) for kind in (
        'Transform3D', 'Pinhole', 'DepthImage', 'Points3D'))
    for view in scene.observation.views:
        place = f'world/cameras/{view.camera.name}'
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = poses[place].mat3x3, poses[place].translation
        np.testing.assert_allclose(T, view.camera.T_world_camera)
        np.testing.assert_allclose(lenses[place].image_from_camera, view.camera.K)
        assert lenses[place].resolution == [view.camera.width, view.camera.height]
        image = depths[f'{place}/depth']
        assert np.isfinite(image.args[0]).all() and image.meter == 1.0
        np.testing.assert_array_equal(image.args[0] > 0, np.isfinite(view.depth))
    # What is left unexplained is the object that was taken away.
    left = points['world/points/unexplained'].args[0]
    T = matrix_from_pose(scene.truth[-1].translation, scene.truth[-1].rotation_xyzw)
    local = (left - T[:3, 3]) @ T[:3, :3]
    assert len(left) > 30
    assert (np.abs(local) < 0.5 * np.array(scene.truth[-1].size) + 0.02).all(1).mean() > 0.7
    assert len(points['world/points/explained'].args[0]) > 100
    for group in ('table', 'explained', 'unexplained'):
        shown = points[f'world/points/{group}']
        assert len(shown.colors) == len(shown.args[0]) and shown.colors.dtype == np.uint8


def test_each_scene_takes_away_the_one_before(scene, recordings, tmp_path):
    bare = replace(scene, name='bare', objects=(), truth=None, evidence=())
    write_recording(tmp_path / 'x.rrd', [scene, bare])
    for number, name in enumerate((scene.name, 'bare')):
        at = [(entity, what) for now, entity, what in recordings[0].logged
              if now == ('scene', number)]
        assert at[0][0] == 'world' and at[0][1].kind == 'Clear' and at[0][1].recursive
        assert recordings[0].all('TextDocument', number)['name'].args == (name,)
    assert not recordings[0].all('Mesh3D', 1)


def test_without_the_sdk_one_sentence_says_what_to_install(scene, no_sdk, tmp_path):
    with pytest.raises(HoocError, match='pip install rerun-sdk'):
        write_recording(tmp_path / 'x.rrd', [scene])
    assert not list(tmp_path.iterdir())


def test_report_asks_for_the_sdk_before_it_draws(tiny_path, truth_results, no_sdk, tmp_path,
                                                 capsys):
    results = tmp_path / 'truth.json'
    results.write_text(json.dumps(truth_results))
    command = ['report', str(results), '--set', str(tiny_path), '--out', str(tmp_path / 'page')]
    assert main([*command, '--rerun', str(tmp_path / 'x.rrd')]) == 1
    assert 'rerun-sdk' in capsys.readouterr().err and not (tmp_path / 'page').exists()


def test_report_writes_page_and_recording(tiny_path, truth_results, recordings, tmp_path, capsys):
    results = tmp_path / 'truth.json'
    results.write_text(json.dumps(truth_results))
    assert main(['report', str(results), '--set', str(tiny_path), '--out', str(tmp_path),
                 '--rerun', str(tmp_path / 'x.rrd')]) == 0
    out = capsys.readouterr().out
    assert 'report.html: 3 scenes' in out and 'x.rrd: 3 scenes' in out
    assert len(recordings[0].all('Mesh3D', 1)) == 4


def test_a_real_recording_holds_every_entity(scene, tmp_path):
    pytest.importorskip('rerun', reason='rerun-sdk is not installed')
    path = write_recording(tmp_path / 'x.rrd', [scene, scene])
    assert path.stat().st_size > 100_000
    told = subprocess.run([sys.executable, '-m', 'rerun', 'rrd', 'print', str(path)], check=True,
                          capture_output=True, text=True).stdout
    cameras = [view.camera.name for view in scene.observation.views]
    for entity in (*(f'cameras/{name}/depth' for name in cameras), 'points/unexplained', *(
            f'{group}/{thing.category}/{i}' for group, things in (
                ('objects', scene.objects), ('truth', scene.truth))
            for i, thing in enumerate(things))):
        assert f'/world/{entity} ' in told, entity
