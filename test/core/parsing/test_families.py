# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Categories of several meshes, from proposals to the result."""

from dataclasses import replace

from hooc_perception.core.energy.overlap import pairwise
from hooc_perception.core.frame.costs import PixelCosts
from hooc_perception.core.frame.evidence import hypotheses_of
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.hypotheses.propose import candidates_of, propose
from hooc_perception.core.hypotheses.sampling import non_maximum_suppression, sample, SampleCounts
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.parsing.search import Search
from hooc_perception.core.parsing.tracking import Tracker
from hooc_perception.core.parsing.unexplained import unexplained
from hooc_perception.core.shapes import Shapes
from hooc_perception.core.types import Candidates, UnknownObjects
from hooc_perception.objects.derive import derive
from hooc_perception.scene import scene_of
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

PAN, BOX = 1, 2
SHALLOW, DEEP = 0, 1
CONFIG = ParseConfig()
WEIGHTS = PixelCosts().weights()


def pan(depth):
    """Return a round pan without lid, 16 cm wide, with a short handle at its rim."""
    wall = trimesh.creation.annulus(0.074, 0.08, depth, sections=32)
    bottom = trimesh.creation.cylinder(0.078, 0.006, sections=32)
    bottom.apply_translation([0, 0, 0.003 - depth / 2])
    handle = trimesh.creation.box((0.07, 0.02, 0.012))
    handle.apply_translation([0.108, 0, depth / 2 - 0.006])
    return trimesh.util.concatenate([wall, bottom, handle])


@pytest.fixture(scope='module')
def families(things):
    """Return two categories: a shallow pan with a deep variant, and a box."""
    shallow, deep = (derive('pan', pan(depth), np.random.default_rng(0))
                     for depth in (0.03, 0.11))
    return replace(shallow, variants=(deep,)), things[0]


def standing(families, category, member, at, turn):
    """Return Candidates that stand on the table at their own size."""
    objects = Candidates(np.array(category, np.uint16), np.zeros((len(at), 3)),
                         Rotation.from_rotvec(np.outer(turn, [0, 0, 1])).as_quat(),
                         np.zeros((len(at), 3), np.float32), np.ones(len(at), np.float32),
                         np.array(member, np.uint16))
    extents = np.array([shape.extents for shape in objects.shapes(families)])
    return replace(objects, size=extents.astype(np.float32),
                   translation=np.column_stack([at, extents[:, 2] / 2]))


@pytest.fixture(scope='module')
def kitchen(families, make_desk):
    """Return a desk with a deep pan and a box; see `desk_with`."""
    truth = standing(families, [PAN, BOX], [DEEP, 0], [[-0.06, 0.02], [0.15, -0.1]], [0.5, 0.2])
    return make_desk(truth, models=families)


@pytest.fixture(scope='module')
def pool(kitchen, cheap):
    """Return the Candidates that are proposed for it."""
    return propose(kitchen.frame, cheap, PixelCosts(), stage_rng(0, 'propose'))


def nearest(objects, truth, k):
    """Return the distance (n,) of objects from the k-th true one, inf for other categories."""
    apart = np.linalg.norm(objects.translation - truth.translation[k], axis=1)
    return np.where(objects.category == truth.category[k], apart, np.inf)


def test_every_member_is_drawn_from_the_samples_of_its_category(kitchen, cheap):
    space = kitchen.frame
    H, shape = sample(space.cloud, space.field, space.shapes, cheap, np.random.default_rng(0),
                      SampleCounts(1500, 31, 0))
    count = np.bincount(shape, minlength=3)
    assert len(H) == len(shape) and (count > 0).all()
    # 31 of a category are kept: 16 of each pan.
    assert (count <= [16, 16, 31]).all()


def test_only_the_best_member_at_a_place_is_kept(families):
    shapes = Shapes(families)
    H = np.zeros((4, 10))
    H[:, 6] = 1
    # The same boxes on the table, filled by the one pan or by the other.
    H[:, 7:10] = shapes.extents[DEEP] / shapes.extents[[0, 1, 0, 1]]
    H[2:, 0] = 0.3
    rows = non_maximum_suppression(H, np.array([0, 1, 0, 1]), np.array([.1, .4, .3, .2]), shapes,
                                   9)
    assert rows.tolist() == [1, 2]


def test_candidates_and_hypotheses_know_their_mesh(kitchen):
    shapes, truth = kitchen.frame.shapes, kitchen.truth
    H = hypotheses_of(truth, shapes)
    np.testing.assert_allclose(H[:, 7:10], 1, rtol=1e-6)
    again = candidates_of(H, shapes.of(truth), truth.score, shapes)
    np.testing.assert_array_equal(again.member, truth.member)
    np.testing.assert_allclose(again.size, truth.size, rtol=1e-6)


