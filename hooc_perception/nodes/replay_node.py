# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Play a recorded bag as live cameras."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import json
import sys
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseArray, TransformStamped
from hooc_perception.chain import REPLAY
from hooc_perception.core.config import param
from hooc_perception.core.geometry import pose_from_matrix
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import IMAGE
from hooc_perception.io.bags.images import read_image
from hooc_perception.io.bags.reader import BagMessage, BagScene, iter_messages
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_config import NodeConfig
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import (
    camera_info_message,
    copied_image,
    depth_from_message,
    depth_message,
    header,
    nanoseconds,
    time_message,
    transform_message,
)
from hooc_perception.ros.outputs.player import Player, PlayerConfig
from rclpy.duration import Duration
from rclpy.lifecycle import LifecyclePublisher
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header, String


@dataclass(frozen=True)
class ReplayConfig(PlayerConfig, NodeConfig):
    """Parameters of the replay node."""

    bag: str = param('', 'The rosbag2 folder, or an .mcap, .db3 or (ROS 1) .bag file.')
    wait_for_subscribers: int = param(1, 'Start when every image topic has this many '
                                      'subscribers.', '', 0, 100)
    match_timeout_s: float = param(30.0, 'Give up waiting for subscribers after this time.',
                                   's', 0.1, 3600.0)
    answer_timeout_s: float = param(
        60.0, 'At rate 0: send the next frame set after this time without an answer.', 's', 0.1,
        3600.0)


class ReplayNode(StageNode[ReplayConfig, 'Replay']):
    """Publish <camera>/depth/* and <camera>/extrinsics from a bag."""

    CONFIG = ReplayConfig

    def __init__(self, **kwargs: Any) -> None:
        """Declare parameters."""
        super().__init__(REPLAY, **kwargs)

    def configure(self) -> 'Replay':
        """Open the bag, build the endpoints of its cameras."""
        return Replay(self)

    def activate(self) -> None:
        """Start to wait for subscribers."""
        self.work.begin()

    def deactivate(self) -> None:
        """Stop playing."""
        self.work.stop()


class CameraOutput(NamedTuple):
    """The publishers of one camera."""

    extrinsics: LifecyclePublisher
    info: LifecyclePublisher
    images: LifecyclePublisher


