# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What a CameraInfo says of the images beside it."""

from types import SimpleNamespace

from hooc_perception.errors import HoocError
from hooc_perception.io.camera_info import camera_from_info, is_rectified, SizeMismatch
import numpy as np
import pytest

K = np.array([[360.0, 0, 256], [0, 361, 210], [0, 0, 1]])
P = np.array([[350.0, 0, 250, 0], [0, 351, 205, 0], [0, 0, 1, 0]])
LENS = [0.08, -0.27, 0, 0, 0.1]
# Measured by the vendor for one Azure Kinect in its wide field of view.
WIDE = [7.4, 4.8, 0, 0, 0.2, 7.7, 6.9, 1.2]


def info(**changes):
    """Return a CameraInfo for 512 x 424 pixels."""
    values = {'width': 512, 'height': 424, 'k': K.ravel(), 'p': P.ravel(), 'd': LENS,
              'distortion_model': 'plumb_bob', 'binning_x': 0, 'binning_y': 0,
              'roi': roi(0, 0, 0, 0)}
    return SimpleNamespace(**{**values, **changes})


def roi(x, y, width, height):
    """Return a RegionOfInterest."""
    return SimpleNamespace(x_offset=x, y_offset=y, width=width, height=height, do_rectify=False)


def camera(size=None, rectified=False, **changes):
    """Return the Camera of a changed CameraInfo."""
    return camera_from_info('c', info(**changes), size, rectified, 'c/camera_info')


@pytest.mark.parametrize('topic, rectified', [
    ('/c/depth/image_raw', False), ('/c/depth/image_rect', True), ('/k/sd/image_depth_rect', True),
    ('/c/depth/image_rect_raw', False), ('/c/depth/image', False), ('/c/direct/image', False),
    ('/c/depth/image_rectified', True), ('/rect/depth/image_raw', False),
    ('/c/depth/rect_image', True)])
def test_the_name_says_whether_images_are_rectified(topic, rectified):
    assert is_rectified(topic) == rectified


def test_rectified_images_are_described_by_P():
    raw, rect = camera(), camera(rectified=True)
    np.testing.assert_array_equal(raw.K, K)
    np.testing.assert_array_equal(raw.D, LENS)
    np.testing.assert_array_equal(rect.K, P[:, :3])
    assert not rect.D.any()
    # Without P, or with a lens that we do not know, K is what there is.
    np.testing.assert_array_equal(camera(rectified=True, p=np.zeros(12)).K, K)
    assert not camera(rectified=True, distortion_model='equidistant').D.any()


@pytest.mark.parametrize('size, changes, fx, fy, cx, cy', [
    ((256, 212), {'binning_x': 2, 'binning_y': 2}, 180, 180.5, 128, 105),
    ((256, 106), {'binning_x': 2, 'binning_y': 4}, 180, 90.25, 128, 52.5),
    ((170, 424), {'binning_x': 3, 'binning_y': 1}, 120, 361, 256 / 3, 210),
    # What some drivers state without doing it, or have put into K already.
    ((512, 424), {'binning_x': 2, 'binning_y': 2}, 360, 361, 256, 210),
    ((512, 424), {'binning_x': 1, 'binning_y': 1, 'roi': roi(0, 0, 512, 424)}, 360, 361, 256, 210),
    ((200, 100), {'roi': roi(100, 60, 200, 100)}, 360, 361, 156, 150),
    ((100, 50), {'roi': roi(100, 60, 200, 100), 'binning_x': 2, 'binning_y': 2},
     180, 180.5, 78, 75),
    # An upper left quarter: its principal point is in its corner, which is no fault.
    ((256, 212), {'roi': roi(0, 0, 256, 212)}, 360, 361, 256, 210),
])
def test_binning_and_regions_of_interest(size, changes, fx, fy, cx, cy):
    found = camera(size, **changes)
    assert (found.width, found.height) == size
    np.testing.assert_allclose(found.K, [[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    np.testing.assert_array_equal(found.D, LENS)


@pytest.mark.parametrize('size, words', [((256, 212), 'state binning_x'),
                                         ((640, 480), 'the same resolution')])
def test_images_of_another_size(size, words):
    with pytest.raises(SizeMismatch, match=f'width 512 and height 424.*{words}'):
        camera(size)


@pytest.mark.parametrize('scale', [0.4, 0.5, 1.5, 2.0, 3.0])
def test_calibrations_of_another_resolution(scale):
    scaled = np.diag([scale, scale, 1]) @ K
    with pytest.raises(HoocError, match='principal point.*512 x 424'):
        camera(k=scaled.ravel())


@pytest.mark.parametrize('centre', [(256, 210), (230, 260), (330, 210), (300, 250)])
def test_principal_points_of_real_lenses(centre):
    k = K.copy()
    k[:2, 2] = centre
    assert tuple(camera(k=k.ravel()).K[:2, 2]) == centre


@pytest.mark.parametrize('d, model', [
    ([-1385.2, 842.6, 3120.5, -77.1, 12.9], 'plumb_bob'), ([300, 0, 0, 0, 0], 'plumb_bob'),
    ([-60, 0, 0, 0, 0], 'plumb_bob'), ([0, 0, 200.0, 0, 0], 'plumb_bob'),
    ([250, 20, 0, 0, 3, -30, 4, 1], 'rational_polynomial')])
def test_distortion_that_no_lens_has(d, model):
    with pytest.raises(HoocError, match='coefficients.*no lens'):
        camera(d=d, distortion_model=model)


@pytest.mark.parametrize('d, model', [
    (LENS, 'plumb_bob'), ([-0.35, 0.12, 0.001, 0, 0], 'plumb_bob'), ([], ''),
    (WIDE, 'rational_polynomial'), ([0] * 5, 'none'), ([0] * 4, 'radtan'),
    # Numerator and denominator of hundreds that cancel are a lens.
    ([-1385.2, 842.6, 0, 0, 12.9, -1385.3, 842.5, 12.9], 'rational_polynomial')])
def test_distortion_of_real_lenses(d, model):
    assert camera(d=d, distortion_model=model).distortion_model in ('plumb_bob',
                                                                    'rational_polynomial')


@pytest.mark.parametrize('d', [[0] * 4, [0.1, 0, 0, 0]])
@pytest.mark.parametrize('model', ['equidistant', 'fisheye', 'kannala_brandt4', 'thin_prism'])
def test_lenses_that_are_no_pinhole_are_refused_whatever_their_coefficients(d, model):
    with pytest.raises(HoocError, match=f"distortion model '{model}'"):
        camera(d=d, distortion_model=model)


@pytest.mark.parametrize('changes, words', [
    ({'k': np.zeros(9)}, 'no calibration'), ({'width': 0}, 'fill in width'),
    ({'k': np.full(9, np.nan)}, 'finite'), ({'d': [0.1] * 3}, 'takes 4 or 5')])
def test_no_calibration(changes, words):
    with pytest.raises(HoocError, match=words):
        camera(**changes)
