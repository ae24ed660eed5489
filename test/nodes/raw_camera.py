# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Drivers of depth cameras as they are, for tests of the ingestion node."""

from dataclasses import replace

from geometry_msgs.msg import TransformStamped
from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.core.types import Camera
from hooc_perception.nodes.ingestion_node import IngestionNode
from hooc_perception.ros.messages import conversions as c
from hooc_perception.ros.qos import qos
import numpy as np
from rclpy.lifecycle import TransitionCallbackReturn
from sensor_msgs.msg import CameraInfo, Image

W, H = 64, 48
ROTATION = [0.9, 0.1, -0.3, 0.3]     # of norm 1


def a_camera(name):
    K = np.array([[60.0, 0, 31.2], [0, 61.0, 23.4], [0, 0, 1]])
    return Camera(name, W, H, K, np.array([0.08, -0.2, 0.001, 0.002, 0.05]),
                  matrix_from_pose([0.1, 0.2, 1.0], ROTATION))


def resized(camera, width, height):
    """Return a camera with the same field of view at another resolution."""
    K = camera.K.copy()
    K[0] *= width / camera.width
    K[1] *= height / camera.height
    return replace(camera, width=width, height=height, K=K)


def a_depth(seed=0):
    """Return depth in whole millimetres, with holes."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(500, 1500, (H, W)).astype(np.uint16)
    counts[rng.random((H, W)) < 0.1] = 0
    return counts


class RawCamera:
    """Publishes what a driver publishes."""

    def __init__(self, bench, name, reliable=True, image=None, info=None):
        self.peer, self.name, self.camera = bench.peer, name, a_camera(name)
        make = bench.peer.create_publisher
        self.images = make(Image, image or f'{name}/depth/image_raw',
                           qos('<camera>/depth/image_raw', reliable))
        self.infos = make(CameraInfo, info or f'{name}/depth/camera_info',
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
