# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Solids from broken meshes; volumes are held against formulas and manifold3d."""

from hooc_perception.objects.catalogue import CATALOGUE
from hooc_perception.objects.manifold import SHEET_M, to_manifold
from hooc_perception.objects.repair import closed
import manifold3d
import numpy as np
import pytest
import trimesh

R, HEIGHT = 0.04, 0.10


def _ball():
    return trimesh.creation.icosphere(3, R)


def _without(mesh, keep):
    out = trimesh.Trimesh(mesh.vertices, mesh.faces[keep], process=False)
    out.remove_unreferenced_vertices()
    return out


def _solid(mesh):
    """Return closed(mesh) after the checks that hold for every mesh."""
    solid = closed(mesh)
    assert solid.is_watertight and solid.is_winding_consistent and solid.volume > 0
    assert to_manifold(solid).status() == manifold3d.Error.NoError
    np.testing.assert_allclose(solid.bounds, mesh.bounds, atol=0.12 * mesh.extents.max())
    return solid


def _holds(solid, point):
    """Tell by manifold3d whether a point lies inside a solid."""
    probe = manifold3d.Manifold.sphere(1e-4, 8).translate(point)
    return (to_manifold(solid) ^ probe).volume() > 0


def test_a_sound_mesh_keeps_its_volume():
    assert _solid(_ball()).volume == pytest.approx(_ball().volume, rel=1e-9)


def test_inside_out_is_turned():
    ball = _ball()
    ball.invert()
    assert ball.volume < 0
    assert _solid(ball).volume == pytest.approx(-ball.volume, rel=1e-9)


def test_faces_of_mixed_winding():
    ball = _ball()
    faces = ball.faces.copy()
    flip = np.random.default_rng(0).random(len(faces)) < 0.5
    faces[flip] = faces[flip, ::-1]
    mixed = trimesh.Trimesh(ball.vertices, faces, process=False)
    assert _solid(mixed).volume == pytest.approx(ball.volume, rel=1e-9)


def test_small_holes_are_closed():
    ball = _ball()
    keep = np.ones(len(ball.faces), bool)
    keep[[3, 4, 500, 900]] = False
    assert _solid(_without(ball, keep)).volume == pytest.approx(ball.volume, rel=0.01)


def _sheet_cup():
    """Return a cylinder without lid and thickness, its middle at the origin."""
    can = trimesh.creation.cylinder(R, HEIGHT, sections=64)
    return _without(can, can.face_normals[:, 2] < 0.5)


@pytest.mark.parametrize('inside_out', [False, True])
def test_an_open_vessel_keeps_its_cavity(inside_out):
    cup = _sheet_cup()
    if inside_out:
        cup.invert()
    solid = _solid(cup)
    assert solid.volume == pytest.approx(cup.area * SHEET_M, rel=0.1)
    assert not _holds(solid, (0, 0, 0)) and not _holds(solid, (0, 0, 0.03))
    assert _holds(solid, (0, 0, -HEIGHT / 2)) and _holds(solid, (R * 0.999, 0, 0))


def test_a_tube_of_paper_stays_hollow():
    can = trimesh.creation.cylinder(R, HEIGHT, sections=64)
    tube = _without(can, np.abs(can.face_normals[:, 2]) < 0.5)
    solid = _solid(tube)
    assert solid.volume == pytest.approx(tube.area * SHEET_M, rel=0.1)
    assert not _holds(solid, (0, 0, 0.02))


def test_a_double_wall_without_rim_is_filled_between():
    whole = trimesh.creation.annulus(R - 0.005, R, HEIGHT, sections=64)
    top = whole.triangles_center[:, 2] > HEIGHT / 2 - 1e-6
    solid = _solid(_without(whole, ~top))
    assert solid.volume == pytest.approx(whole.volume, rel=0.02)
    assert _holds(solid, (R - 0.0025, 0, 0)) and not _holds(solid, (0, 0, 0))


def test_parts_that_overlap_count_once():
    a, b = trimesh.creation.box((0.1,) * 3), trimesh.creation.box((0.1,) * 3)
    b.apply_translation((0.05, 0.02, 0.01))
    b.invert()
    oracle = (manifold3d.Manifold.cube((0.1,) * 3, True)
              + manifold3d.Manifold.cube((0.1,) * 3, True).translate((0.05, 0.02, 0.01)))
    both = trimesh.util.concatenate([a, b])
    assert _solid(both).volume == pytest.approx(oracle.volume(), rel=1e-6)


def test_a_cavity_stays_and_a_nested_part_does_not():
    outer, inner = trimesh.creation.box((0.1,) * 3), trimesh.creation.box((0.06,) * 3)
    nested = trimesh.util.concatenate([outer, inner])
    assert _solid(nested).volume == pytest.approx(0.1**3, rel=1e-6)
    inner.invert()
    hollow = trimesh.util.concatenate([outer, inner])
    assert _solid(hollow).volume == pytest.approx(0.1**3 - 0.06**3, rel=1e-6)


def test_boxes_that_share_an_edge():
    a, b = trimesh.creation.box((0.1,) * 3), trimesh.creation.box((0.1,) * 3)
    b.apply_translation((0.1, 0.1, 0.0))
    both = trimesh.util.concatenate([a, b])
    both.merge_vertices()
    assert _solid(both).volume == pytest.approx(2e-3, rel=0.02)


def test_panels_that_do_not_meet():
    cup = _sheet_cup()
    soup = trimesh.Trimesh(cup.triangles.reshape(-1, 3), np.arange(3 * len(cup.faces)).reshape(
        -1, 3), process=False)
    solid = _solid(soup)
    assert solid.volume == pytest.approx(cup.area * SHEET_M, rel=0.25)
    assert not _holds(solid, (0, 0, 0.02))


def test_what_has_no_inside_gets_a_thickness():
    around = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    rim = [np.column_stack([(0.05 + s * 0.015 * np.cos(around / 2)) * np.cos(around),
                            (0.05 + s * 0.015 * np.cos(around / 2)) * np.sin(around),
                            s * 0.015 * np.sin(around / 2)]) for s in (-1, 1)]
    i = np.arange(47)
    faces = np.vstack([np.column_stack([i, i + 1, i + 48]),
                       np.column_stack([i + 1, i + 49, i + 48]), [[47, 48, 95], [48, 0, 95]]])
    moebius = trimesh.Trimesh(np.vstack(rim), faces, process=False)
    assert _solid(moebius).volume == pytest.approx(moebius.area * SHEET_M, rel=0.8)


@pytest.mark.parametrize('name', ['dustpan', 'tray', 'jug', 'teacup', 'frying_pan'])
def test_torn_models_of_the_catalogue_keep_their_volume(name):
    mesh = CATALOGUE[name]()
    keep = np.random.default_rng(1).random(len(mesh.faces)) > 0.01
    torn = _without(mesh, keep)
    assert not torn.is_watertight
    assert _solid(torn).volume == pytest.approx(mesh.volume, rel=0.25)
