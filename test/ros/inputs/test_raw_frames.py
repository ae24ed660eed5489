# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One camera's messages become frames, one by one, whatever came before."""

import numpy as np
import pytest

pytest.importorskip('rclpy')

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.types import Camera
from hooc_perception.ros.inputs.image_notes import ImageNotes
from hooc_perception.ros.inputs.raw_frames import FrameRefused, RawFrames
from hooc_perception.ros.messages import conversions as c

H, W = 24, 32
HEAD = c.header(0, 'a_optical')
INFO = c.camera_info_message(
    Camera('a', W, H, np.array([[30.0, 0, 15.5], [0, 30, 11.5], [0, 0, 1]]), np.zeros(5),
           np.eye(4)), HEAD)
STANDS = c.transform_message([0.0, 0, 1], [1.0, 0, 0, 0], c.header(0, 'table'), 'a_optical')
METRES = c.image_message(np.full((H, W), 0.9, np.float32), '32FC1', HEAD)
MILLIMETRES = c.image_message(np.full((H, W), 900, np.uint16), '16UC1', HEAD)


def outcome(frames, image):
    """Return the median depth of an image in metres, or the code of its refusal."""
    try:
        depth = frames.decode(image, INFO, STANDS, ObserveConfig()).depth
        return round(float(np.median(depth)), 3)
    except FrameRefused as refused:
        return refused.code


@pytest.mark.parametrize('good', [METRES, MILLIMETRES])
@pytest.mark.parametrize('values, encoding', [
    (np.full((H, W), 900, np.float32), '32FC1'), (np.full((H, W), 1, np.uint16), '16UC1')])
def test_a_stream_that_changes_to_a_wrong_unit_is_refused_until_it_is_right(
        good, values, encoding):
    frames, wrong = RawFrames('a'), c.image_message(values, encoding, HEAD)
    assert outcome(frames, good) == 0.9
    assert {outcome(frames, wrong) for _ in range(30)} == {'wrong_unit'}
    assert outcome(frames, good) == 0.9


def test_binned_images_of_a_full_calibration():
    image = c.image_message(np.full((H // 2, W // 4), 900, np.uint16), '16UC1', HEAD)
    info = c.camera_info_message(Camera('a', W, H, np.array(
        [[30.0, 0, 15.5], [0, 30, 11.5], [0, 0, 1]]), np.zeros(5), np.eye(4)), HEAD)
    frames = RawFrames('a')
    with pytest.raises(FrameRefused) as refused:
        frames.decode(image, info, STANDS, ObserveConfig())
    assert refused.value.code == 'size_mismatch'
    info.binning_x, info.binning_y = 4, 2
    camera = frames.decode(image, info, STANDS, ObserveConfig()).camera
    np.testing.assert_allclose(camera.K, [[7.5, 0, 15.5 / 4], [0, 15, 11.5 / 2], [0, 0, 1]])


def test_what_the_user_states_of_the_images_holds():
    info = c.camera_info_message(Camera('a', W, H, np.array(
        [[30.0, 0, 15.5], [0, 30, 11.5], [0, 0, 1]]), np.full(5, 0.01), np.eye(4)), HEAD)
    info.p[0] = 29.0
    tenths = c.image_message(np.full((H, W), 9000, np.uint16), '16UC1', HEAD)
    stated = ImageNotes()
    frames = RawFrames('a', lambda: stated)
    assert outcome(frames, tenths) == 'wrong_unit'
    assert frames.decode(METRES, info, STANDS, ObserveConfig()).camera.D.any()
    stated = ImageNotes(0.0001, True)
    frame = frames.decode(tenths, info, STANDS, ObserveConfig())
    assert np.median(frame.depth) == pytest.approx(0.9)
    assert frame.camera.K[0, 0] == 29 and not frame.camera.D.any()


@pytest.mark.parametrize('field, value', [
    ('k', [120.0, 0, 62, 0, 120, 46, 0, 0, 1]), ('d', [-1385.2, 842.6, 3120.5, -77.1, 12.9]),
    ('distortion_model', 'equidistant')])
def test_calibrations_that_bags_refuse_are_refused_live(field, value):
    info = c.camera_info_message(Camera('a', W, H, np.array(
        [[30.0, 0, 15.5], [0, 30, 11.5], [0, 0, 1]]), np.zeros(5), np.eye(4)), HEAD)
    setattr(info, field, value)
    with pytest.raises(FrameRefused) as refused:
        RawFrames('a').decode(METRES, info, STANDS, ObserveConfig())
    assert refused.value.code == 'bad_calibration'
