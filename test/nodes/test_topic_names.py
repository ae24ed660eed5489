# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Topics of drivers, by remapping or by parameters: heard, and explained when they are silent."""

import importlib.util
from pathlib import Path
import time

import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray  # noqa: E402
from hooc_perception.nodes.ingestion_node import IngestionNode  # noqa: E402
from hooc_perception.ros.health import playback  # noqa: E402
from hooc_perception.ros.inputs.camera_topics import DRIVERS  # noqa: E402
from hooc_perception.ros.qos import qos  # noqa: E402
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402
from std_msgs.msg import String  # noqa: E402

spec = importlib.util.spec_from_file_location('raw_camera', Path(__file__).with_name(
    'raw_camera.py'))
raw_camera = importlib.util.module_from_spec(spec)
spec.loader.exec_module(raw_camera)
RawCamera = raw_camera.RawCamera
S = 10 ** 9


def ingestion(bench, *names, remaps=(), **parameters):
    """Return (active ingestion node of these cameras, rectified images of the first)."""
    node = bench.add(IngestionNode, remaps, cameras=list(names), max_frame_age_s=0.0,
                     warm_up=False, **parameters)
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS, bench.reasons(node)
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    heard = bench.hear(Image, f'views/{names[0]}/depth_rect', qos('views/<camera>/depth_rect'))
    assert bench.spin(lambda: bench.peer.count_publishers(f'views/{names[0]}/depth_rect'))
    return node, heard


def sends(bench, raw, heard, number=20):
    """Send images until the node publishes a frame set; return whether it did."""
    assert bench.spin(raw.matched)
    raw.stand()
    for i in range(number):
        raw.send((i + 1) * S)
        bench.rest(0.05)
        if heard:
            return True
    return False


def test_a_remapped_camera_is_heard_and_explained_when_it_is_silent(bench):
    node, heard = ingestion(bench, 'k', explain_after_s=0.3, remaps=[
        'k/depth/image_raw:=/camera/depth/image_rect_raw',
        'k/depth/camera_info:=/camera/depth/camera_info'])
    assert bench.spin(lambda: bench.reasons(node).get('k', ' ')[0] == 'no_publisher')
    assert '/camera/depth/image_rect_raw' in bench.reasons(node)['k'][1]
    raw = RawCamera(bench, 'k', image='/camera/depth/image_rect_raw',
                    info='/camera/depth/camera_info')
    assert sends(bench, raw, heard)
    assert bench.spin(lambda: bench.reasons(node)['k'][0] == 'no_messages')


def test_cameras_that_are_remapped_to_each_other(bench):
    # Asked about a name that is remapped already, rclpy would remap it back.
    node, heard = ingestion(bench, 'a', explain_after_s=0.3, extrinsics__a=[
        0.1, 0.2, 1.0, *raw_camera.ROTATION], remaps=[
        f'{x}/depth/{topic}:={y}/depth/{topic}' for x, y in ('ab', 'ba')
        for topic in ('image_raw', 'camera_info')])
    RawCamera(bench, 'a')
    raw = RawCamera(bench, 'b', reliable=False)
    assert sends(bench, raw, heard)
    assert bench.spin(lambda: bench.reasons(node)['a'][0] == 'no_messages')
    assert '/hooc/b/depth/image_raw is published by peer' in bench.reasons(node)['a'][1]


def test_the_pace_waits_for_answers_on_a_remapped_topic(bench):
    node, heard = ingestion(bench, 'a', remaps=['objects/poses:=/cell/things'])
    answers = bench.peer.create_publisher(PoseArray, '/cell/things', qos('objects/poses'))
    raw = RawCamera(bench, 'a')
    assert sends(bench, raw, heard) and node.work.pace.is_busy(20.0)
    answers.publish(PoseArray(header=heard[0].header))
    assert bench.spin(lambda: not node.work.pace.is_busy(20.0))


