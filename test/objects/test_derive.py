# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What is derived from a mesh: samples, volume, resting poses, symmetry."""

from hooc_perception.objects.catalogue import CATALOGUE
from hooc_perception.objects.derive import derive, MAX_FACES, sample_interior
from hooc_perception.objects.manifold import from_manifold, to_manifold
from hooc_perception.objects.mesh import load_mesh
from hooc_perception.objects.symmetry import axis_symmetry, equivalent_directions
import manifold3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh


def _derived(mesh, seed=0):
    return derive('thing', mesh, np.random.default_rng(seed))


def _check(model):
    """Assert what holds for every GenericModel."""
    assert model.surface_points.shape == model.surface_normals.shape == (2048, 3)
    assert model.interior_points.shape == (512, 3)
    for array in (model.surface_points, model.surface_normals, model.interior_points):
        assert array.dtype == np.float32 and np.isfinite(array).all()
    assert model.faces.dtype == np.int32 and model.symmetry.dtype == np.int32
    np.testing.assert_allclose(model.vertices.min(0), -model.extents / 2, atol=1e-9)
    np.testing.assert_allclose(model.vertices.max(0), model.extents / 2, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(model.surface_normals, axis=1), 1, atol=1e-5)
    assert (np.abs(model.interior_points) <= model.extents / 2 + 0.0015).all()
    assert 0 < model.volume <= np.prod(model.extents + 0.003)
    assert 1 <= len(model.rest_rotations) == len(model.rest_probability) <= 12
    np.testing.assert_allclose(np.linalg.norm(model.rest_rotations, axis=1), 1)
    assert (np.diff(model.rest_probability) <= 0).all()
    assert 0.5 < model.rest_probability.sum() <= 1 + 1e-9
    upright = np.isclose(np.abs(model.rest_rotations[:, 3]), 1)
    assert upright.sum() == 1 and model.rest_probability[upright][0] >= 0.05


def _with_manifold(model, solid):
    """Return the share of the interior points that manifold3d finds inside a solid."""
    dust = [manifold3d.Manifold.cube((2e-6,) * 3, True).translate(p.tolist())
            for p in model.interior_points[::8].astype(float)]
    kept = manifold3d.Manifold.compose(dust) ^ to_manifold(solid)
    return kept.volume() / (len(dust) * 8e-18)


@pytest.mark.parametrize('name', list(CATALOGUE))
def test_every_category_is_derived(name):
    mesh = CATALOGUE[name]()
    model = _derived(mesh)
    _check(model)
    assert model.volume == pytest.approx(to_manifold(mesh).volume(), rel=1e-6)
    assert _with_manifold(model, mesh) > 0.97


def test_models_of_the_recorded_sets(shared_scenes):
    for path in sorted((shared_scenes / 'dev' / 'models').glob('*.ply')):
        _check(_derived(load_mesh(path)))


def test_same_seed_same_model():
    mesh = CATALOGUE['jug']()
    a, b, c = _derived(mesh, 3), _derived(mesh, 3), _derived(mesh, 4)
    for key in vars(a):
        np.testing.assert_array_equal(getattr(a, key), getattr(b, key))
    assert not np.array_equal(a.surface_points, c.surface_points)


def test_normals_point_out_of_a_ball():
    ball = trimesh.creation.icosphere(3, 0.05)
    ball.invert()
    model = _derived(ball)
    outward = np.einsum('ij,ij->i', model.surface_points, model.surface_normals)
    assert (outward > 0.04).all()


def test_interior_points_are_uniform():
    # In a ball of radius R the mean squared distance from the centre is 3/5 R^2, and half of
    # the volume lies within R / 2^(1/3).
    ball = trimesh.creation.icosphere(4, 0.05)
    points, doubled = sample_interior(ball, 4000, np.random.default_rng(0))
    r = np.linalg.norm(points, axis=1)
    assert doubled == pytest.approx(1.0, abs=1e-6)
    assert (r**2).mean() == pytest.approx(0.6 * 0.05**2, rel=0.03)
    assert (r < 0.05 / 2 ** (1 / 3)).mean() == pytest.approx(0.5, abs=0.03)
    np.testing.assert_allclose(points.mean(0), 0, atol=0.002)


def test_volume_that_a_surface_shares_with_itself_counts_once():
    a, b = trimesh.creation.box((0.1,) * 3), trimesh.creation.box((0.1,) * 3)
    b.apply_translation((0.05, 0.0, 0.0))
    _, doubled = sample_interior(trimesh.util.concatenate([a, b]), 10, np.random.default_rng(0))
    assert 2e-3 / doubled == pytest.approx(1.5e-3, rel=0.01)


