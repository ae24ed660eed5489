# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One raw depth camera: pairs its images with calibration and pose."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
import time
from typing import Any, TypeVar

from geometry_msgs.msg import TransformStamped
from hooc_perception.core.config import param
from hooc_perception.errors import HoocError
from hooc_perception.io.compressed_depth import decode_compressed_depth
from hooc_perception.ros.health.silence import why_silent
from hooc_perception.ros.inputs.camera_poses import PoseNotYet, PoseParameters, TfPoses
from hooc_perception.ros.inputs.camera_topics import CameraTopics, DRIVERS, OURS
from hooc_perception.ros.lifecycle.stage_config import StageConfig
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import (
    header,
    image_message,
    nanoseconds,
    transform_message,
)
from hooc_perception.ros.qos import auto_reliability, overridable, qos
from rclpy.subscription import Subscription
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

# Called with the camera's name and messages that belong together.
FrameCallback = Callable[[str, Image, CameraInfo, TransformStamped], None]
M = TypeVar('M', Image, CameraInfo)


@dataclass(frozen=True)
class CameraInputConfig(StageConfig):
    """Parameters of a node that subscribes to raw cameras."""

    image_reliability: str = param(
        'auto', 'auto subscribes reliably only if every publisher offers it.',
        choices=('auto', 'reliable', 'best_effort'))
    camera_driver: str = param(
        '', 'Driver of the cameras, which names their topics; driver.<camera> wins over it. Empty '
        '= <camera>/depth/image_raw and <camera>/depth/camera_info.', choices=('', *DRIVERS))


