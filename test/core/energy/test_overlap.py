# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Overlap of volumes: known cases, and manifold3d's exact intersections as the oracle."""

from dataclasses import replace

from hooc_perception.core.energy.overlap import occupancy, OverlapTerm, pairwise, union_shares
from hooc_perception.core.geometry import posed_vertices
from hooc_perception.core.types import Candidates
from hooc_perception.objects.derive import derive
import manifold3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh


def as_model(mesh, solid=None):
    """Return the GenericModel of a mesh, with the interior of `solid` if it is given."""
    model = derive('x', mesh if solid is None else solid, np.random.default_rng(0))
    if solid is None:
        return model
    shift = mesh.bounds.mean(0)
    return replace(model, vertices=mesh.vertices - shift, faces=mesh.faces.astype(np.int32),
                   extents=mesh.extents, interior_points=model.interior_points - shift)


def placed(*rows):
    """Return Candidates from rows (class id, translation, rotation vector, size)."""
    category, t, r, size = zip(*rows)
    return Candidates(np.array(category, np.uint16), np.array(t, float),
                      Rotation.from_rotvec(np.array(r, float)).as_quat(),
                      np.array(size, np.float32), np.zeros(len(rows), np.float32))


BOX = trimesh.creation.box((.1, .08, .06))
BALL = trimesh.creation.icosphere(3, .03)
CUP = trimesh.boolean.difference([
    trimesh.creation.cylinder(.04, .1), trimesh.creation.cylinder(
        .035, .1, transform=trimesh.transformations.translation_matrix((0, 0, .005)))])
MODELS = tuple(map(as_model, (BOX, BALL, CUP)))
STRAIGHT = (0, 0, 0)


def test_a_ball_in_a_box_is_inside_and_the_box_is_filled_in_part():
    shares = pairwise(placed((1, (1, 2, 3), (.3, .2, .1), (.2, .2, .2)),
                             (2, (1, 2, 3), STRAIGHT, (.1, .1, .1))), MODELS)
    assert shares[1, 0] == 1.0
    assert shares[0, 1] == pytest.approx(np.pi / 6 / 8, abs=.03)


def test_two_copies_in_one_place_are_each_inside_the_other_but_for_the_skin():
    twins = placed((3, (0, 0, .05), STRAIGHT, CUP.extents), (3, (0, 0, .05), (0, 0, .5),
                                                             CUP.extents),
                   (1, (0, 0, .3), STRAIGHT, BOX.extents), (1, (0, 0, .3), STRAIGHT, BOX.extents))
    assert union_shares(twins, MODELS) == pytest.approx(np.ones(4), abs=.12)
    assert union_shares(twins, MODELS)[2:] == pytest.approx(np.ones(2))


def test_a_ball_in_a_cup_touches_nothing():
    both = placed((3, (0, 0, .05), STRAIGHT, CUP.extents),
                  (2, (0, 0, .05), STRAIGHT, BALL.extents))
    assert np.array_equal(union_shares(both, MODELS), [0, 0])


def test_apart_alone_and_empty_share_nothing():
    apart = placed((1, (0, 0, 0), STRAIGHT, BOX.extents), (1, (.11, 0, 0), STRAIGHT, BOX.extents))
    assert np.array_equal(union_shares(apart, MODELS), [0, 0])
    assert np.array_equal(union_shares(apart.take([0]), MODELS), [0])
    assert len(union_shares(Candidates.empty(), MODELS)) == 0
    assert OverlapTerm(apart, MODELS).evaluate(np.zeros(2, bool)) == 0


def test_union_is_exact_where_two_others_overlap_the_same_part():
    half = placed((1, (0, 0, 0), STRAIGHT, BOX.extents), (1, (.05, 0, 0), STRAIGHT, BOX.extents),
                  (1, (.05, 0, 0), STRAIGHT, BOX.extents))
    assert union_shares(half, MODELS)[0] == pytest.approx(.5, abs=.05)


def manifold(model, objects, i):
    vertices = posed_vertices(model, objects.translation[i], objects.rotation_xyzw[i],
                              objects.size[i])
    return manifold3d.Manifold(manifold3d.Mesh(vertices.astype(np.float32),
                                               model.faces.astype(np.uint32)))


