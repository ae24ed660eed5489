# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
from hooc_perception.errors import HoocError
from hooc_perception.objects.manifold import to_manifold
from hooc_perception.synthesis.bodies import Body, BodyMaker
from hooc_perception.synthesis.convex import convex_pieces
from hooc_perception.synthesis.pile import SettleConfig
from hooc_perception.synthesis.scatter import ScatterConfig
from hooc_perception.synthesis.settle import settle, settled_models
import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay
import trimesh


def in_some_piece(points, pieces):
    """Return (n,) bool: which points lie in one of the convex pieces."""
    return np.any([Delaunay(p).find_simplex(points) >= 0 for p in pieces], axis=0)


def test_a_convex_thing_is_one_piece():
    for mesh in (trimesh.creation.box((0.1, 0.2, 0.3)), trimesh.creation.icosphere(2, 0.05)):
        pieces = convex_pieces(mesh)
        assert len(pieces) == 1
        assert ConvexHull(pieces[0]).volume == pytest.approx(mesh.volume, rel=1e-3)


def test_pieces_cover_a_ring_and_leave_its_hole_open():
    ring = trimesh.creation.annulus(0.03, 0.04, 0.05, sections=48)
    pieces = convex_pieces(ring)
    assert 6 <= len(pieces) <= 24
    samples = ring.sample(500, seed=0)
    # Slightly inwards, so that rounding of hull faces does not matter.
    radius = np.hypot(samples[:, 0], samples[:, 1])
    samples *= np.array([0.999, 0.999, 0.99]) ** (radius > 0.035)[:, None]
    assert in_some_piece(samples * [1, 1, 0.99], pieces).mean() > 0.97
    axis = np.column_stack([np.zeros(20), np.zeros(20), np.linspace(-0.025, 0.025, 20)])
    assert not in_some_piece(axis, pieces).any()
    assert sum(ConvexHull(p).volume for p in pieces) < 1.25 * ring.volume


def test_an_open_sheet_is_taken_as_its_hull():
    sheet = trimesh.creation.box((0.1, 0.1, 0.02))
    sheet.update_faces(np.arange(len(sheet.faces)) > 1)
    assert len(convex_pieces(sheet)) >= 1


def test_a_ball_comes_to_rest_on_its_lowest_point(models):
    maker = BodyMaker(models)
    ball = [m.name for m in models].index('ball') + 1
    placed = settle([maker.body(ball, None)], np.random.default_rng(0))
    assert len(placed) == 1
    # The bounding-box centre of a ball stands a radius above the table.
    assert placed[0].translation[2] == pytest.approx(0.04, abs=2e-3)


def test_a_rod_dropped_at_any_angle_ends_up_lying(models):
    maker = BodyMaker(models)
    rod = [m.name for m in models].index('rod') + 1
    for seed in range(5):
        placed, = settle([maker.body(rod, None)], np.random.default_rng(seed),
                         SettleConfig(upright=0.0))
        assert np.ptp(placed.vertices_world[:, 2]) < 0.02


def test_piles_rest_on_the_table_without_sharing_volume(models):
    scatter = ScatterConfig(objects_low=12, objects_high=12, repeats=2)
    stacked = 0
    for seed in range(3):
        objects = settled_models(models, np.random.default_rng(seed), scatter, 0.7)
        assert len(objects) >= 10
        parts = [to_manifold(trimesh.Trimesh(o.vertices_world, o.faces, process=False))
                 for o in objects]
        for i, (o, a) in enumerate(zip(objects, parts)):
            lowest = o.vertices_world[:, 2].min()
            assert lowest >= -1e-6
            stacked += lowest > 0.005
            for b in parts[:i]:
                assert (a ^ b).volume() < 0.05 * min(a.volume(), b.volume())
    assert stacked > 0


def test_vertices_size_and_pose_agree(models):
    for o in settled_models(models, np.random.default_rng(3), ScatterConfig(objects_low=5), 1.0):
        R = trimesh.transformations.quaternion_matrix(o.rotation_xyzw[[3, 0, 1, 2]])[:3, :3]
        in_model = (o.vertices_world - o.translation) @ R
        np.testing.assert_allclose(np.ptp(in_model, axis=0), o.size, atol=1e-9)
        np.testing.assert_allclose(in_model.max(axis=0), o.size / 2, atol=1e-9)


def test_what_ends_out_of_reach_is_left_out(models):
    maker = BodyMaker(models)
    bodies = [maker.body(c, None) for c in range(1, 7)]
    near = settle(bodies, np.random.default_rng(0), SettleConfig(crowding=0.05, reach_m=0.12))
    far = settle(bodies, np.random.default_rng(0), SettleConfig(crowding=0.05, reach_m=2.0))
    assert len(near) < len(far) == 6
    assert all(np.hypot(*o.translation[:2]) <= 0.12 for o in near)


def test_more_places_to_choose_from_means_fewer_stacks(models):
    maker = BodyMaker(models)

    def height(places):
        return np.mean([o.vertices_world[:, 2].max() for seed in range(4) for o in settle(
            [maker.body(c, None) for c in (1, 2, 3, 6) * 2], np.random.default_rng(seed),
            SettleConfig(places=places, crowding=1.0, upright=1.0))])
    assert height(8) < height(1)


def test_a_sliver_still_has_something_to_collide_with():
    flat = trimesh.creation.box((0.1, 0.05, 1e-6))
    body = Body(1, np.array(flat.vertices), np.array(flat.faces, np.int32),
                [np.array(flat.vertices)], np.zeros((0, 4)))
    placed = settle([body], np.random.default_rng(0))
    assert len(placed) == 1 and placed[0].translation[2] < 0.06


def test_the_same_seed_gives_the_same_pile(models):
    a, b = (settled_models(models, np.random.default_rng(4), ScatterConfig(), 1.0)
            for _ in range(2))
    assert len(a) == len(b) > 0
    for x, y in zip(a, b):
        np.testing.assert_array_equal(x.vertices_world, y.vertices_world)


def test_objects_of_one_shape_come_in_several_sizes(models):
    scatter = ScatterConfig(objects_low=5, objects_high=5, pose='resting', size_spread=0.3)
    objects = settled_models(models, np.random.default_rng(5), scatter, 0.0)
    ratios = np.array([o.size / models[o.category - 1].extents for o in objects])
    assert len(ratios) >= 4 and np.allclose(ratios, ratios[:, :1], rtol=1e-3)
    assert np.log(ratios[:, 0]).std() > 0.05 and (np.abs(np.log(ratios)) < 0.61).all()


def test_no_models_are_refused_and_no_bodies_are_no_pile():
    with pytest.raises(HoocError, match='at least one model'):
        settled_models((), np.random.default_rng(0), ScatterConfig(), 1.0)
    assert settle([], np.random.default_rng(0)) == []
