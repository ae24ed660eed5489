# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Padded meshes cover what is near the surface, and not much more."""

from hooc_perception.errors import HoocError
from hooc_perception.robot.padding import boxes_of, padded
import numpy as np
import pytest
import trimesh

BOX = trimesh.creation.box((0.3, 0.06, 0.06))


@pytest.mark.parametrize('flip', [False, True])
def test_every_face_of_a_box_moves_by_the_margin(flip):
    mesh = BOX.copy()
    if flip:
        mesh.invert()
    (vertices, faces), = padded(mesh, 0.02)
    np.testing.assert_allclose(np.ptp(vertices, 0), (0.34, 0.10, 0.10), atol=1e-9)
    assert faces.dtype == np.int32


def test_smooth_shapes_grow_by_the_margin():
    (vertices, _), = padded(trimesh.creation.icosphere(3, 0.05), 0.02)
    radius = np.linalg.norm(vertices, axis=1)
    assert 0.0699 < radius.min() and radius.max() < 0.0705


def test_stl_soup_is_merged_first():
    soup = trimesh.Trimesh(BOX.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3),
                           process=False)
    (vertices, _), = padded(soup, 0.02)
    np.testing.assert_allclose(np.ptp(vertices, 0), (0.34, 0.10, 0.10), atol=1e-9)


def test_an_open_mesh_grows_to_both_sides():
    lid = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    heights = sorted({round(float(z), 6) for vertices, _ in padded(lid, 0.02)
                      for z in vertices[:, 2]})
    assert heights == [-0.02, 0.0, 0.02]


def test_no_margin_changes_nothing():
    (vertices, _), = padded(BOX, 0.0)
    np.testing.assert_allclose(np.ptp(vertices, 0), (0.3, 0.06, 0.06), atol=1e-12)


def test_boxes_are_checked():
    one, two = boxes_of([0, 0, 0, 1, 2, 3, -1, -1, -1, 0, 0, 0])
    np.testing.assert_allclose(one.bounds, [[0, 0, 0], [1, 2, 3]])
    np.testing.assert_allclose(two.bounds, [[-1, -1, -1], [0, 0, 0]])
    for numbers, word in (([1.0] * 5, 'six finite'), ([0, 0, 0, 1, 1, float('inf')], 'six finite'),
                          ([0, 0, 0, 1, -1, 1], 'no extent')):
        with pytest.raises(HoocError, match=word):
            boxes_of(numbers)
