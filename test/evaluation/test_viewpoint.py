# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The first view of a scene: everything is in the picture, whatever the scene measures."""

from hooc_perception.core.geometry import inverse, project, transform
from hooc_perception.core.types import Camera
from hooc_perception.evaluation.report.viewpoint import azimuth_beside, BESIDE_RAD, viewpoint
from hooc_perception.synthesis.rigs import look_at
import numpy as np
import pytest


def seen(view, points, size):
    """Return (u, v, depth) of points in the picture of a view."""
    camera = view.camera(size)
    local = transform(inverse(camera.T_world_camera), points)
    return *project(camera.K, local), local[:, 2]


@pytest.mark.parametrize('scale', [1e-3, 0.5, 1000.0])
@pytest.mark.parametrize('elevation', [-0.1, 0.65, 1.5])
def test_everything_is_in_the_picture_and_fills_it(scale, elevation):
    rng = np.random.default_rng(4)
    size = 1600, 900
    for _ in range(20):
        points = (rng.normal(0, 1, (50, 3)) * rng.uniform(0.1, 1, 3) + rng.normal(0, 5, 3)) * scale
        view = viewpoint(points, rng.uniform(-4, 4), elevation=elevation)
        u, v, depth = seen(view, points, size)
        assert u.min() > -0.5 and u.max() < size[0] and v.min() > -0.5 and v.max() < size[1]
        assert depth.min() > view.near and depth.max() < view.far
        if scale > 0.1:
            assert max(np.ptp(u) / size[0], np.ptp(v) / size[1]) > 0.85
        # The viewer may go away as far as the view allows: nothing is cut off behind.
        assert view.far > view.farthest + np.linalg.norm(points - view.target, axis=1).max()
        assert view.nearest < np.linalg.norm(view.eye - view.target) < view.farthest


def test_a_wider_picture_shows_no_less():
    points = np.random.default_rng(5).uniform(-1, 1, (50, 3))
    view = viewpoint(points, 0.3, aspect=1.5)
    for size in ((1500, 1000), (3000, 1000)):
        u, v, _ = seen(view, points, size)
        assert 0 < u.min() and u.max() < size[0] and 0 < v.min() and v.max() < size[1]


@pytest.mark.parametrize('points', [np.zeros((0, 3)), np.ones((1, 3)),
                                    np.array([[0, 0, np.nan], [0.2, 0.1, 0]])])
def test_hardly_anything_to_see(points):
    view = viewpoint(points, 1.0)
    assert np.isfinite([*view.eye, *view.target, view.far]).all() and 0 < view.near < view.nearest
    assert np.linalg.norm(view.eye - view.target) > 0.1


def test_what_is_around_is_not_cut_off():
    points = np.random.default_rng(6).uniform(-1, 1, (50, 3))
    assert viewpoint(points, 0.3, around=np.array([[0, 0, 90.0]])).far > 90


def test_the_viewer_stands_beside_the_first_camera():
    def azimuth(eye, target):
        T = look_at(np.array(eye), np.array(target))
        return azimuth_beside(Camera('c', 64, 48, np.eye(3), np.zeros(5), T), target) + BESIDE_RAD

    assert azimuth([2.0, 3.0, 1.0], [1.0, 2.0, 0.0]) == pytest.approx(np.pi / 4)
    # From above: where the lower edge of its image is.
    T = np.eye(4)
    T[:3, :3] = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1.0]])
    T[:3, 3] = 0.001, 0, 2
    camera = Camera('c', 64, 48, np.eye(3), np.zeros(5), T)
    assert azimuth_beside(camera, np.zeros(3)) + BESIDE_RAD == pytest.approx(np.pi)
