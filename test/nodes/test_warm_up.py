# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The made-up scene is a scene: things stand on a table and are seen."""

from hooc_perception.core.geometry import back_project
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import GenericModel
from hooc_perception.nodes.warm_up import made_up_scene, overhead_camera
import numpy as np

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.04
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7],
                  [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], np.int32)


def a_box(name):
    empty = np.zeros((0, 3), np.float32)
    return GenericModel(name, CORNERS, FACES, np.full(3, 0.08), empty, empty, empty, 5e-4,
                        np.zeros((0, 4)), np.zeros(0), np.ones(3, np.int32))


def test_boxes_stand_on_the_table_and_are_labelled():
    views, probabilities, candidates, models = made_up_scene([a_box(n) for n in 'abcd'], ())
    assert len(models) == len(candidates) == 3
    points = back_project(views[0].depth, overhead_camera())
    assert np.nanmax(points[..., 2]) == np.float32(0.08) or abs(
        np.nanmax(points[..., 2]) - 0.08) < 1e-6
    foreground = observe(views).views[0].foreground
    assert foreground.sum() > 100
    labelled = np.zeros(foreground.shape, int)
    labelled[probabilities.uv[:, 1], probabilities.uv[:, 0]] = probabilities.p.argmax(1)
    assert set(np.unique(labelled[foreground])) <= {0, 1, 2, 3}
    assert (labelled[foreground] > 0).mean() > 0.9
    for i in range(3):
        mine = points[labelled == i + 1]
        assert np.abs(mine[:, :2].mean(0) - candidates.translation[i, :2]).max() < 0.02


def test_one_model_and_several_cameras():
    views, probabilities, candidates, _ = made_up_scene([a_box('a')], [overhead_camera()] * 2)
    assert len(views) == 2 and len(candidates) == 1
    assert set(probabilities.camera) == {0, 1} and probabilities.p.shape[1] == 2
