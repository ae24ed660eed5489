# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc train` from meshes to a MODEL folder that classifies, with tiny settings."""

from dataclasses import dataclass, replace

from hooc_perception.cli import main
from hooc_perception.core.classification.classify import classify
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.parsing.verifier import FEATURES, Verifier
from hooc_perception.core.segment.observe import observe
from hooc_perception.errors import HoocError
from hooc_perception.synthesis.rigs import ring
from hooc_perception.synthesis.training_scenes import training_scene
from hooc_perception.trained.folder import load_model_folder
from hooc_perception.training import train as module
from hooc_perception.training.fit_forest import FitConfig
from hooc_perception.training.fit_pixels import PixelFitConfig
from hooc_perception.training.fit_verifier import VerifierConfig
from hooc_perception.training.fused_scenes import draw_rows, FusedScenesConfig
import numpy as np
import pytest
import trimesh

TINY = {
    'paper': (PixelFitConfig(structure_scenes=10, leaf_scenes=10, trees=2, structure_pixels=150,
                             leaf_pixels=300, tests_per_node=60),),
    'fast': (FusedScenesConfig(scenes=10, quantile_scenes=4, objects_low=3, probes=16),
             FitConfig(trees=5, features_per_node=40, min_leaf=5),
             VerifierConfig(verifier_scenes=4, unfamiliar_scenes=2,
                            forest=FitConfig(trees=4, features_per_node=9))),
}


@dataclass
class MeshSet:
    """A scene set without scenes: reading them would raise AttributeError."""

    path: object
    name: str
    categories: tuple
    cameras: tuple
    max_instances: int = 1


@dataclass
class MeshCategory:
    """As scenes.Category."""

    name: str
    mesh_path: object
    scale: float = 1.0
    variant_paths: tuple = ()
    up: object = None


@pytest.fixture(scope='module')
def mesh_set(tmp_path_factory):
    folder = tmp_path_factory.mktemp('meshes')
    shapes = {'can': trimesh.creation.cylinder(0.035, 0.12),
              'plate': trimesh.creation.cylinder(0.11, 0.02),
              'box': trimesh.creation.box((0.07, 0.15, 0.2))}
    for name, mesh in shapes.items():
        mesh.export(folder / f'{name}.ply')
    return MeshSet(folder, 'tiny', tuple(MeshCategory(n, folder / f'{n}.ply') for n in shapes),
                   ring(np.random.default_rng(0), 2, 256, 212, 183.0), 2)


@pytest.fixture(scope='module', params=list(TINY))
def trained(request, mesh_set, tmp_path_factory):
    out = tmp_path_factory.mktemp('models') / request.param
    return module.train(mesh_set, out, request.param, seed=3, progress=False,
                        configs=TINY[request.param], jobs=1)


def test_the_folder_holds_what_was_learnt(trained, mesh_set):
    again = load_model_folder(trained.path)
    assert [m.name for m in again.models] == ['can', 'plate', 'box']
    assert again.profile in TINY and again.seed == 3 and again.max_instances == 2
    assert int(again.classifier['classes']) == 3
    assert '"seed": 3' in str(again.classifier['settings'])


def test_it_tells_plain_shapes_apart_in_fresh_scenes(trained, mesh_set):
    right = []
    for k in range(4):
        scene = training_scene(trained.models, mesh_set.cameras, stage_rng(99, 'fresh', k))
        result = classify(observe(scene.views), trained.classifier)
        truth = np.array([scene.labels[c][v, u]
                          for c, (u, v) in zip(result.camera, result.uv)])
        right.append((result.p.argmax(1) == truth)[truth > 0])
    assert np.concatenate(right).mean() > 0.65


def test_same_seed_same_model_whatever_the_workers(trained, mesh_set):
    again = module.train_classifier(trained.models, mesh_set.cameras, trained.profile, 3, 2,
                                    TINY[trained.profile], jobs=2)
    assert set(again) == set(trained.classifier)
    for key, value in again.items():
        assert np.array_equal(value, trained.classifier[key]), key


def test_a_verifier_is_learned_where_the_profile_has_one(trained):
    verifier = Verifier.from_arrays(trained.classifier)
    if trained.profile == 'paper':
        assert verifier is None
        return
    x = np.random.default_rng(0).normal(size=(50, len(FEATURES))).astype(np.float32)
    p = verifier.probability(x)
    assert ((p >= 0) & (p <= 1)).all() and np.ptp(p) > 0
    # How the objects of one category look in training is not to be learned.
    other = x.copy()
    other[:, FEATURES.index('category')] *= -1
    np.testing.assert_array_equal(verifier.probability(other), p)


def test_rows_favour_small_classes():
    y = np.repeat([0, 1, 2], [10000, 100, 4])
    rows = draw_rows(y, np.random.default_rng(0), 2.0)
    assert (np.bincount(y[rows]) == [200, 20, 4]).all() and (np.diff(rows) > 0).all()


def test_every_mesh_of_a_category_is_derived(mesh_set):
    can, plate, box = mesh_set.categories
    alone = module.generic_models(mesh_set, 3)
    bins = replace(box, variant_paths=(can.mesh_path, plate.mesh_path), scale=0.5)
    models = module.generic_models(replace(mesh_set, categories=(can, bins)), 3)
    assert [[m.name for m in model.members] for model in models] == [['can'], ['box'] * 3]
    for member, extents in zip(models[1].members, (
            (0.07, 0.15, 0.2), (0.07, 0.07, 0.12), (0.22, 0.22, 0.02))):
        np.testing.assert_allclose(member.extents, np.array(extents) / 2, rtol=0.01)
    # A variant changes nothing about the generic models.
    np.testing.assert_array_equal(models[0].surface_points, alone[0].surface_points)


def test_bad_input_is_named(mesh_set, tmp_path):
    with pytest.raises(HoocError, match='profile'):
        module.train(mesh_set, tmp_path, 'slow')
    empty = MeshSet(mesh_set.path, 'none', (), mesh_set.cameras)
    with pytest.raises(HoocError, match='no categories'):
        module.train(empty, tmp_path, 'fast')
    blind = MeshSet(mesh_set.path, 'none', mesh_set.categories, ())
    with pytest.raises(HoocError, match='no cameras'):
        module.train(blind, tmp_path, 'fast')


def test_the_command_refuses_a_missing_set(tmp_path, capsys):
    assert main.main(['train', str(tmp_path / 'nothing'), '--out', str(tmp_path / 'm')]) != 0
    assert 'nothing' in capsys.readouterr().err
