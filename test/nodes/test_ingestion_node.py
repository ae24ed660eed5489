# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Raw depth in, rectified frame sets out; whatever is missing is named."""

from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.core.observe import rectify
from hooc_perception.core.types import Camera, DepthView
import numpy as np
import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray, TransformStamped  # noqa: E402
from hooc_perception.nodes.ingestion_node import IngestionNode  # noqa: E402
from hooc_perception.ros import conversions as c  # noqa: E402
from hooc_perception.ros.point_clouds import cloud_rows  # noqa: E402
from hooc_perception.ros.qos import qos  # noqa: E402
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from sensor_msgs.msg import CameraInfo, Image, PointCloud2  # noqa: E402

W, H = 64, 48
ROTATION = [0.9, 0.1, -0.3, 0.3]     # of norm 1


def a_camera(name):
    K = np.array([[60.0, 0, 31.2], [0, 61.0, 23.4], [0, 0, 1]])
    return Camera(name, W, H, K, np.array([0.08, -0.2, 0.001, 0.002, 0.05]),
                  matrix_from_pose([0.1, 0.2, 1.0], ROTATION))


def a_depth(seed=0):
    """Return depth in whole millimetres, with holes."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(500, 1500, (H, W)).astype(np.uint16)
    counts[rng.random((H, W)) < 0.1] = 0
    return counts


class RawCamera:
    """Publishes what a driver publishes."""

    def __init__(self, bench, name, reliable=True):
        self.peer, self.name, self.camera = bench.peer, name, a_camera(name)
        make = bench.peer.create_publisher
        self.images = make(Image, f'{name}/depth/image_raw',
                           qos('<camera>/depth/image_raw', reliable))
        self.infos = make(CameraInfo, f'{name}/depth/camera_info',
                          qos('<camera>/depth/camera_info', reliable))
        self.poses = make(TransformStamped, f'{name}/extrinsics', qos('<camera>/extrinsics'))

    def stand(self, frame='table'):
        self.poses.publish(c.transform_message([0.1, 0.2, 1.0], ROTATION, c.header(0, frame),
                                               f'{self.name}_optical'))

    def send(self, stamp_ns, counts=None, info=True, message=None):
        head = c.header(stamp_ns, f'{self.name}_optical')
        if info:
            self.infos.publish(c.camera_info_message(self.camera, head))
        counts = a_depth() if counts is None else counts
        message = message or c.image_message(counts, '16UC1', head)
        message.header = head
        self.images.publish(message)

    def matched(self):
        return self.images.get_subscription_count() and self.infos.get_subscription_count()


def start(bench, *names, reliable=True, **parameters):
    """Return (node, raw cameras, depth images heard) of an active node, all matched."""
    node = bench.add(IngestionNode, cameras=list(names), max_frame_age_s=0.0, warm_up=False,
                     **parameters)
    raw = [RawCamera(bench, name, reliable) for name in names]
    heard = {name: bench.hear(Image, f'views/{name}/depth_rect',
                              qos('views/<camera>/depth_rect')) for name in names}
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    assert bench.spin(lambda: all(r.matched() for r in raw))
    assert bench.spin(lambda: all(
        node.count_subscribers(f'/hooc/views/{name}/depth_rect') for name in names))
    bench.rest(0.2)
    return node, raw, heard


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
    assert heard['a']


def test_extrinsics_from_parameters(bench):
    node, (raw,), heard = start(bench, 'a', extrinsics__a=[0.1, 0.2, 1.0, *ROTATION])
    raw.send(5)
    assert bench.spin(lambda: heard['a'])


@pytest.mark.parametrize('flaw, thing, reason, word', [
    ('no extrinsics', 'a', 'no_extrinsics', 'nobody says where a stands'),
    ('other frame', 'a', 'no_extrinsics', "'map'"),
    ('no info', 'a', 'no_camera_info', 'camera_info'),
    ('other size', 'views', 'unusable_frame', 'same resolution'),
    ('encoding', 'views', 'unusable_frame', 'rgb8')])
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
    assert len(heard['a']) == 1
    answers.publish(PoseArray(header=c.header(1, 'table')))
    assert bench.spin(lambda: len(heard['a']) == 2)
    # The newest, not the next in line.
    assert c.nanoseconds(heard['a'][1].header.stamp) == 3 * 10**8 + 1
    assert node.sets.drops['a', 'superseded'] == 2


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
    ({'cameras': ['a'], 'extrinsics.a': [1.0, 2.0]}, 'extrinsics.a')])
def test_bad_start_up_parameters(bench, parameters, word):
    node = bench.add(IngestionNode, **parameters)
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert word in bench.reasons(node)['node'][1]
    assert node.is_unconfigured()