def test_the_images_see_the_mesh_of_the_member(kitchen):
    space, truth = kitchen.frame, kitchen.truth
    other = replace(truth, member=np.array([SHALLOW, 0], np.uint16))
    right, wrong = (space.evidence.compare(hypotheses_of(x, space.shapes), space.shapes.of(x),
                                           WEIGHTS) for x in (truth, other))
    assert right[0, stat.AGREE] > 0.8 * right[0, stat.SHOWN]
    # The same box filled by a stretched pan: its thick bottom and handle are not there.
    assert wrong[0, stat.DELTA] > right[0, stat.DELTA] + 200
    np.testing.assert_array_equal(wrong[1], right[1])


def test_the_deep_pan_is_proposed(kitchen, pool):
    best = nearest(pool, kitchen.truth, 0).argmin()
    assert nearest(pool, kitchen.truth, 0)[best] < 0.03
    deep = (pool.category == PAN) & (pool.member == DEEP)
    assert deep.any() and not pool.member[pool.category == BOX].any()
    assert nearest(pool.take(deep), kitchen.truth, 0).min() < 0.03


def test_the_deep_pan_is_the_result(kitchen, pool, families, cheap):
    parsed = JointMethod(cheap, CONFIG).parse(kitchen.frame, pool, 0, 1)
    found = parsed.objects
    assert sorted(found.category.tolist()) == [PAN, BOX]
    mine = int(np.flatnonzero(found.category == PAN)[0])
    assert found.member[mine] == DEEP
    assert nearest(found, kitchen.truth, 0)[mine] < 0.02
    np.testing.assert_allclose(found.size[mine], kitchen.truth.size[0], rtol=0.15)
    scene = scene_of(parsed, kitchen.observation, families)
    assert [o.member for o in scene.objects] == found.member.tolist()
    vertices, faces = scene.meshes()[mine]
    np.testing.assert_array_equal(faces, families[0].variants[0].faces)
    assert scene.to_dict()['objects'][mine]['member'] == DEEP
    np.testing.assert_allclose(np.ptp(vertices[:, 2]), found.size[mine, 2], rtol=0.1)


def test_members_are_exchanged_where_the_other_one_fits(kitchen):
    truth = kitchen.truth
    search = Search(kitchen.frame.coarse, kitchen.models, CONFIG, 1)
    search.add(replace(truth, member=np.array([SHALLOW, 0], np.uint16)))
    search.mask[:] = True
    new = search.exchanged_members(10, np.random.default_rng(0))
    assert (new.category.tolist(), new.member.tolist()) == ([PAN], [DEEP])
    assert len(search.exchanged_members(0, np.random.default_rng(0))) == 0
    search.add(new)
    search.run(np.random.default_rng(0), lambda: False)
    chosen = search.pool.take(search.mask)
    assert sorted(zip(chosen.category.tolist(), chosen.member.tolist())) == [
        (PAN, DEEP), (BOX, 0)]


def test_a_family_of_one_has_nothing_to_exchange(desk):
    search = Search(desk.frame.coarse, desk.models, CONFIG, 1)
    search.add(desk.truth)
    search.mask[:] = True
    assert len(search.exchanged_members(10, np.random.default_rng(0))) == 0


def test_volumes_are_those_of_the_members(families):
    # A box inside of the deep pan touches its bottom only; a shallow one so stretched is thicker.
    both = standing(families, [PAN, BOX], [DEEP, 0], [[0, 0], [0, 0]], [0, 0])
    other = replace(both, member=np.array([SHALLOW, 0], np.uint16))
    deep, stretched = (pairwise(x, families)[1, 0] for x in (both, other))
    assert stretched > deep + 0.1


def test_what_is_unexplained_depends_on_the_member(kitchen):
    wrong = replace(kitchen.truth, member=np.array([SHALLOW, 0], np.uint16))
    left, more = (unexplained(kitchen.observation, x, UnknownObjects.empty(), kitchen.models,
                              0.008).points for x in (kitchen.truth, wrong))
    # The bottom of a stretched pan is 1.6 cm higher.
    assert len(more) > 1.3 * len(left) + 50


def test_a_new_mesh_is_not_a_new_object(families):
    # The variant is round, its generic model is not: half a turn counts for one of them only.
    generic, cup = families[0], derive('pan', trimesh.creation.cylinder(0.08, 0.1),
                                       np.random.default_rng(0))
    models = (replace(generic, variants=(cup,)), families[1])
    tracker = Tracker(models)
    a, b = [0.0, 0.0], [0.02, 0.0]
    first, _ = tracker.update(0, standing(models, [PAN, PAN], [0, 1], [a, b], [0.0, 0.0]))
    again, objects = tracker.update(10 ** 9, standing(models, [PAN, PAN], [1, 1], [b, a],
                                                      [2.0, 3.0]))
    assert again.tolist() == first[::-1].tolist()
    # It keeps the orientation as far as its own symmetry lets it.
    R = Rotation.from_quat(objects.rotation_xyzw)
    np.testing.assert_allclose(R.magnitude(), 0, atol=1e-6)


def test_a_frame_of_families_without_variants_is_the_same(desk, cheap):
    one = Frame(desk.observation, desk.probabilities, desk.models)
    assert len(one.shapes) == 3
    pool = propose(one, replace(cheap, samples=800, pool=8), PixelCosts(), stage_rng(0, 'propose'))
    assert len(pool) and not pool.member.any()
