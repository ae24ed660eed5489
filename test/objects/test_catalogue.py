# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue: 25 watertight things of everyday size that a scene set can be made of."""

from hooc_perception.objects.catalogue import (
    CATALOGUE,
    FAMILIES,
    family_name,
    HELD_OUT,
    TRAINING,
    variant,
    write_catalogue,
)
from hooc_perception.objects.manifold import to_manifold
from hooc_perception.objects.mesh import load_mesh
import manifold3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import yaml

HOOC = {'teacup', 'frying_pan', 'banana', 'ball', 'spatula', 'tube', 'sellotape_core', 'stapler',
        'glass', 'jug', 'dustpan', 'tray'}
# Longest side, metres, of things that one finds in shops.
LONGEST = {
    'ball': (0.04, 0.12), 'banana': (0.14, 0.22), 'book': (0.17, 0.30), 'bottle': (0.18, 0.34),
    'bowl': (0.11, 0.26), 'box': (0.10, 0.32), 'can': (0.08, 0.17), 'drill': (0.15, 0.28),
    'dustpan': (0.25, 0.40), 'fork': (0.16, 0.22), 'frying_pan': (0.35, 0.52),
    'glass': (0.08, 0.17), 'hammer': (0.24, 0.36), 'jug': (0.15, 0.28), 'knife': (0.18, 0.26),
    'plate': (0.18, 0.31), 'scissors': (0.13, 0.24), 'screwdriver': (0.14, 0.28),
    'sellotape_core': (0.03, 0.10), 'spatula': (0.25, 0.38), 'spoon': (0.13, 0.22),
    'stapler': (0.10, 0.19), 'teacup': (0.08, 0.14), 'tray': (0.28, 0.50), 'tube': (0.15, 0.40)}


@pytest.fixture(scope='module')
def meshes():
    return {name: build() for name, build in CATALOGUE.items()}


def test_names():
    assert len(CATALOGUE) == 25 and HOOC <= set(CATALOGUE)
    assert set(CATALOGUE) == set(LONGEST)
    assert all(name.isidentifier() and name.islower() for name in CATALOGUE)


@pytest.mark.parametrize('name', list(CATALOGUE))
def test_each_is_one_sound_solid(meshes, name):
    mesh = meshes[name]
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0
    assert to_manifold(mesh).status() == manifold3d.Error.NoError
    assert mesh.body_count == 1
    assert len(mesh.faces) < 2500
    np.testing.assert_allclose(mesh.bounds.sum(axis=0), 0, atol=1e-7)


@pytest.mark.parametrize('name', list(CATALOGUE))
def test_sizes_are_those_of_everyday(meshes, name):
    low, high = LONGEST[name]
    assert low < meshes[name].extents.max() < high
    # Nothing on a table weighs more than water of 3 litres, or less than a gram of steel.
    assert 0.1e-6 < meshes[name].volume < 3e-3


@pytest.mark.parametrize('name', ['teacup', 'glass', 'jug', 'bowl', 'frying_pan', 'tray',
                                  'dustpan', 'sellotape_core', 'tube'])
def test_vessels_are_hollow(meshes, name):
    assert meshes[name].volume < 0.5 * meshes[name].convex_hull.volume


@pytest.mark.parametrize('name', ['teacup', 'jug'])
def test_handles_are_open(meshes, name):
    # One handle makes one hole: genus 1.
    assert to_manifold(meshes[name]).genus() == 1


def test_same_mesh_every_time(meshes):
    np.testing.assert_array_equal(CATALOGUE['jug']().vertices, meshes['jug'].vertices)


def test_written_as_a_scene_set(tmp_path, meshes):
    folder = write_catalogue(tmp_path / 'set')
    dataset = yaml.safe_load((folder / 'dataset.yaml').read_text())
    assert dataset['format'] == 'hooc-scenes/1' and len(dataset['categories']) == 25
    for category in dataset['categories']:
        mesh = load_mesh(folder / category['model'], category.get('scale', 1.0))
        assert mesh.is_watertight
        np.testing.assert_allclose(mesh.extents, meshes[category['name']].extents, rtol=1e-4)


def test_default_rig_looks_at_the_table(tmp_path):
    cameras = yaml.safe_load((write_catalogue(tmp_path) / 'cameras.yaml').read_text())
    positions = []
    for camera in cameras.values():
        pose = camera['world_from_camera']
        R_world_camera = Rotation.from_quat(pose['rotation_xyzw']).as_matrix()
        position, forward, down = np.array(pose['translation']), *R_world_camera.T[[2, 1]]
        positions.append(position)
        # The optical axis meets the table near its middle, and down in the image is down.
        meets = position - forward * position[2] / forward[2]
        assert np.linalg.norm(meets) < 0.10
        assert 35 <= np.degrees(np.arcsin(-forward[2])) <= 40 and down[2] < 0
        assert 1.0 < np.linalg.norm(position) < 1.2
        assert (camera['width'], camera['height']) == (512, 424)
    sides = [np.linalg.norm(positions[i] - positions[i - 1]) for i in range(3)]
    np.testing.assert_allclose(sides, sides[0], rtol=1e-4)


@pytest.mark.parametrize('name', list(FAMILIES))
def test_every_member_of_a_family_is_one_sound_solid(name):
    rng = np.random.default_rng(len(name))
    for style in range(len(FAMILIES[name])):
        for draw in (None, rng):
            mesh = variant(name, style, draw)
            assert mesh.is_watertight and mesh.volume > 0, style
            assert to_manifold(mesh).status() == manifold3d.Error.NoError
            assert 0.02 < mesh.extents.max() < 1.0 and len(mesh.faces) < 2500
            np.testing.assert_allclose(mesh.bounds.sum(axis=0), 0, atol=1e-7)


def test_a_seed_gives_one_member_and_other_seeds_others():
    a, b, c = (variant('jug', 1, np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a.vertices, b.vertices)
    assert np.abs(a.extents / c.extents - 1).max() > 0.01


def test_training_and_the_twin_share_no_style():
    for name, styles in FAMILIES.items():
        assert len(styles) >= 9 and len(TRAINING[name]) >= 6 and len(HELD_OUT[name]) >= 3
        assert sorted(TRAINING[name] + HELD_OUT[name]) == list(range(len(styles)))
        assert 0 in TRAINING[name]


def test_other_names_of_a_family():
    assert family_name('Mug') == family_name('coffee cup') == 'teacup'
    assert family_name('frying-pan') == 'frying_pan' and family_name('unicorn') is None
