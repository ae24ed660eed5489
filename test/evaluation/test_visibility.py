# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Table 1 against closed forms."""

from hooc_perception.core.types import GenericModel
from hooc_perception.evaluation.matching import PosedObject
from hooc_perception.evaluation.visibility import scene_visibility
import numpy as np
import pytest
import trimesh

UPRIGHT = np.array([0, 0, 0, 1.0])


def of(category, model, x, y, z):
    return PosedObject(category, np.array([x, y, z]), UPRIGHT, model.extents)


def fine(mesh, name):
    none = np.zeros((0, 3), np.float32)
    return GenericModel(name, np.array(mesh.vertices), np.array(mesh.faces, np.int32),
                        np.array(mesh.extents), none, none, none, 0.0, none, none,
                        np.ones(3, np.int32))


def test_a_lone_ball_shows_its_cap(tiny):
    ball = fine(trimesh.creation.icosphere(4, 0.08), 'ball')
    (v,) = scene_visibility([of('ball', ball, 0, 0, 0)], {'ball': ball}, tiny.cameras,
                            np.random.default_rng(0))
    # The cap that a point at distance d sees of a ball of radius r: (1 - r / d) / 2.
    cap = (1 - 0.08 / 0.9) / 2
    np.testing.assert_allclose(v.pixels, 1)
    np.testing.assert_allclose(v.surface, cap, atol=0.025)
    # Two cameras see caps that overlap in part.
    assert cap < v.total < 2 * cap + 0.01


def test_a_box_shows_the_faces_that_look_at_the_camera(tiny):
    box = fine(trimesh.creation.box((0.2, 0.1, 0.05)), 'box')
    (v,) = scene_visibility([of('box', box, 0, 0, 0)], {'box': box}, tiny.cameras[:1],
                            np.random.default_rng(0))
    areas = np.array([0.1 * 0.05, 0.2 * 0.05, 0.2 * 0.1])
    assert v.surface[0] == pytest.approx(0.5 * areas.sum() / areas.sum(), abs=0.02)
    assert v.total == v.surface[0]


def test_what_stands_behind_is_hidden_in_that_view_only(tiny, models):
    camera = tiny.cameras[0]
    eye = camera.T_world_camera[:3, 3]
    box = models['box']
    back = of('ball', models['ball'], 0, 0, 0)
    front = PosedObject('box', eye * 0.25, UPRIGHT, box.extents * 2)
    v, screen = scene_visibility([back, front], models, tiny.cameras, np.random.default_rng(0))
    assert v.pixels[0] == 0 and v.surface[0] == 0
    assert v.pixels[1] > 0.9
    assert v.total == pytest.approx(v.surface[1])
    assert screen.pixels[0] == 1


def test_pixel_share_of_a_half_hidden_ball_lies_between(tiny, models):
    eye = tiny.cameras[0].T_world_camera[:3, 3]
    side = np.cross(eye, [0, 0, 1])
    side = side / np.linalg.norm(side)
    back = of('ball', models['ball'], 0, 0, 0)
    front = PosedObject('ball', eye * 0.3 + 0.03 * side, UPRIGHT, models['ball'].extents)
    v = scene_visibility([back, front], models, tiny.cameras[:1], np.random.default_rng(0))[0]
    assert 0.1 < v.pixels[0] < 0.9
    alone = scene_visibility([back], models, tiny.cameras[:1], np.random.default_rng(0))[0]
    assert 0 < v.surface[0] < alone.surface[0]


def test_an_object_outside_every_image_is_not_a_number(tiny, models):
    v = scene_visibility([of('ball', models['ball'], 40, 0, 0)], models, tiny.cameras,
                         np.random.default_rng(0))[0]
    assert np.isnan(v.pixels).all() and v.total == 0