class CameraInput:
    """
    Subscribe to one camera; call back with image, camera_info and pose that belong together.

    :ivar name: of the camera.
    :ivar topics: that it is heard on.
    :ivar heard: monotonic seconds of the last image.
    """

    def __init__(self, node: StageNode[CameraInputConfig, Any], name: str, topics: CameraTopics,
                 poses: PoseParameters, tf: TfPoses, callback: FrameCallback) -> None:
        """
        Create the subscriptions; the executor serves them in the order of creation.

        :param poses: the pose of a camera by parameter, which wins over topic and tf; looked up
            for every image.
        """
        self.name, self.node, self._tf, self._callback = name, node, tf, callback
        self.topics = topics
        self.heard = time.monotonic()
        self._poses = poses
        self._latched: TransformStamped | None = None       # the last <camera>/extrinsics
        self._infos: OrderedDict[int, CameraInfo] = OrderedDict()
        self._images: OrderedDict[int, Image] = OrderedDict()
        self._last_info: CameraInfo | None = None
        # Images that wait: for a pose that tf does not have yet, and for any pose at all.
        self._late: tuple[Image, CameraInfo] | None = None
        self._unplaced: tuple[Image, CameraInfo] | None = None
        # The stamp of the last image whose own camera_info did not come, 0 = all did.
        self._unmatched = 0
        node.subscription(TransformStamped, '<camera>/extrinsics', self._on_extrinsics,
                          f'{name}/extrinsics')
        self._subscribed: tuple[bool, str] | None = None    # reliability, topic of the images
        self._subscriptions: dict[str, Subscription] = {}   # by topic, as in `topics`
        node.owned(lambda _: self._unsubscribe(), None)
        self.adapt_reliability()

    def begin(self) -> None:
        """Begin to listen: what was heard before does not count."""
        self.heard, self._late, self._unplaced = time.monotonic(), None, None
        self._images.clear()

    # Reliability.

    def adapt_reliability(self) -> None:
        """Subscribe again if what the publishers offer demands another QoS or transport."""
        kind, source, on_image = self._transport()
        wanted = {'reliable': True, 'best_effort': False}.get(self.node.config.image_reliability)
        if wanted is None:
            wanted = auto_reliability(
                [info.qos_profile.reliability for topic in (source, self.topics.info)
                 for info in self.node.get_publishers_info_by_topic(topic)])
        if (wanted, source) == self._subscribed:
            return
        self._unsubscribe()
        self._subscribed = wanted, source
        for role, topic, form, row, callback in (
                (self.topics.info, self.topics.info, CameraInfo, OURS.info, self._on_info),
                (self.topics.image, source, kind, OURS.image, on_image)):
            self._subscriptions[role] = self.node.create_subscription(
                form, topic, self.node.guarded(callback), qos(row, wanted),
                qos_overriding_options=overridable(reliability=False))

    def _transport(self) -> tuple[type, str, Callable[[Any], None]]:
        """Return (type, topic, callback) of the images: compressed only where nothing else is."""
        raw = self.topics.image
        packed = f'{self.node.resolve_topic_name(raw)}/compressedDepth'
        if not self.node.get_publishers_info_by_topic(raw) and (
                self.node.get_publishers_info_by_topic(packed)):
            return CompressedImage, packed, self._on_compressed
        return Image, raw, self._on_image

    def _unsubscribe(self) -> None:
        while self._subscriptions:
            self.node.destroy_subscription(self._subscriptions.popitem()[1])

    # Messages.

    def _on_extrinsics(self, message: TransformStamped) -> None:
        self._latched = message
        if self._unplaced and self.node.active:
            self._hand_on(*self._unplaced)

    def _on_info(self, message: CameraInfo) -> None:
        self._last_info = message
        self._hold(self._infos, message)
        stamp = nanoseconds(message.header.stamp)
        if stamp == self._unmatched:
            self._unmatched = 0     # it was only late
        self._match(stamp)

    def _on_compressed(self, message: CompressedImage) -> None:
        self.heard = time.monotonic()
        if not self.node.active:
            return
        try:
            encoding, pixels = decode_compressed_depth(message.format, bytes(message.data))
        except HoocError as error:
            self.node.diagnostics.error(self.name, 'bad_image', f'{error}; the image is dropped')
            return
        self._on_image(image_message(pixels, encoding, message.header))

    def _on_image(self, message: Image) -> None:
        self.heard = time.monotonic()
        if not self.node.active:
            return
        stamp = nanoseconds(message.header.stamp)
        self._hold(self._images, message)
        if self._match(stamp):
            return
        if self._last_info is None:
            if len(self._images) > 1:
                self._report(self.info_silence())
        elif self._unmatched or len(self._images) > 1:
            # A driver that does not stamp both alike: after one image without its own
            # camera_info, the latest one has to do.
            self.node.diagnostics.count(self.name, 'camera_info_stamp_differs')
            self._images.clear()
            self._unmatched = stamp
            self._deliver(message, self._last_info)

    def _report(self, trouble: tuple[str, str] | None) -> None:
        if trouble:
            self.node.diagnostics.warn(self.name, *trouble)

    def _match(self, stamp: int) -> bool:
        """Deliver the pair of a stamp if both are there; return whether they were."""
        if stamp not in self._images or stamp not in self._infos:
            return False
        image, info = self._images.pop(stamp), self._infos.pop(stamp)
        self._unmatched = 0
        self._images.clear()
        self._deliver(image, info)
        return True

    def silence(self) -> tuple[str, str]:
        """Return (code, sentence) on why no images come, as far as the graph shows it."""
        return self._why_silent(self.topics.image)

    def _why_silent(self, topic: str) -> tuple[str, str]:
        return why_silent(self.node, topic, self._subscriptions[topic])

    def info_silence(self) -> tuple[str, str] | None:
        """Return (code, sentence) on why no camera_info comes, None if one has come."""
        if self._last_info is not None:
            return None
        _, sentence = self._why_silent(self.topics.info)
        return 'no_camera_info', f'depth images arrive but no camera_info: {sentence}'

    @staticmethod
    def _hold(waiting: OrderedDict[int, M], message: M, capacity: int = 4) -> None:
        waiting[nanoseconds(message.header.stamp)] = message
        while len(waiting) > capacity:
            waiting.popitem(last=False)

    def _deliver(self, image: Image, info: CameraInfo) -> None:
        """Hand on an image; if its pose is still to come, when the next image comes."""
        late, self._late = self._late, None
        trouble = late and self._hand_on(*late)
        if trouble:
            self.node.diagnostics.warn(self.name, 'late_extrinsics',
                                       f'{trouble}; the image is dropped')
        if self._hand_on(image, info):
            self._late = image, info

    def _hand_on(self, image: Image, info: CameraInfo) -> PoseNotYet | None:
        """Call back with an image; return the PoseNotYet if its pose is still to come."""
        self._unplaced = None
        try:
            transform = self._extrinsics(image)
        except PoseNotYet as error:
            return error
        except HoocError as error:
            self.node.diagnostics.warn(self.name, 'no_extrinsics', str(error))
            # There is no order between topics: the latched pose may be under way.
            self._unplaced = (image, info) if self._latched is None else None
        else:
            self._callback(self.name, image, info, transform)
        return None

    def _extrinsics(self, image: Image) -> TransformStamped:
        """Return T_target_camera: from parameters, the latched topic or tf, in this order."""
        target, frame = self.node.config.target_frame, image.header.frame_id
        pose = self._poses[self.name]
        if pose:
            return transform_message(pose[:3], pose[3:], header(0, target), frame)
        if self._latched is not None and self._latched.header.frame_id == target:
            return self._latched
        transform = self._tf.lookup(target, frame, image.header.stamp)
        if transform is not None:
            return transform
        if self._latched is not None:
            raise HoocError(
                f'the extrinsics of {self.name} are given in frame '
                f'{self._latched.header.frame_id!r}, but target_frame is {target!r}; set '
                'target_frame to the former; the image is dropped')
        nameless = '' if frame else 'its images carry no frame_id and '
        raise HoocError(
            f'{nameless}nobody says where {self.name} stands: publish {self.name}/extrinsics '
            f"or /tf_static ({target} to {frame or 'the camera'}), or set parameter "
            f'extrinsics.{self.name}; '
            'of its images only the latest waits for that')
