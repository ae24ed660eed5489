# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Things of no category: found beside the objects of an answer, and nowhere else."""

from dataclasses import replace

from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import matrix_from_pose, transform
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.parsing.tracking import Tracker
from hooc_perception.core.parsing.unknown import find_unknown
from hooc_perception.core.types import (
    Candidates,
    Energy,
    ParsedScene,
    PixelProbabilities,
    UnknownObjects,
)
from hooc_perception.objects.derive import derive
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

SIZE = np.array([0.12, 0.08, 0.20])


@pytest.fixture(scope='module')
def block():
    """Return the GenericModel of a block."""
    return derive('block', trimesh.creation.box(SIZE), np.random.default_rng(0), 800, 50)


def placed(x, y, yaw, size=SIZE):
    """Return (vertices, faces) of an upright block on the table."""
    mesh = trimesh.creation.box(size)
    turn = Rotation.from_euler('z', yaw).as_quat()
    return (transform(matrix_from_pose([x, y, size[2] / 2], turn), mesh.vertices),
            np.asarray(mesh.faces, np.int32))


def answer(*poses):
    """Return the Candidates of blocks at (x, y, yaw)."""
    n = len(poses)
    return Candidates(
        np.ones(n, np.uint16), np.array([[x, y, SIZE[2] / 2] for x, y, _ in poses]).reshape(-1, 3),
        np.array([[0, 0, np.sin(yaw / 2), np.cos(yaw / 2)] for *_, yaw in poses]).reshape(-1, 4),
        np.tile(SIZE, (n, 1)).astype(np.float32),
        np.ones(n, np.float32))


def frame(small, block, *meshes, p_background=0.8):
    """Return the Frame of meshes on the table, seen by three cameras."""
    observation = small.observed(list(meshes))
    camera, uv = [], []
    for i, view in enumerate(observation.views):
        rows, columns = np.nonzero(view.foreground)
        camera.append(np.full(len(rows), i, np.uint8))
        uv.append(np.stack([columns, rows], -1).astype(np.uint16))
    n = sum(map(len, camera))
    p = np.tile(np.round(255 * np.array([p_background, 1 - p_background])), (n, 1))
    return Frame(observation, PixelProbabilities(np.concatenate(camera), np.concatenate(uv),
                                                 p.astype(np.uint8)), (block,))


def test_a_thing_beside_the_answer_is_boxed(small, block):
    seen = frame(small, block, placed(-0.15, 0.1, 0.3), placed(0.2, -0.1, 1.0, [0.1, 0.16, 0.07]))
    unknown = find_unknown(seen, answer((-0.15, 0.1, 0.3)))
    assert len(unknown) == 1
    np.testing.assert_allclose(unknown.translation[0], [0.2, -0.1, 0.035], atol=0.01)
    np.testing.assert_allclose(np.sort(unknown.size[0][:2]), [0.1, 0.16], atol=0.02)
    assert unknown.size[0][2] == pytest.approx(0.07, abs=0.008)
    assert unknown.score[0] == pytest.approx(0.8, abs=0.01)
    # The hull is as large as the box, and stands on the table.
    low, high = unknown.hulls[0].min(0), unknown.hulls[0].max(0)
    assert low[2] == pytest.approx(0, abs=1e-9) and high[2] == pytest.approx(0.07, abs=0.008)


def test_what_the_answer_explains_is_not_unknown(small, block):
    seen = frame(small, block, placed(-0.15, 0.1, 0.3), placed(0.2, -0.1, 1.0))
    assert len(find_unknown(seen, answer((-0.15, 0.1, 0.3), (0.2, -0.1, 1.0)))) == 0
    assert len(find_unknown(seen, answer())) == 2
    # Nor is what a slightly wrong size or pose leaves over.
    assert len(find_unknown(seen, answer((-0.142, 0.105, 0.35), (0.21, -0.1, 1.0)))) == 0


def test_an_empty_table_holds_nothing(small, block):
    assert len(find_unknown(frame(small, block), answer())) == 0