def test_large_meshes_are_simplified():
    ball = trimesh.creation.icosphere(5, 0.05)
    assert len(ball.faces) > 3 * MAX_FACES
    model = _derived(ball)
    _check(model)
    assert len(model.faces) <= MAX_FACES
    assert model.volume == pytest.approx(ball.volume, rel=0.01)


@pytest.mark.parametrize('name, expected', [
    ('ball', (0, 0, 0)), ('glass', (1, 1, 0)), ('bottle', (1, 1, 0)), ('bowl', (1, 1, 0)),
    ('plate', (1, 1, 0)), ('box', (2, 2, 2)), ('can', None), ('teacup', (1, 1, 1)),
    ('jug', (1, 1, 1)), ('frying_pan', (1, 1, 1)), ('drill', (1, 1, 1)),
    ('sellotape_core', (2, 2, 0)), ('tube', (2, 0, 2)), ('tray', (1, 1, 2)),
    ('dustpan', (1, 1, 1)), ('spatula', (1, 1, 1))])
def test_symmetry_of_the_catalogue(name, expected):
    symmetry = _derived(CATALOGUE[name]()).symmetry
    if name == 'can':
        assert symmetry[2] == 0
    else:
        assert tuple(symmetry) == expected


@pytest.mark.parametrize('lobes, expected', [(2, 2), (3, 3), (4, 4), (6, 6), (40, 0)])
def test_order_of_a_gear(lobes, expected):
    angle = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    radius = 0.05 + 0.012 * np.cos(lobes * angle) * (lobes < 40)
    gear = manifold3d.CrossSection([np.column_stack([radius * np.cos(angle),
                                                     radius * np.sin(angle)])])
    mesh = from_manifold(gear.extrude(0.2).translate((0.0, 0.0, -0.1)))
    assert axis_symmetry(mesh, np.random.default_rng(0))[2] == expected


def test_symmetry_does_not_hang_on_the_seed():
    for name in ('teacup', 'box', 'can', 'stapler'):
        mesh = CATALOGUE[name]()
        found = {tuple(axis_symmetry(mesh, np.random.default_rng(seed))) for seed in range(8)}
        assert len(found) == 1, name


def test_equivalent_directions_of_a_box_and_a_bottle():
    d = np.array([0.6, 0.0, 0.8])
    assert len(equivalent_directions(d, (1, 1, 1))) == 1
    box = equivalent_directions(d, (2, 2, 2))
    assert len(box) == 4
    np.testing.assert_allclose(np.abs(box), np.abs(np.tile(d, (4, 1))), atol=1e-5)
    around = equivalent_directions(d, (1, 1, 0))
    assert len(around) == 72
    np.testing.assert_allclose(around[:, 2], 0.8, atol=1e-5)


def test_a_box_rests_on_three_kinds_of_faces():
    model = _derived(trimesh.creation.box((0.05, 0.10, 0.20)))
    ups = Rotation.from_quat(model.rest_rotations).inv().apply((0, 0, 1))
    # The broad side first; the upright pose last, though it is rare.
    np.testing.assert_allclose(np.abs(ups), np.eye(3), atol=1e-6)


def test_a_cylinder_lies_or_stands():
    model = _derived(trimesh.creation.cylinder(0.03, 0.12, sections=40))
    ups = Rotation.from_quat(model.rest_rotations).inv().apply((0, 0, 1))
    assert len(ups) == 2
    assert abs(ups[0, 2]) < 0.01 and ups[1, 2] == pytest.approx(1.0)


def test_a_ball_rests_in_one_way():
    model = _derived(trimesh.creation.icosphere(3, 0.05))
    np.testing.assert_array_equal(model.rest_rotations, [[0, 0, 0, 1]])


def test_upright_is_offered_where_it_is_not_stable():
    # A cone on its tip would never stand, but users may declare so.
    cone = trimesh.creation.cone(0.03, 0.12)
    cone.apply_transform(trimesh.transformations.rotation_matrix(np.pi, (1, 0, 0)))
    _check(_derived(cone))


def test_open_vessel_is_derived():
    can = trimesh.creation.cylinder(0.04, 0.1, sections=64)
    keep = can.face_normals[:, 2] < 0.5
    model = _derived(trimesh.Trimesh(can.vertices, can.faces[keep], process=True))
    _check(model)
    inner = np.linalg.norm(model.interior_points[:, :2], axis=1) < 0.037
    assert (model.interior_points[inner, 2] < -0.045).all()
