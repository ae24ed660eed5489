# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Raw depth in, rectified frame sets out; whatever is missing is named."""

import importlib.util
from pathlib import Path

from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import DepthView
import numpy as np
import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray, TransformStamped  # noqa: E402
from hooc_perception.nodes.ingestion_node import IngestionNode
from hooc_perception.ros.messages import conversions as c
from hooc_perception.ros.messages.point_clouds import cloud_rows
from hooc_perception.ros.qos import qos
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import CameraInfo, PointCloud2  # noqa: E402
from std_msgs.msg import Header  # noqa: E402

spec = importlib.util.spec_from_file_location('raw_camera', Path(__file__).with_name(
    'raw_camera.py'))
raw_camera = importlib.util.module_from_spec(spec)
spec.loader.exec_module(raw_camera)
W, H, ROTATION = raw_camera.W, raw_camera.H, raw_camera.ROTATION
a_depth, start = raw_camera.a_depth, raw_camera.start


def test_three_cameras_become_one_set(bench):
    node, raw, heard = start(bench, 'a', 'b', 'c')
    infos = bench.hear(CameraInfo, 'views/b/camera_info', qos('views/<camera>/camera_info'))
    poses = bench.hear(TransformStamped, 'views/b/extrinsics', qos('views/<camera>/extrinsics'))
    for i, camera in enumerate(raw):
        camera.stand()
        bench.rest(0.1)
        camera.send(10**18 + (2 - i) * 10**7, a_depth(i))
    assert bench.spin(lambda: all(heard.values()) and infos and poses)
    for i, camera in enumerate(raw):
        (image,) = heard[camera.name]
        # The stamp of the oldest, in each image's own frame.
        assert c.nanoseconds(image.header.stamp) == 10**18
        assert image.header.frame_id == f'{camera.name}_optical'
        depth = a_depth(i).astype(np.float32) * np.float32(0.001)
        depth[depth == 0] = np.nan
        expected = rectify(DepthView(camera.camera, depth))
        np.testing.assert_array_equal(c.depth_from_message(image), expected.depth)
    again = c.camera_from_messages('b', infos[0], poses[0])
    expected = rectify(DepthView(raw[1].camera, np.ones((H, W), np.float32))).camera
    assert again.T_world_camera.tobytes() == expected.T_world_camera.tobytes()
    np.testing.assert_array_equal(again.D, 0)
    assert poses[0].header.frame_id == 'table'


def test_padded_big_endian_images(bench):
    node, (raw,), heard = start(bench, 'a')
    raw.stand()
    bench.rest(0.2)
    raw.send(1, a_depth())
    counts = np.zeros((H, W + 3), '>u2')
    counts[:, :W] = a_depth()
    odd = c.image_message(counts, '16UC1', c.header(0, ''))
    odd.width, odd.is_bigendian = W, 1
    assert bench.spin(lambda: len(heard['a']) == 1)
    raw.send(2 * 10**9, message=odd)
    assert bench.spin(lambda: len(heard['a']) == 2)
    assert heard['a'][0].data == heard['a'][1].data


def test_best_effort_cameras_are_heard(bench):
    node, (raw,), heard = start(bench, 'a', reliable=False)
    raw.stand()
    for i in range(20):
        raw.send(i * 10**8 + 1)
        bench.rest(0.05)
    assert bench.spin(lambda: heard['a'])


def test_extrinsics_from_parameters(bench):
    node, (raw,), heard = start(bench, 'a', extrinsics__a=[0.1, 0.2, 1.0, *ROTATION])
    raw.send(5)
    assert bench.spin(lambda: heard['a'])


@pytest.mark.parametrize('flaw, thing, reason, word', [
    ('no extrinsics', 'a', 'no_extrinsics', 'nobody says where a stands'),
    ('other frame', 'a', 'no_extrinsics', "'map'"),
    ('no info', 'a', 'no_camera_info', 'camera_info'),
    ('other size', 'a', 'size_mismatch', 'same resolution'),
    ('encoding', 'a', 'bad_image', 'rgb8')])
def test_flaws_are_named(bench, flaw, thing, reason, word):
    node, (raw,), heard = start(bench, 'a')
    if flaw != 'no extrinsics':
        raw.stand('map' if flaw == 'other frame' else 'table')
    bench.rest(0.2)
    message = None
    if flaw == 'encoding':
        message = c.image_message(np.zeros((H, W * 3), np.uint8), 'rgb8', c.header(0, ''))
        message.width = W
    for i in range(3):
        raw.send(i * 10**8 + 1, a_depth()[:20] if flaw == 'other size' else None,
                 info=flaw != 'no info', message=message)
        bench.rest(0.05)
    assert bench.spin(lambda: thing in bench.reasons(node))
    code, sentence = bench.reasons(node)[thing]
    assert code == reason and word in sentence
    assert heard['a'] == []