class Replay:
    """
    The work of a configured replay node.

    :ivar player: the Player that paces the images, None before it plays.
    """

    def __init__(self, node: ReplayNode) -> None:
        """Open the bag and build everything on the node; HoocError if there is no such bag."""
        self._node = node
        self.player: Player | None = None
        if not node.config.bag:
            raise HoocError('parameter bag is empty; set it to a rosbag2 folder or file')
        self._bag = BagScene(node.config.bag)
        for warning in self._bag.warnings:
            node.diagnostics.warn('bag', 'incomplete', warning)
        self._frame = self._bag.info['world_frame'] or 'table'
        self._cameras: dict[str, Camera] = {camera.name: camera for camera in self._bag.cameras}
        self._outputs = {name: CameraOutput(
            node.publisher(TransformStamped, '<camera>/extrinsics', f'{name}/extrinsics'),
            node.publisher(CameraInfo, '<camera>/depth/camera_info', f'{name}/depth/camera_info'),
            node.publisher(Image, '<camera>/depth/image_raw', f'{name}/depth/image_raw'))
            for name in self._cameras}
        self._status = node.publisher(String, 'replay/status')
        node.subscription(PoseArray, 'objects/poses',
                          lambda message: self._go_on(message.header.stamp))
        node.subscription(Header, 'views/refused', lambda message: self._go_on(message.stamp))
        # Node time in nanoseconds: of the activation, and of the last image that was sent.
        self._began = self._sent = 0
        self._timer = node.steady_timer(0.002, self._on_timer)
        self._timer.cancel()        # runs while active

    def begin(self) -> None:
        """Start to wait for subscribers."""
        self._began, self.player = self._node.now_ns(), None
        self._timer.reset()
        self._publish_state('waiting')

    def stop(self) -> None:
        """Stop playing."""
        self._timer.cancel()

    def _publish_state(self, state: str) -> None:
        """Publish the state: waiting, playing, finished or failed; the last two end it."""
        self._status.publish(String(data=json.dumps({
            'state': state, 'bag': self._node.config.bag, 'scene': self._bag.name,
            'images': self.player.published if self.player else 0})))
        if state in ('finished', 'failed'):
            self._timer.cancel()
        else:
            self._node.diagnostics.ok('replay', state=state)

    def _on_timer(self) -> None:
        """Do what is due."""
        try:
            if self.player:
                self._play(self.player)
            else:
                self._wait_for_subscribers()
        except HoocError as error:
            self._node.diagnostics.error('replay', 'unreadable', str(error))
            self._publish_state('failed')

    def _play(self, player: Player) -> None:
        """Publish the next image and its calibration if it is due."""
        due = player.due(self._node.now_ns())
        if due is not None:
            output = self._outputs[due.camera]
            image: Image = due.message
            image.header.stamp = time_message(due.stamp_ns)
            output.info.publish(camera_info_message(self._cameras[due.camera], image.header))
            output.images.publish(image)
            self._sent = self._node.now_ns()
        elif player.waits_for_release and (
                self._node.now_ns() - self._sent > self._node.config.answer_timeout_s * 1e9):
            self._node.diagnostics.warn(
                'replay', 'no_answer', 'no objects came for a frame set within '
                f'{self._node.config.answer_timeout_s:g} s (answer_timeout_s), so the next one '
                'is sent')
            player.released()
        if player.finished:
            self._publish_state('finished')

    def _go_on(self, stamp: Time) -> None:
        """At rate 0: a set was answered or refused, so the chain is free for the next."""
        if self._node.active and self.player and self.player.waits_for_release and (
                nanoseconds(stamp) >= self.player.set_stamp_ns):
            self.player.released()

    def _wait_for_subscribers(self) -> None:
        """Start to play once every camera has its subscribers."""
        wanted, patience_s = (self._node.config.wait_for_subscribers,
                              self._node.config.match_timeout_s)
        alone = [name for name, output in self._outputs.items()
                 if output.images.get_subscription_count() < wanted
                 or output.info.get_subscription_count() < min(wanted, 1)]
        if not alone:
            self._start()
        elif self._node.now_ns() - self._began > patience_s * 1e9:
            self._node.diagnostics.error('replay', 'no_subscribers', (
                f'nobody listens to {", ".join(alone)} after {patience_s:g} s '
                f'(each image topic needs {wanted} subscribers): start the nodes with these '
                'cameras'))
            self._publish_state('failed')

    def _start(self) -> None:
        """Publish the camera poses, make sure that they have arrived, begin to play."""
        frames: dict[str, str] = {}
        for name, _, image in self._recorded_images():
            frames.setdefault(name, image.header.frame_id)
            if len(frames) == len(self._cameras):
                break
        for name, output in self._outputs.items():
            output.extrinsics.publish(transform_message(
                *pose_from_matrix(self._cameras[name].T_world_camera),
                header(self._node.now_ns(), self._frame), frames[name]))
            output.extrinsics.wait_for_all_acked(Duration(seconds=1))
        self.player = Player(self._recorded_images, self._node.config)
        self._publish_state('playing')

    def _recorded_images(self) -> Iterator[tuple[str, int, Image]]:
        """Yield (camera, recorded stamp in ns, Image) of the depth images."""
        bag = self._node.config.bag
        cameras = {topic: name for name, topic in self._bag.depth_topics.items()}
        for message in iter_messages(bag, set(cameras)):
            camera = cameras[message.topic.name]
            image = self._image(message, self._bag.depth_unit(camera))
            yield camera, nanoseconds(image.header.stamp), image

    def _image(self, message: BagMessage, unit: float | None) -> Image:
        """
        Return a recorded image as it is, uncompressed; in metres if the user states its unit.

        :raises HoocError: if it is damaged.
        """
        bag = self._node.config.bag
        if message.topic.type_name == IMAGE and unit is None:
            try:
                return deserialize_message(message.data, Image)
            except Exception:   # the bytes may be anything
                raise HoocError(f'{bag}: a message of {message.topic.name} is damaged; record or '
                                'copy the bag again') from None
        image = copied_image(read_image(message, bag))
        return image if unit is None else depth_message(depth_from_message(image, unit),
                                                        image.header)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return the exit code."""
    return run_node(ReplayNode, args)


if __name__ == '__main__':
    sys.exit(main())
