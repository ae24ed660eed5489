# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One raw depth camera: pairs images with calibration, knows where the camera stands."""

from collections import OrderedDict

from geometry_msgs.msg import TransformStamped
from hooc_perception.errors import HoocError
from hooc_perception.ros.conversions import header, nanoseconds, transform_message
from hooc_perception.ros.qos import auto_reliability, overridable, qos
from rcl_interfaces.msg import ParameterDescriptor
from sensor_msgs.msg import CameraInfo, Image

try:    # Not on PyPI; there on a ROS installation.
    from rclpy.time import Time
    from tf2_ros import Buffer, TransformException, TransformListener
except ImportError:
    Buffer = None


class TfPoses:
    """Camera poses from /tf and /tf_static, where tf2 is installed; else always None."""

    def __init__(self, node):
        """Listen for `node`."""
        self._buffer = Buffer() if Buffer else None
        self._listener = TransformListener(self._buffer, node) if Buffer else None

    def lookup(self, target, source):
        """Return the TransformStamped T_target_source, or None."""
        if self._buffer is None or not source:
            return None
        try:
            return self._buffer.lookup_transform(target, source, Time())
        except TransformException:
            return None


def declared_pose(node, name):
    """
    Return the seven numbers x y z qx qy qz qw of parameter `extrinsics.<camera>`, or ().

    :raises HoocError: for another number of numbers.
    """
    key = f'extrinsics.{name}'
    if not node.has_parameter(key):
        node.declare_parameter(key, [], ParameterDescriptor(
            dynamic_typing=True, description=f'Pose of the optical frame of {name} in the target '
            'frame: x y z qx qy qz qw; empty takes topics or tf. [m]'))
    pose = tuple(node.get_parameter(key).value)
    if len(pose) not in (0, 7):
        raise HoocError(f'parameter {key} has {len(pose)} numbers; give x y z qx qy qz qw')
    return tuple(float(x) for x in pose)


class CameraInput:
    """
    Subscribe to one camera; call back with (image, info, transform) messages that agree.

    :param node: a StageNode whose config has target_frame and image_reliability.
    :param pose: seven numbers x y z qx qy qz qw (T_target_camera) or () for topics and tf.
    :param callback: called as callback(name, image, info, transform).
    """

    def __init__(self, node, name, pose, tf, callback):
        """Create the subscriptions; the executor serves them in the order of creation."""
        self.name, self.node, self._tf, self._callback = name, node, tf, callback
        self._pose, self._latched = pose, None
        self._infos, self._images, self._last_info = OrderedDict(), OrderedDict(), None
        node.subscription(TransformStamped, '<camera>/extrinsics', self._on_extrinsics,
                          f'{name}/extrinsics')
        self._reliable = None
        self._subscriptions = []
        node.owned(lambda _: self._unsubscribe(), None)
        self.adapt_reliability()

    # Reliability.

    def adapt_reliability(self):
        """Subscribe anew if what the publishers offer asks for another reliability."""
        wanted = {'reliable': True, 'best_effort': False}.get(self.node.config.image_reliability)
        if wanted is None:
            topics = [f'{self.name}/depth/image_raw', f'{self.name}/depth/camera_info']
            wanted = auto_reliability(
                [info.qos_profile.reliability for topic in topics
                 for info in self.node.get_publishers_info_by_topic(
                     self.node.resolve_topic_name(topic))])
        if wanted == self._reliable:
            return
        self._unsubscribe()
        self._reliable = wanted
        for kind, suffix, callback in ((CameraInfo, 'camera_info', self._on_info),
                                       (Image, 'image_raw', self._on_image)):
            self._subscriptions.append(self.node.create_subscription(
                kind, f'{self.name}/depth/{suffix}', callback,
                qos(f'<camera>/depth/{suffix}', wanted),
                qos_overriding_options=overridable(reliability=False)))

    def _unsubscribe(self):
        while self._subscriptions:
            self.node.destroy_subscription(self._subscriptions.pop())

    # Messages.

    def _on_extrinsics(self, message):
        self._latched = message

    def _on_info(self, message):
        self._last_info = message
        self._hold(self._infos, message)
        self._match(nanoseconds(message.header.stamp))

    def _on_image(self, message):
        if not self.node.active:
            return
        stamp = nanoseconds(message.header.stamp)
        if self._images and stamp not in self._infos and self._last_info is not None:
            # A driver that does not stamp both alike: after one image without its own
            # camera_info, the latest one has to do.
            self.node.diagnostics.count(self.name, 'camera_info_stamp_differs')
            self._images.clear()
            self._deliver(message, self._last_info)
            return
        if self._images and self._last_info is None:
            self.node.diagnostics.warn(
                self.name, 'no_camera_info', f'depth images arrive but no camera_info on '
                f'{self.name}/depth/camera_info; the image is dropped')
        self._hold(self._images, message)
        self._match(stamp)

    def _match(self, stamp):
        if stamp in self._images and stamp in self._infos:
            self._deliver(self._images.pop(stamp), self._infos.pop(stamp))

    @staticmethod
    def _hold(waiting, message, capacity=4):
        waiting[nanoseconds(message.header.stamp)] = message
        while len(waiting) > capacity:
            waiting.popitem(last=False)

    def _deliver(self, image, info):
        try:
            transform = self._extrinsics(image)
        except HoocError as error:
            self.node.diagnostics.warn(self.name, 'no_extrinsics', str(error))
            return
        self._callback(self.name, image, info, transform)

    def _extrinsics(self, image):
        """Return T_target_camera: from parameters, the latched topic or tf, in this order."""
        target, frame = self.node.config.target_frame, image.header.frame_id
        if len(self._pose):
            return transform_message(self._pose[:3], self._pose[3:], header(0, target), frame)
        if self._latched is not None and self._latched.header.frame_id == target:
            return self._latched
        transform = self._tf.lookup(target, frame)
        if transform is not None:
            return transform
        if self._latched is not None:
            raise HoocError(
                f'the extrinsics of {self.name} are given in frame '
                f'{self._latched.header.frame_id!r}, but target_frame is {target!r}; set '
                'target_frame to the former; the image is dropped')
        raise HoocError(
            f'nobody says where {self.name} stands: publish {self.name}/extrinsics or /tf_static '
            f"({target} to {frame or 'the camera'}), or set parameter extrinsics.{self.name}; "
            'the image is dropped')