def test_next_set_waits_for_the_answer(bench):
    node, (raw,), heard = start(bench, 'a', wait_for_answer_s=60.0)
    answers = bench.peer.create_publisher(PoseArray, 'objects/poses', qos('objects/poses'))
    assert bench.spin(lambda: node.count_publishers('/hooc/objects/poses'))
    raw.stand()
    bench.rest(0.2)
    for i in range(4):
        raw.send(i * 10**8 + 1)
        bench.rest(0.1)
    drops = node.work.assembly.sets.drops
    assert bench.spin(lambda: drops['a', 'superseded'] == 2)
    assert len(heard['a']) == 1
    answers.publish(PoseArray(header=c.header(1, 'table')))
    assert bench.spin(lambda: len(heard['a']) == 2)
    # The newest, not the next in line.
    assert c.nanoseconds(heard['a'][1].header.stamp) == 3 * 10**8 + 1
    assert drops['a', 'superseded'] == 2


def test_a_refused_set_is_not_waited_for(bench):
    node, (raw,), heard = start(bench, 'a', wait_for_answer_s=600.0)
    bench.peer.create_publisher(PoseArray, 'objects/poses', qos('objects/poses'))
    refusals = bench.peer.create_publisher(Header, 'views/refused', qos('views/refused'))
    assert bench.spin(lambda: node.count_publishers('/hooc/objects/poses')
                      and refusals.get_subscription_count())
    raw.stand()
    bench.rest(0.2)
    for i in range(2):
        raw.send(i * 10**8 + 1)
        bench.rest(0.1)
    assert bench.spin(lambda: heard['a'])
    assert len(heard['a']) == 1
    refusals.publish(c.header(77, 'table'))     # of another set
    bench.rest(0.2)
    assert len(heard['a']) == 1
    refusals.publish(c.header(1, 'table'))
    assert bench.spin(lambda: len(heard['a']) == 2)
    assert node.diagnostics._counts['chain', 'refused'] == 1


def test_more_cameras_asked_for_than_there_are_is_said_while_running(bench):
    node, (raw,), heard = start(bench, 'a')
    raw.stand()
    bench.rest(0.2)
    assert node.set_parameters([Parameter('min_cameras', value=2)])[0].successful
    raw.send(1)
    assert bench.spin(lambda: bench.reasons(node).get('views', [''])[0] == 'too_few_cameras')
    assert 'min_cameras is 2' in bench.reasons(node)['views'][1] and not heard['a']


def test_fused_cloud_only_for_listeners(bench):
    node, (raw,), heard = start(bench, 'a')
    raw.stand()
    bench.rest(0.2)
    clouds = bench.hear(PointCloud2, 'views/points', qos('views/points'))
    assert bench.spin(lambda: node.count_subscribers('/hooc/views/points'))
    bench.rest(0.2)
    raw.send(7)
    assert bench.spin(lambda: clouds)
    rows = cloud_rows(clouds[0], ['x', 'y', 'z', 'camera'])
    depth = c.depth_from_message(heard['a'][0])
    assert len(rows) == np.isfinite(depth).sum() and not rows['camera'].any()
    assert clouds[0].header.frame_id == 'table'


def test_inactive_is_silent_and_everything_can_be_done_again(bench):
    node, (raw,), heard = start(bench, 'a')
    raw.stand()
    for i in range(2):
        bench.rest(0.2)
        raw.send(i * 10**9 + 1)
        assert bench.spin(lambda: len(heard['a']) == i + 1)
        assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
        raw.send(i * 10**9 + 2)
        bench.rest()
        assert len(heard['a']) == i + 1
        assert node.trigger_cleanup() == TransitionCallbackReturn.SUCCESS
        assert bench.spin(lambda: not raw.matched())
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
        assert bench.spin(raw.matched)


@pytest.mark.parametrize('parameters, word', [
    ({'cameras': ['a', 'a']}, 'twice'), ({}, 'model is empty'),
    ({'cameras': ['a', 'b'], 'min_cameras': 3}, 'min_cameras is 3'),
    ({'cameras': ['a'], 'extrinsics.a': [1.0, 2.0]}, 'extrinsics.a')])
def test_bad_start_up_parameters(bench, parameters, word):
    node = bench.add(IngestionNode, **parameters)
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert word in bench.reasons(node)['node'][1]
    assert node.is_unconfigured()
