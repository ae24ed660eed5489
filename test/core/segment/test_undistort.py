# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Undistortion against OpenCV."""

import cv2
from hooc_perception.core.geometry import back_project
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.kernels.undistort import rectify_nearest
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
import numpy as np
import pytest

K = np.array([[183.0, 0, 80.3], [0, 185.0, 58.9], [0, 0, 1]])
LENSES = {'plumb_bob': [0.09, -0.27, 0.002, -0.003, 0.09],
          'barrel': [-0.3, 0.1, 0.0, 0.0, 0.0],
          'rational_polynomial': [0.5, -0.2, 0.001, 0.002, 0.01, 0.6, -0.15, 0.02]}
SHAPE = (120, 160)


def eight(D):
    """Return the (8,) coefficients that the kernel takes."""
    return np.append(np.array(D, float), np.zeros(8 - len(D)))


def numbered():
    """Return an image whose values are the pixels' flat indices, exact in float32."""
    return np.arange(SHAPE[0] * SHAPE[1], dtype=np.float32).reshape(SHAPE)


@pytest.mark.parametrize('lens', LENSES)
def test_the_map_is_opencvs(lens):
    D = np.array(LENSES[lens])
    out = rectify_nearest(numbered(), K, eight(D))
    u, v = cv2.initUndistortRectifyMap(K, D, None, K, SHAPE[::-1], cv2.CV_32FC1)
    column, row = np.floor(u + 0.5).astype(int), np.floor(v + 0.5).astype(int)
    # Where a ray falls half-way between two pixels, OpenCV's rounding to float32 decides.
    clear = (np.abs(u % 1 - 0.5) > 1e-4) & (np.abs(v % 1 - 0.5) > 1e-4)
    inside = (column >= 0) & (row >= 0) & (column < SHAPE[1]) & (row < SHAPE[0])
    expected = np.where(inside, row * SHAPE[1] + column, np.nan)
    assert clear.mean() > 0.99
    np.testing.assert_array_equal(out[clear], expected[clear].astype(np.float32))
    moved = np.abs(out - numbered())[clear & inside] > 0
    assert moved.mean() > 0.1, 'the lens hardly distorts'


@pytest.mark.parametrize('lens', LENSES)
def test_opencv_undistorts_the_raw_pixel_to_where_it_was_put(lens):
    D = np.array(LENSES[lens])
    out = rectify_nearest(numbered(), K, eight(D))
    rows, columns = np.nonzero(np.isfinite(out))
    raw = out[rows, columns].astype(int)
    points = np.column_stack([raw % SHAPE[1], raw // SHAPE[1]]).astype(np.float64)
    back = cv2.undistortPoints(
        points[:, None], K, D, R=np.eye(3), P=K,
        criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10))[:, 0]
    off = np.abs(back - np.column_stack([columns, rows])).max(1)
    # Nearest neighbour: half a raw pixel, stretched by the lens.
    assert np.median(off) < 0.5
    assert off.max() < 1.0


def test_no_distortion_is_the_identity():
    np.testing.assert_array_equal(rectify_nearest(numbered(), K, np.zeros(8)), numbered())


@pytest.mark.parametrize('lens', LENSES)
def test_rectify_uses_it_and_says_that_none_is_left(lens):
    D = np.array(LENSES[lens])
    model = lens if lens.startswith('rational') else 'plumb_bob'
    camera = Camera('kinect1', SHAPE[1], SHAPE[0], K, D, np.eye(4), model)
    depth = (0.5 + numbered() / numbered().size).astype(np.float32)
    view = rectify(DepthView(camera, depth))
    np.testing.assert_array_equal(view.depth, rectify_nearest(depth, K, eight(D)))
    assert not view.camera.D.any()
    np.testing.assert_array_equal(view.camera.K, K)
    np.testing.assert_array_equal(rectify(DepthView(view.camera, view.depth)).depth, view.depth)


def test_rectify_takes_the_skew_out():
    skewed = K + [[0, 8.0, 0], [0, 0, 0], [0, 0, 0]]
    v, u = np.mgrid[:SHAPE[0], :SHAPE[1]]
    # A slanted plane: the ray through a raw pixel is inv(K) (u, v, 1).
    x, y, _ = np.linalg.inv(skewed) @ np.stack([u, v, np.ones_like(u)]).reshape(3, -1)
    depth = (1 / (1 + 0.3 * x - 0.2 * y)).reshape(SHAPE).astype(np.float32)
    view = rectify(DepthView(Camera('c', *SHAPE[::-1], skewed, np.zeros(5), np.eye(4)), depth))
    np.testing.assert_array_equal(view.camera.K, K)
    points = back_project(view.depth, view.camera)
    off = points[..., 2] + 0.3 * points[..., 0] - 0.2 * points[..., 1] - 1
    assert np.nanmax(abs(off)) < 0.002
    assert np.isfinite(off).mean() > 0.95


def test_rectify_takes_impossible_readings_for_none():
    camera = Camera('c', 6, 1, K, np.zeros(5), np.eye(4))
    depth = np.array([[0.0, -1.0, np.inf, np.nan, 1.0, 9.0]], np.float32)
    kept = rectify(DepthView(camera, depth), ObserveConfig(max_depth_m=8.0)).depth
    np.testing.assert_array_equal(np.isfinite(kept), [[False, False, False, False, True, False]])
    farther = rectify(DepthView(camera, depth), ObserveConfig(max_depth_m=9.5)).depth
    assert farther[0, 5] == 9.0
    assert np.isnan(depth).sum() == 1, 'the input was written to'


def test_rectify_names_the_camera_whose_image_has_another_size():
    camera = Camera('kinect2', 160, 120, K, np.zeros(5), np.eye(4))
    with pytest.raises(HoocError, match='kinect2 is 80 x 60 .* 160 x 120'):
        rectify(DepthView(camera, np.ones((60, 80), np.float32)))
    with pytest.raises(HoocError, match='kinect2 is 120 x 160'):
        rectify(DepthView(camera, np.ones((160, 120), np.float32)))
