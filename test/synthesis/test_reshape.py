# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
from hooc_perception.synthesis.reshape import random_warp, reshape, reshape_placed
from hooc_perception.synthesis.scatter import scatter, ScatterConfig
import numpy as np
import pytest
import trimesh


def test_no_strength_changes_nothing(models):
    for m in models:
        vertices, extents, _ = reshape(m.vertices, m.faces, np.random.default_rng(0), 0.0)
        np.testing.assert_allclose(vertices, m.vertices, atol=1e-12)
        np.testing.assert_allclose(extents, m.extents, atol=1e-12)


def test_reshaped_meshes_stay_closed_centred_and_report_their_extents(models):
    for m in models:
        for seed in range(5):
            vertices, extents, _ = reshape(m.vertices, m.faces, np.random.default_rng(seed), 1.0,
                                           m.symmetry, detail_loss=1.0)
            mesh = trimesh.Trimesh(vertices, m.faces, process=False)
            assert mesh.is_watertight and mesh.volume > 0
            np.testing.assert_allclose(mesh.bounds.mean(axis=0), 0, atol=1e-9)
            np.testing.assert_allclose(mesh.extents, extents, atol=1e-9)


def test_proportions_spread_as_household_ware_does(models):
    box = models[0]
    ratio = np.array([reshape(box.vertices, box.faces, np.random.default_rng(i))[1] / box.extents
                      for i in range(200)])
    assert 0.12 < np.log(ratio).std() < 0.25
    # A shared part (overall size) and one of its own for each side.
    correlation = np.corrcoef(np.log(ratio).T)
    assert 0.2 < correlation[0, 1] < 0.8
    assert np.ptp(np.log(ratio), axis=1).mean() > 0.1


def test_strength_scales_the_departure(models):
    def departure(strength):
        return np.mean([np.abs(reshape(m.vertices, m.faces, np.random.default_rng(9), strength,
                                       detail_loss=0)[0] - m.vertices).mean() for m in models])
    assert departure(0.25) < 0.5 * departure(1.0)


@pytest.mark.parametrize('name, sides', [('can', (0, 1)), ('plate', (0, 1)), ('ball', (0, 2))])
def test_what_is_round_stays_round(models, name, sides):
    model = {m.name: m for m in models}[name]
    for seed in range(10):
        _, extents, _ = reshape(model.vertices, model.faces, np.random.default_rng(seed), 1.0,
                                model.symmetry)
        assert extents[sides[0]] / extents[sides[1]] == pytest.approx(1, abs=0.08)


def test_a_warp_is_smooth_and_keeps_neighbours_together(models):
    warp = random_warp(models[0].vertices, np.random.default_rng(2), 1.5)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (500, 3)) * models[0].extents
    nudge = np.array([1e-4, -5e-5, 2e-5])
    moved = np.linalg.norm(warp(points + nudge) - warp(points), axis=1)
    assert np.all(moved < 2.5 * np.linalg.norm(nudge))
    assert np.all(moved > 0.3 * np.linalg.norm(nudge))


def test_placed_objects_are_reshaped_where_they_stand(models):
    for o in scatter(models, np.random.default_rng(0), ScatterConfig(objects_low=5)):
        new = reshape_placed(o, np.random.default_rng(1), 1.0)
        assert new.vertices_world[:, 2].min() == pytest.approx(0, abs=1e-9)
        np.testing.assert_array_equal(new.translation[:2], o.translation[:2])
        assert not np.allclose(new.size, o.size, rtol=1e-3)


def test_parts_of_a_long_object_grow_and_shrink_by_themselves(models):
    rod = {m.name: m for m in models}['rod']
    shares = []
    for seed in range(40):
        warp = random_warp(rod.vertices, np.random.default_rng(seed), 1.5, structure=1.0)
        assert (np.diff(warp.knots, axis=1) > 0).all()
        np.testing.assert_allclose(warp.knots[:, [0, -1]], [[0, 1]] * 3, atol=1e-12)
        shares.append(warp.knots[warp.axis, 2])
    # The middle of the rod lies elsewhere in every one.
    assert 0.02 < np.std(shares) < 0.2 and abs(np.mean(shares) - 0.5) < 0.05
