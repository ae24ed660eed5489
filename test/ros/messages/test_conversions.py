# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Camera messages to core types and back, to the last bit."""

from dataclasses import replace

from hooc_perception.core.geometry import matrix_from_pose, pose_from_matrix
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
import numpy as np
import pytest

pytest.importorskip('rclpy')

from hooc_perception.ros.messages import conversions as c
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402


def sent(message):
    """Return the message as it comes out at the other end of a wire."""
    return deserialize_message(serialize_message(message), type(message))


def a_camera(rng, translation, rotation):
    K = np.array([[365.1, 0, 25.3], [0, 365.4, 20.6], [0, 0, 1]]) + rng.random() * 1e-9
    K[2] = [0, 0, 1]
    K[[0, 1], [1, 0]] = 0
    return Camera('left', 51, 42, K, rng.normal(size=5) * 0.1,
                  matrix_from_pose(translation, rotation))


@pytest.mark.parametrize('stamp_ns', [0, 1, 999_999_999, 1_000_000_000, 1_732_262_400_123_456_789])
def test_stamps_come_back(stamp_ns):
    assert c.nanoseconds(c.time_message(stamp_ns)) == stamp_ns


def test_depth_comes_back_with_its_holes():
    rng = np.random.default_rng(0)
    depth = rng.random((42, 51), np.float32) + 0.5
    depth[rng.random(depth.shape) < 0.3] = np.nan
    message = sent(c.depth_message(depth, c.header(5, 'left')))
    assert (message.encoding, message.step, message.header.frame_id) == ('32FC1', 204, 'left')
    assert c.depth_from_message(message).tobytes() == depth.tobytes()


def test_depth_of_a_slice_is_packed():
    depth = np.arange(1, 241, dtype=np.float32).reshape(12, 20)[::2, 1::3]
    np.testing.assert_array_equal(
        c.depth_from_message(c.depth_message(depth, c.header(0, ''))), depth)


def test_labels_come_back():
    labels = np.random.default_rng(1).integers(0, 26, (7, 9)).astype(np.uint8)
    np.testing.assert_array_equal(
        c.labels_from_message(sent(c.labels_message(labels, c.header(0, '')))), labels)


ROTATIONS = [*np.random.default_rng(0).normal(size=(200, 4)),
             # Half turns, quarter turns, equal components: where signs and pivots may flip.
             [1, 0, 0, 0], [1, 0, 0, 1e-17], [1, 0, 0, -1e-17], [0.5, 0.5, 0.5, 0.5],
             [-0.5, 0.5, -0.5, 0.5], [np.sqrt(.5), 0, 0, np.sqrt(.5)], [0, 0, 0, 1],
             [np.sqrt(.5), -np.sqrt(.5), 0, 0], [0.6, -0.6, 0.2, 0.1]]


def test_camera_is_the_same_after_every_hop():
    """A scene file's pose, a bag's quaternion of its matrix, two topics: every bit agrees."""
    rng = np.random.default_rng(1)
    for rotation in ROTATIONS:
        translation = rng.normal(size=3)
        # As a file gives it: rounded, so not quite of norm 1, and of either sign.
        rotation = np.round(rotation / np.linalg.norm(rotation), 5)
        T_file = matrix_from_pose(translation, rotation)
        expected = rectify(DepthView(a_camera(rng, translation, rotation),
                                     np.ones((42, 51), np.float32))).camera
        assert np.abs(expected.T_world_camera - T_file).max() < 2e-9
        info = sent(c.camera_info_message(expected, c.header(1, 'left')))
        transform = sent(c.transform_message(*pose_from_matrix(T_file), c.header(1, 'table'), ''))
        for _ in range(3):
            again = c.camera_from_messages('left', info, transform)
            for name in ('K', 'D', 'T_world_camera'):
                assert getattr(again, name).tobytes() == getattr(expected, name).tobytes(), name
            assert (again.width, again.height, again.distortion_model) == (51, 42, 'plumb_bob')
            info = sent(c.camera_info_message(again, c.header(2, 'left')))
            transform = sent(c.transform_message(*pose_from_matrix(again.T_world_camera),
                                                 c.header(2, 'table'), 'left'))


def test_rational_polynomial_is_kept():
    camera = replace(a_camera(np.random.default_rng(0), np.zeros(3), [0, 0, 0, 1]),
                     D=np.arange(8) * 0.01, distortion_model='rational_polynomial')
    transform = c.transform_message([0, 0, 0], [0, 0, 0, 1], c.header(0, 'table'), 'left')
    again = c.camera_from_messages('left', c.camera_info_message(camera, c.header(0, '')),
                                   transform)
    np.testing.assert_array_equal(again.D, camera.D)
    assert again.distortion_model == 'rational_polynomial'


@pytest.mark.parametrize('field, value, word', [
    ('k', np.zeros(9), 'calibration'), ('k', [50.0, 9, 25, 0, 50, 20, 0, 0, 1], 'skew'),
    ('width', 0, 'width'), ('distortion_model', 'equidistant', 'plumb_bob'),
    ('d', [0.1] * 6, 'takes 4 or 5'),
    ('d', [np.nan] * 5, 'finite'), ('k', np.full(9, np.inf), 'finite')])
def test_bad_calibration_gets_a_sentence(field, value, word):
    camera = a_camera(np.random.default_rng(0), np.zeros(3), [0, 0, 0, 1])
    info = c.camera_info_message(camera, c.header(0, ''))
    setattr(info, field, value)
    transform = c.transform_message([0, 0, 0], [0, 0, 0, 1], c.header(0, 'table'), 'left')
    with pytest.raises(HoocError, match='left') as error:
        c.camera_from_messages('left', info, transform)
    assert word in str(error.value)


@pytest.mark.parametrize('pose', [([0, 0, 0], [0, 0, 0, 0]), ([np.nan, 0, 0], [0, 0, 0, 1]),
                                  ([0, 0, 0], [1, 1, 1, 1])])
def test_extrinsics_that_are_no_transform(pose):
    info = c.camera_info_message(
        a_camera(np.random.default_rng(0), np.zeros(3), [0, 0, 0, 1]), c.header(0, ''))
    with pytest.raises(HoocError, match='extrinsics of left'):
        c.camera_from_messages('left', info,
                               c.transform_message(*pose, c.header(0, 'table'), 'left'))


@pytest.mark.parametrize('n', [0, 1, 115])
def test_poses_come_back(n):
    rng = np.random.default_rng(n)
    t, q = rng.normal(size=(n, 3)), rng.normal(size=(n, 4))
    message = sent(c.pose_array_message(t, q, c.header(3, 'table')))
    t_again, q_again = c.poses_from_message(message)
    assert t_again.tobytes() == t.tobytes() and q_again.tobytes() == q.tobytes()
    assert t_again.shape == (n, 3) and q_again.shape == (n, 4)