def test_random_poses_agree_with_manifold3d():
    rng = np.random.default_rng(5)
    objects = placed(*[(c, rng.uniform(-.04, .04, 3), rng.normal(size=3),
                        MODELS[c - 1].extents * rng.uniform(.8, 1.3, 3))
                       for c in (1, 2, 3) * 4])
    solids = [manifold(MODELS[c - 1], objects, i) for i, c in enumerate(objects.category)]
    pairs = np.array([[0 if i == j else (a ^ b).volume() / a.volume()
                       for j, b in enumerate(solids)] for i, a in enumerate(solids)])
    union = [(a ^ manifold3d.Manifold.batch_boolean(
        [b for b in solids if b is not a], manifold3d.OpType.Add)).volume() / a.volume()
        for a in solids]
    assert pairs.max() > .3
    assert np.abs(pairwise(objects, MODELS) - pairs).mean() < .02
    assert np.abs(union_shares(objects, MODELS) - union).mean() < .02


def test_every_flip_of_a_walk_agrees_with_the_whole():
    rng = np.random.default_rng(6)
    objects = placed(*[(c, rng.uniform(-.05, .05, 3), rng.normal(size=3), MODELS[c - 1].extents)
                       for c in (1, 2, 3) * 4])
    term = OverlapTerm(objects, MODELS)
    mask = np.zeros(12, bool)
    for k in rng.integers(0, 12, 60):
        assert term.value == term.evaluate(mask)
        for i, delta in enumerate(term.deltas()):
            flipped = mask.copy()
            flipped[i] ^= True
            assert term.evaluate(flipped) - term.value == delta
        term.flip(k)
        mask[k] ^= True
    assert np.array_equal(term.mask, mask)


def test_deltas_without_a_member_equal_those_after_its_flip(deltas_by_flips):
    rng = np.random.default_rng(8)
    term = OverlapTerm(placed(*[
        (c, rng.uniform(-.05, .05, 3), rng.normal(size=3), MODELS[c - 1].extents)
        for c in (1, 2, 3) * 5]), MODELS)
    for share in (0.1, 0.4, 0.8):
        term.reset(rng.random(15) < share)
        members, others = np.flatnonzero(term.mask), ~term.mask
        assert np.array_equal(term.deltas_without(members)[:, others],
                              deltas_by_flips(term, members)[:, others])


def test_what_was_compared_before_does_not_matter():
    rng = np.random.default_rng(7)
    n = 90
    objects = placed(*[(c, rng.uniform(-.1, .1, 3), rng.normal(size=3), MODELS[c - 1].extents)
                       for c in (1, 2, 3) * (n // 3)])
    walked = OverlapTerm(objects, MODELS)
    for k in rng.permutation(n)[:60]:
        walked.flip(k)
    for k in np.flatnonzero(walked.mask)[5:]:
        walked.flip(k)
    fresh = OverlapTerm(objects, MODELS)
    fresh.reset(walked.mask)
    assert walked.value == fresh.value > 0
    assert np.array_equal(walked.deltas(), fresh.deltas())
    assert np.array_equal(walked.pairwise(), pairwise(objects, MODELS))


@pytest.mark.parametrize('spoil', ['none', 'inside out', 'lid off', 'parts overlap'])
def test_occupancy_has_the_volume_of_the_solid(spoil):
    mesh = solid = trimesh.creation.cylinder(.04, .1, sections=24)
    if spoil == 'inside out':
        mesh = mesh.copy()
        mesh.invert()
    if spoil == 'lid off':
        mesh = trimesh.Trimesh(mesh.vertices, mesh.faces[mesh.face_normals[:, 2] < .9],
                               process=False)
    if spoil == 'parts overlap':
        other = trimesh.creation.box((.07, .02, .02))
        mesh = trimesh.util.concatenate([mesh, other])
    model = as_model(mesh, solid=solid)
    share = occupancy(model).mean()
    assert share == pytest.approx(solid.volume / np.prod(mesh.extents), rel=.03)


def test_a_surface_without_an_inside_is_taken_by_its_interior_points():
    solid = trimesh.creation.box((.2, .15, .02))
    # Two walls of the box that no ray along any axis meets as a pair.
    walls = trimesh.Trimesh(solid.vertices, solid.faces[
        (solid.face_normals[:, 2] > .9) | (solid.face_normals[:, 0] < -.9)], process=False)
    walls.faces = np.concatenate([walls.faces, walls.faces[:, ::-1]])
    assert occupancy(as_model(walls, solid=solid)).mean() > .9
