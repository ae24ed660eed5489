# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Live cameras of which only compressed depth arrives, as over a wireless network."""

import importlib.util
from pathlib import Path
import struct

import cv2
import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy')

from hooc_perception.nodes.ingestion_node import IngestionNode  # noqa: E402
from hooc_perception.ros.messages import conversions as c  # noqa: E402
from hooc_perception.ros.qos import qos  # noqa: E402
from sensor_msgs.msg import CompressedImage, Image  # noqa: E402

spec = importlib.util.spec_from_file_location('raw_camera', Path(__file__).with_name(
    'raw_camera.py'))
raw_camera = importlib.util.module_from_spec(spec)
spec.loader.exec_module(raw_camera)
S = 10 ** 9


def test_compressed_images_are_used_until_raw_ones_come(bench):
    node = bench.add(IngestionNode, cameras=['a'], max_frame_age_s=0.0, warm_up=False)
    # It publishes its raw images elsewhere.
    raw = raw_camera.RawCamera(bench, 'a', image='elsewhere')
    packed = bench.peer.create_publisher(CompressedImage, 'a/depth/image_raw/compressedDepth', 1)
    heard = bench.hear(Image, 'views/a/depth_rect', qos('views/<camera>/depth_rect'))
    assert node.trigger_configure() and node.trigger_activate()
    assert bench.spin(lambda: packed.get_subscription_count()
                      and raw.infos.get_subscription_count())
    assert bench.spin(lambda: node.count_subscribers('/hooc/views/a/depth_rect'))
    raw.stand()
    bench.rest(0.2)
    counts = raw_camera.a_depth()
    stamp = 1000 * S

    def send(data):
        nonlocal stamp
        stamp += S // 10
        head = c.header(stamp, 'a_optical')
        raw.infos.publish(c.camera_info_message(raw.camera, head))
        packed.publish(CompressedImage(header=head, format='16UC1; compressedDepth png',
                                       data=list(data)))
        bench.rest(0.05)

    good = struct.pack('<iff', 0, 0, 0) + cv2.imencode('.png', counts)[1].tobytes()
    send(good[:40])
    assert bench.spin(lambda: bench.reasons(node).get('a', ' ')[0] == 'bad_image')
    for _ in range(40):
        send(good)
        if heard:
            break
    assert np.nanmax(c.depth_from_message(heard[-1])) == pytest.approx(counts.max() / 1000,
                                                                       abs=0.01)
    late = bench.peer.create_publisher(Image, 'a/depth/image_raw', qos(
        '<camera>/depth/image_raw', True))
    assert bench.spin(lambda: late.get_subscription_count()
                      and not packed.get_subscription_count())


def test_what_is_stated_of_images_are_parameters(bench):
    node = bench.add(IngestionNode, cameras=['a', 'b'], warm_up=False,
                     **{'rectified.a': True, 'depth_unit.b': 0.0001})
    assert node.trigger_configure()
    assert node.images.notes('a', '/a/depth/image_raw') == (None, True)
    assert node.images.notes('b', '/b/depth/image_rect') == (0.0001, True)
    assert node.images.notes('b', '/b/depth/image_raw') == (0.0001, False)
    other = bench.add(IngestionNode, cameras=['a'], warm_up=False, **{'rectified.a': 'perhaps'})
    assert other.trigger_configure() != rclpy.lifecycle.TransitionCallbackReturn.SUCCESS
