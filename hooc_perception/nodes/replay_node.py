# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Play a recorded bag as live cameras."""

from dataclasses import dataclass
import json
import sys

from geometry_msgs.msg import PoseArray, TransformStamped
from hooc_perception.core.config import param
from hooc_perception.core.geometry import pose_from_matrix
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene, iter_messages
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import (
    camera_info_message,
    header,
    nanoseconds,
    time_message,
    transform_message,
)
from hooc_perception.ros.outputs.player import Player, PlayerConfig
from rclpy.duration import Duration
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header, String


@dataclass(frozen=True)
class ReplayConfig(PlayerConfig):
    """Parameters of the replay node."""

    bag: str = param('', 'The rosbag2 folder, or its .mcap or .db3 file.')
    wait_for_subscribers: int = param(1, 'Send nothing before every image topic has so many '
                                      'subscribers.', '', 0, 100)
    match_timeout_s: float = param(30.0, 'Give up waiting for subscribers after this time.',
                                   's', 0.1, 3600.0)
    answer_timeout_s: float = param(60.0, 'At rate 0: go on without an answer after this time.',
                                    's', 0.1, 3600.0)


class ReplayNode(StageNode):
    """Publish <camera>/depth/* and <camera>/extrinsics from a bag."""

    def __init__(self, **kwargs):
        """Declare parameters."""
        super().__init__('replay_node', ReplayConfig(), **kwargs)

    def configure(self):
        """Open the bag, build the endpoints of its cameras."""
        if not self.config.bag:
            raise HoocError('parameter bag is empty; set it to a rosbag2 folder or file')
        self.bag = BagScene(self.config.bag)
        if self.bag.incomplete:
            self.diagnostics.warn('bag', 'missing_camera', self.bag.incomplete)
        self.frame = self.bag.info['world_frame'] or 'table'
        self.cameras = {camera.name: camera for camera in self.bag.cameras}
        self.outputs = {name: (
            self.publisher(TransformStamped, '<camera>/extrinsics', f'{name}/extrinsics'),
            self.publisher(CameraInfo, '<camera>/depth/camera_info', f'{name}/depth/camera_info'),
            self.publisher(Image, '<camera>/depth/image_raw', f'{name}/depth/image_raw'))
            for name in self.cameras}
        self.status = self.publisher(String, 'replay/status')
        self.subscription(PoseArray, 'objects/poses',
                          lambda message: self.go_on(message.header.stamp))
        self.subscription(Header, 'views/refused', lambda message: self.go_on(message.stamp))
        self.timer = self.steady_timer(0.002, self.on_timer)
        self.timer.cancel()     # runs while active

    def activate(self):
        """Start to wait for subscribers."""
        self.began, self.player = self.now_ns(), None
        self.timer.reset()
        self.say('waiting')

    def deactivate(self):
        """Stop to play."""
        self.timer.cancel()

    def say(self, state):
        """Publish the state: waiting, playing, finished or failed; the last two end it."""
        self.status.publish(String(data=json.dumps({
            'state': state, 'bag': self.config.bag, 'scene': self.bag.name,
            'images': self.player.published if self.player else 0})))
        if state in ('finished', 'failed'):
            self.timer.cancel()
        else:
            self.diagnostics.ok('replay', state=state)

    def on_timer(self):
        """Do what is due."""
        try:
            self.play() if self.player else self.wait_for_subscribers()
        except HoocError as error:
            self.diagnostics.error('replay', 'unreadable', str(error))
            self.say('failed')

    def play(self):
        """Publish the next image and its calibration if it is due."""
        due = self.player.due(self.now_ns())
        if due is not None:
            _, info, images = self.outputs[due.camera]
            due.message.header.stamp = time_message(due.stamp_ns)
            info.publish(camera_info_message(self.cameras[due.camera], due.message.header))
            images.publish(due.message)
            self.sent = self.now_ns()
        elif self.player.waits_for_release and (
                self.now_ns() - self.sent > self.config.answer_timeout_s * 1e9):
            self.diagnostics.warn('replay', 'no_answer', 'no objects came for a frame set; going '
                                  'on with the next')
            self.player.released()
        if self.player.finished:
            self.say('finished')

    def go_on(self, stamp):
        """At rate 0: a set was answered or refused, so the chain is free for the next."""
        if self.active and self.player and self.player.waits_for_release and (
                nanoseconds(stamp) >= self.player.set_stamp_ns):
            self.player.released()

    def wait_for_subscribers(self):
        """Start to play once every camera has its subscribers."""
        wanted = self.config.wait_for_subscribers
        alone = [name for name, (_, info, images) in self.outputs.items()
                 if images.get_subscription_count() < wanted
                 or info.get_subscription_count() < min(wanted, 1)]
        if not alone:
            self.start()
        elif self.now_ns() - self.began > self.config.match_timeout_s * 1e9:
            self.diagnostics.error('replay', 'no_subscribers', (
                f'nobody listens to {", ".join(alone)} after {self.config.match_timeout_s:g} s '
                f'(each image topic needs {wanted} subscribers): start the nodes with these '
                'cameras'))
            self.say('failed')

    def start(self):
        """Say where the cameras stand, make sure that it has arrived, begin."""
        frames = {}
        for name, _, image in self.recorded_images():
            frames.setdefault(name, image.header.frame_id)
            if len(frames) == len(self.cameras):
                break
        for name, (extrinsics, _, _) in self.outputs.items():
            extrinsics.publish(transform_message(
                *pose_from_matrix(self.cameras[name].T_world_camera),
                header(self.now_ns(), self.frame), frames[name]))
            extrinsics.wait_for_all_acked(Duration(seconds=1))
        self.player = Player(self.recorded_images, self.config)
        self.say('playing')

    def recorded_images(self):
        """Yield (camera, recorded stamp in ns, Image) of the depth images."""
        cameras = {topic: name for name, topic in self.bag.depth_topics.items()}
        for message in iter_messages(self.config.bag, set(cameras)):
            try:
                image = deserialize_message(message.data, Image)
            except Exception:   # the bytes are a stranger's
                raise HoocError(f'{self.config.bag}: a message of {message.topic.name} is '
                                'damaged; record or copy the bag again') from None
            yield cameras[message.topic.name], nanoseconds(image.header.stamp), image


def main(args=None):
    """Run the node; return the exit code."""
    return run_node(ReplayNode, args)


if __name__ == '__main__':
    sys.exit(main())