def scene_of(*scores):
    """Return a ParsedScene of two blocks of these scores."""
    objects = replace(answer((-0.15, 0.1, 0.3), (0.2, -0.1, 1.0)), score=np.float32(scores))
    some = np.ones(2, np.float32)
    return ParsedScene(objects, Energy(0, 0, 0), some, some, some, np.ones(2, np.uint8), objects,
                       sigma_t=some)


def test_unlikely_objects_become_unknown_if_the_model_knows_strangers(small, block):
    seen = frame(small, block, placed(-0.15, 0.1, 0.3), placed(0.2, -0.1, 1.0))
    method = JointMethod()
    parsed = method.open_world(seen, scene_of(0.9, 0.2), True)
    assert len(parsed.objects) == len(parsed.sigma_t) == len(parsed.unknown) == 1
    np.testing.assert_allclose(parsed.unknown.translation[0, :2], [0.2, -0.1], atol=0.01)
    assert parsed.energy.total > 0, 'what was rejected is unexplained'
    # Others cannot tell: nothing is rejected, and what is left has no score.
    assert len(method.open_world(seen, scene_of(0.9, 0.2), False).objects) == 2
    none = scene_of(0.9, 0.2).take(np.zeros(2, bool))
    assert np.isnan(method.open_world(seen, none, False).unknown.score).all()


def test_what_the_classifier_takes_for_categories_is_the_rest_of_an_object(small, block):
    seen = frame(small, block, placed(0.2, -0.1, 1.0), p_background=0.05)
    none = scene_of(0.9, 0.2).take(np.zeros(2, bool))
    assert len(JointMethod().open_world(seen, none, True).unknown) == 0
    assert len(JointMethod().open_world(seen, none, False).unknown) == 1


def test_showing_nothing_costs_less_where_something_else_is(small, block):
    sure = frame(small, block, placed(0.2, -0.1, 1.0), p_background=1.0)
    seen = sure.evidence.views.foreground
    np.testing.assert_array_equal(sure.evidence.cost_none, seen)
    discounted = replace(sure, unknown_weight=0.6).evidence.cost_none
    assert discounted[seen].mean() == pytest.approx(0.4, abs=0.02)
    assert not discounted[~seen].any()


def test_rows_follow_a_rigid_motion():
    unknown = UnknownObjects(np.array([[0.1, 0, 0.05]]), np.array([[0, 0, 0, 1.0]]),
                             np.float32([[0.1, 0.2, 0.1]]), np.float32([0.5]),
                             (np.array([[0.1, 0, 0.1], [0.2, 0, 0]]),))
    T = matrix_from_pose([0, 0, 0.7], [0, 0, np.sin(0.5), np.cos(0.5)])
    moved = unknown.moved(T)
    np.testing.assert_allclose(moved.translation, transform(T, unknown.translation))
    np.testing.assert_allclose(moved.hulls[0], transform(T, unknown.hulls[0]))
    np.testing.assert_allclose(Rotation.from_quat(moved.rotation_xyzw[0]).as_matrix(), T[:3, :3],
                               atol=1e-12)


def test_ids_last_and_are_unlike_those_of_objects(block):
    def at(*centres):
        n = len(centres)
        return UnknownObjects(np.array(centres, float).reshape(-1, 3),
                              np.tile([0, 0, 0, 1.0], (n, 1)), np.ones((n, 3), np.float32),
                              np.ones(n, np.float32), (np.zeros((0, 3)),) * n)

    tracker = Tracker((block,))
    known, _ = tracker.update(1, answer((0, 0, 0)))
    first = tracker.update_unknown(1, at((0.3, 0, 0), (-0.3, 0, 0)))
    assert len({*known.tolist(), *first.tolist()}) == 3
    tracker.update(2, answer((0, 0, 0)))
    assert tracker.update_unknown(2, at((-0.31, 0.02, 0), (0.3, 0.01, 0), (0, 0.5, 0))).tolist()[
        :2] == first[::-1].tolist()
    tracker.forget()
    assert not {*tracker.update_unknown(3, at((0.3, 0, 0))).tolist()} & {*first.tolist()}
