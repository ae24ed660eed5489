# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One camera's messages become frames, one by one, whatever came before."""

import numpy as np
import pytest

pytest.importorskip('rclpy')

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.types import Camera
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
