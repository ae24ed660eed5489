# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A small set with real scores, and a stand-in for the commands that take long."""

import json

from hooc_perception.cli.main import main as hooc
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera
from hooc_perception.experiments import fingerprint, plan, run
from hooc_perception.experiments.ablations import UNVERIFIED
from hooc_perception.io.scenes.scene_set import NewScene, TrueObject, write_scene_set
import numpy as np
import pytest
import trimesh

MESHES = {'box': trimesh.creation.box((0.16, 0.10, 0.06)),
          'can': trimesh.creation.cylinder(0.03, 0.12, sections=24)}
TRUTH = (TrueObject('box', np.array([0.1, 0.0, 0.03]), np.array([0, 0, 0, 1.0]),
                    np.array([0.16, 0.10, 0.06])),
         TrueObject('can', np.array([-0.1, 0.0, 0.06]), np.array([0, 0, 0, 1.0]),
                    np.array([0.06, 0.06, 0.12])))


@pytest.fixture(scope='module')
def scene_set(tmp_path_factory):
    """Return the folder of a set with one scene, seen from above."""
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[2, 3] = 0.9
    K = np.array([[150.0, 0, 79.5], [0, 150.0, 59.5], [0, 0, 1]])
    camera = Camera('top', 160, 120, K, np.zeros(5), T)
    ground = 0.5 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    meshes = [(MESHES[t.category].vertices + t.translation,
               np.asarray(MESHES[t.category].faces, np.int32)) for t in TRUTH]
    meshes.append((ground, np.array([[0, 1, 2], [0, 2, 3]], np.int32)))
    depth = render_depth(meshes, camera)[0]
    depth = np.where(np.isfinite(depth), depth, np.nan)
    folder = tmp_path_factory.mktemp('sets') / 'small'
    return write_scene_set(folder, 'small', MESHES, (camera,),
                           [NewScene('one', (depth,), TRUTH)], 1)


@pytest.fixture
def ran(monkeypatch):
    """Put in place of the commands what writes their arguments; return the names that ran."""
    names = []

    def execute(step, root):
        names.append(step.name)
        step.output.parent.mkdir(parents=True, exist_ok=True)
        if step.kind in ('twin', 'train', 'plots', 'worst'):
            step.output.mkdir(exist_ok=True)
            (step.output / 'file').write_text(step.name)
        else:
            step.output.write_text(step.name)
        return run.Record(run.key_of(step), fingerprint.of_code(plan.CODE[step.kind]), 'abc',
                          1.0, 2.0, 3.0)

    monkeypatch.setattr(run, 'execute', execute)
    return names


@pytest.fixture
def write_scores(tmp_path, scene_set):
    """Return a function: score the truth, moved along x, as the answer of a row."""
    root = tmp_path / 'results'

    def objects(shift):
        return [{'category': t.category, 'score': 1.0, 'size': t.size.tolist(),
                 'translation': (t.translation + [shift, 0, 0]).tolist(),
                 'rotation_xyzw': t.rotation_xyzw.tolist()} for t in TRUTH]

    def write(row, shift, settings='A', *options):
        layout, files = plan.Layout(root, 'small'), []
        for setting in settings:
            files.append(layout.results(row, setting))
            files[-1].parent.mkdir(parents=True, exist_ok=True)
            files[-1].write_text(json.dumps({
                'format': 'hooc-results/1', 'dataset': 'small', 'setting': setting[0],
                'scenes': [{'scene': 'one', 'seconds': 2.0, 'energy': None,
                            'objects': objects(shift)}]}))
        assert hooc(['evaluate', str(scene_set), *map(str, files), '--json',
                     str(layout.scores(row)), *map(str, options)]) == 0
        return root

    return write


@pytest.fixture
def computed(write_scores, tmp_path):
    """Return a folder with real scores: the truth as the answer of best, spoilt as ppf's."""
    plots = plan.Layout(tmp_path / 'results', 'small').plots
    write_scores('best', 0.0, ('A', 'B', UNVERIFIED), '--bop', '--plots', plots)
    return write_scores('ppf', 0.07, 'A', '--bop', '--plots', plots)