@pytest.mark.parametrize('parameters, image, info', [
    ({'image_topic__left/wrist': '/arm/depth', 'info_topic__left/wrist': 'arm/info'},
     '/arm/depth', '/hooc/arm/info'),
    ({'camera_driver': 'realsense2'}, '/camera/left/wrist/depth/image_rect_raw',
     '/camera/left/wrist/depth/camera_info'),
    ({'camera_driver': 'realsense2', 'driver__left/wrist': 'zed',
      'info_topic__left/wrist': '/info'}, '/left/wrist/zed_node/depth/depth_registered', '/info')])
def test_topics_by_parameters(bench, parameters, image, info):
    node, heard = ingestion(bench, 'left/wrist', explain_after_s=0.3, **parameters)
    assert bench.spin(lambda: f'nobody publishes {image}' in bench.reasons(node).get(
        'left/wrist', ('', ''))[1])
    assert sends(bench, RawCamera(bench, 'left/wrist', image=image, info=info), heard)
    result, = node.set_parameters([Parameter('driver.left/wrist', value='zivid')])
    assert not result.successful and 'clean up' in result.reason


@pytest.mark.parametrize('names, parameters, words', [
    ('a', {'driver__a': 'kinect3'}, ['driver.a', 'kinect3', 'realsense2']),
    ('a', {'image_topic__a': 'no topic'}, ['image_topic.a', 'no topic']),
    ('ab', {'image_topic__a': '/x', 'image_topic__b': '/x'}, ['a and b', '/x', 'image_topic.a'])])
def test_topics_that_cannot_be_subscribed(bench, names, parameters, words):
    node = bench.add(IngestionNode, cameras=list(names), warm_up=False, **parameters)
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    sentence = bench.reasons(node)['node'][1]
    assert all(word in sentence for word in words), sentence


@pytest.mark.parametrize('driver, image', [
    ('realsense2', '/camera/left/depth/image_rect_raw'), ('orbbec', '/left/depth/image_raw'),
    ('azure_kinect', '/left/depth/image_raw'), ('kinect2_bridge', '/left/sd/image_depth'),
    ('zed', '/left/zed_node/depth/depth_registered'), ('zivid', '/left/depth/image')])
def test_every_driver_has_its_topics_in_the_documentation(repository, driver, image):
    topics = DRIVERS[driver]
    assert topics.image.replace('<camera>', 'left') == image
    row, = (line for line in (repository / 'docs' / 'nodes.md').read_text().splitlines()
            if line.startswith(f'| `{driver}`'))
    assert f'`{topics.image}`' in row and f'`{topics.info}`' in row


def test_a_timer_that_fails_does_not_end_the_node(bench, monkeypatch):
    node, heard = ingestion(bench, 'a', explain_after_s=0.1)

    def fail(_):
        raise KeyError('image_raw')

    monkeypatch.setattr(node.work, '_explain', fail)

    def failures():
        return [int(v.value) for s in node.diagnostics.statuses() if s.name.endswith(': timer')
                for v in s.values if v.key == 'count_unexpected']

    assert bench.spin(lambda: failures() and failures()[0] > 1)
    code, sentence = bench.reasons(node)['timer']
    assert code == 'unexpected' and "KeyError: 'image_raw'" in sentence
    assert sends(bench, RawCamera(bench, 'a'), heard)
    monkeypatch.undo()
    assert bench.spin(lambda: bench.reasons(node)['timer'][0] == 'ok')


def test_silence_after_a_bag_has_ended_is_no_fault(bench):
    node, heard = ingestion(bench, 'a', explain_after_s=0.3)
    status = bench.peer.create_publisher(String, 'replay/status', qos('replay/status'))
    status.publish(String(data='{"state": "playing"}'))
    raw = RawCamera(bench, 'a')
    assert sends(bench, raw, heard)
    status.publish(String(data='{"state": "finished"}'))
    assert bench.spin(lambda: bench.reasons(node)['a'][0] == 'bag_ended')
    bench.rest(1.0)
    assert bench.reasons(node)['a'][0] == 'bag_ended'
    # From now on there is a camera, whose silence is worth a report.
    assert bench.spin(lambda: raw.send(10 ** 12) or time.monotonic() > (
        node.work._playback._ended + playback.LATE_S + 0.1))
    raw.send(2 * 10 ** 12)
    assert bench.spin(lambda: bench.reasons(node)['a'][0] == 'no_messages')
