# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A small rendered scene set with a truth, and results made from it."""

import importlib.util
from pathlib import Path

from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.evaluate import scoring_models
from hooc_perception.evaluation.matching import posed
from hooc_perception.evaluation.report.scene import report_scene
from hooc_perception.io.scenes.scene_set import (
    load_scene_set,
    NewScene,
    TrueObject,
    write_scene_set,
)
from hooc_perception.synthesis.rigs import look_at
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

CATEGORIES = {'ball': trimesh.creation.icosphere(2, 0.04),
              'box': trimesh.creation.box((0.16, 0.10, 0.06)),
              'can': trimesh.creation.cylinder(0.03, 0.12, sections=24)}


def looking_at_origin(name, azimuth, distance=0.9, elevation=0.7, width=160, height=120):
    """Return a Camera on a circle around the table that looks at its middle."""
    eye = distance * np.array([np.cos(azimuth) * np.cos(elevation),
                               np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    K = np.array([[150.0, 0, 79.5], [0, 150.0, 59.5], [0, 0, 1]])
    return Camera(name, width, height, K, np.zeros(5), look_at(eye, np.zeros(3)))


def true_object(category, x, y, z, yaw=0.0, size=None):
    """Return a TrueObject, as large as its generic model unless `size` says otherwise."""
    return TrueObject(category, np.array([x, y, z]),
                      Rotation.from_euler('z', yaw).as_quat(),
                      np.array(CATEGORIES[category].extents if size is None else size))


TRUTHS = {
    '10_1': (true_object('ball', 0.10, 0.0, 0.04), true_object('box', -0.05, 0.06, 0.03, 0.4),
             true_object('can', -0.04, -0.1, 0.06)),
    '10_2': (true_object('box', 0.0, 0.0, 0.035, 1.1, (0.18, 0.09, 0.07)),
             true_object('can', 0.0, 0.0, 0.13))}


@pytest.fixture(scope='session')
def tiny_path(tmp_path_factory):
    """Return the folder of a set: two scenes with poses, one with labels only, one with none."""
    cameras = (looking_at_origin('left', 0.3), looking_at_origin('right', 2.4))
    folder = tmp_path_factory.mktemp('tiny') / 'set'

    def rendered(truth):
        meshes = []
        for true in truth:
            generic = CATEGORIES[true.category]
            scale = true.size / generic.extents
            R = Rotation.from_quat(true.rotation_xyzw).as_matrix()
            meshes.append((generic.vertices * scale @ R.T + true.translation,
                           np.asarray(generic.faces, np.int32)))
        ground = 1.5 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]]) / 2.5
        meshes.append((ground, np.array([[0, 1, 2], [0, 2, 3]], np.int32)))
        drawn = [render_depth(meshes, camera) for camera in cameras]
        return ([np.where(np.isfinite(d), d, np.nan) for d, _ in drawn],
                [np.where(i == len(truth), 0, i + 1).astype(np.uint8) for _, i in drawn])

    scenes = []
    for name, truth in TRUTHS.items():
        scenes.append(NewScene(name, tuple(rendered(truth)[0]), truth))
    depth, labels = rendered(TRUTHS['10_1'])
    scenes.append(NewScene('labelled', tuple(depth), None, {'left': labels[0]}))
    scenes.append(NewScene('nobody', tuple(depth)))
    return write_scene_set(folder, 'tiny', CATEGORIES, cameras, scenes, 1)


@pytest.fixture(scope='session')
def tiny(tiny_path):
    """Return the SceneSet."""
    return load_scene_set(tiny_path)


@pytest.fixture(scope='session')
def models(tiny):
    """Return {category: GenericModel}."""
    return scoring_models(tiny)


def entry(thing, score=1.0):
    """Return the results entry of a TrueObject or PosedObject."""
    return {'category': thing.category, 'score': score,
            'translation': np.asarray(thing.translation).tolist(),
            'rotation_xyzw': np.asarray(thing.rotation_xyzw).tolist(),
            'size': np.asarray(thing.size).tolist()}


@pytest.fixture
def truth_results():
    """Return results (a dict) that say exactly what is there."""
    energy = {'total': 1.3, 'depth': 0.5, 'probability': 0.79, 'overlap': 0.01}
    scenes = [{'scene': name, 'seconds': 2.0, 'energy': energy, 'objects': [*map(entry, truth)]}
              for name, truth in TRUTHS.items()]
    scenes.append({'scene': 'labelled', 'seconds': 1.0, 'energy': None,
                   'objects': [*map(entry, TRUTHS['10_1'])]})
    return {'format': 'hooc-results/1', 'dataset': 'tiny', 'scenes': scenes}


@pytest.fixture
def scene(tiny, models, truth_results):
    """Return a ReportScene whose last object is missing, so that its points stay unexplained."""
    entry = next(e for e in truth_results['scenes'] if e['scene'] == '10_1')
    entry['objects'].pop()
    entry['objects'][0] |= {'visible_ratio': 0.8, 'residual_m': 0.004, 'n_views': 2}
    source = tiny.scene('10_1')
    return report_scene(entry, source.depth(), models, source.truth)


@pytest.fixture
def posed_truths():
    """Return {scene: [PosedObject]}."""
    return {name: [posed(t) for t in truth] for name, truth in TRUTHS.items()}


@pytest.fixture
def make_mesh(models):
    """Return a function: PosedObject -> (vertices, faces) in the world."""
    return lambda thing: world_mesh(thing, models[thing.category])


@pytest.fixture(scope='session')
def browser_module():
    """Return browser.py."""
    spec = importlib.util.spec_from_file_location('browser',
                                                  Path(__file__).with_name('browser.py'))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
