# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Read one frame set from a bag: those of `hooc convert`, and recordings of other people.

In a stranger's bag the depth topics are found by type and encoding, a camera's calibration
beside its image, and its pose in extrinsics topics or /tf_static. Where no frame is known to be
a table's, it is estimated from the depth.
"""

from dataclasses import replace
from functools import cached_property
from pathlib import Path

from hooc_perception.core.types import DepthView
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.camera_topics import (
    camera_from_info,
    cameras_without_depth,
    depth_topics,
)
from hooc_perception.io.bags.files import BagMessage, BagTopic, iter_messages, topics
from hooc_perception.io.bags.frames import FrameTree, plain
from hooc_perception.io.bags.scene_info import default_info, parsed_info, SUFFIX
from hooc_perception.io.depth_encodings import decode_depth, decode_image
from hooc_perception.io.scenes.support_plane import estimate_table_frame
import numpy as np

__all__ = ['BagMessage', 'BagScene', 'BagTopic', 'iter_messages', 'topics']

TABLE_FRAME = 'table'
TRANSFORM = 'geometry_msgs/msg/TransformStamped'
TF = 'tf2_msgs/msg/TFMessage'


class BagScene:
    """
    One frame set of a bag, with the interface of RecordedScene.

    :ivar path: the bag.
    :ivar topics: {name: BagTopic}.
    :ivar depth_topics: {camera name: image topic}, in camera order.
    :ivar info: what /hooc/scene_info holds (dataset, scene, categories, max_instances, truth,
        world_frame, ...); its defaults where a bag has none.
    :ivar name: the scene's name, the bag's where it has none.
    """

    def __init__(self, path, world_frame=None):
        """
        Read all but the images.

        :param path: a rosbag2 folder, or its .mcap or .db3 file.
        :param world_frame: a frame of the bag with z up and z = 0 on the table top; None takes
            that of scene_info, else `table`, else estimates it from the depth.
        :raises HoocError: where the bag is damaged, has no depth, or lacks a calibration.
        """
        self.path = Path(path)
        self.topics = topics(path)
        self._tree, infos, self.info, firsts = self._read_small_topics()
        self.name = self.info['scene']
        self.depth_topics = self._in_camera_order(depth_topics(firsts, self.path))
        frames = {}
        cameras = []
        for name, topic in self.depth_topics.items():
            cameras.append(camera_from_info(name, topic, infos, firsts[topic], self.path))
            frames[name] = firsts[topic].header.frame_id
        self._source_cameras = self._posed(cameras, frames, world_frame)

    @property
    def incomplete(self):
        """Say of which cameras the bag holds no depth image, None where there is none."""
        names = cameras_without_depth(self.topics, self.depth_topics, self.info['cameras'])
        if not names:
            return None
        return (f'{self.path}: there is no depth image of {", ".join(names)}, though the bag '
                'names it as a camera, so only '
                f'{", ".join(self.depth_topics)} will be used; record its depth topic, too')

    @property
    def table_known(self):
        """Say whether the world frame is known to be a table's."""
        return self._table_known

    @cached_property
    def table(self):
        """Return the SupportPlane that was estimated, None where the world is a table's."""
        if self._table_known:
            return None
        return estimate_table_frame(self._source_views, self.name)

    @cached_property
    def cameras(self):
        """Return the tuple of Camera, posed in the table's frame."""
        if self._table_known:
            return self._source_cameras
        return tuple(replace(c, T_world_camera=self.table.T_table_source @ c.T_world_camera)
                     for c in self._source_cameras)

    @property
    def world(self):
        """Return what a results file says of an estimated world frame, {} where it is known."""
        return {} if self._table_known else {'world': self.table.as_dict()}

    @property
    def truth(self):
        """Return the tuple of TrueObject, None where the bag holds none."""
        return self.info['truth']

    @property
    def source_truth(self):
        """Return the same: a bag's truth is already in the frame of its table."""
        return self.truth

    def views(self, images=None):
        """
        Return the tuple of DepthView of one frame set, in camera order.

        :param images: {camera: which of its images, from 0 on}; an image without a reading
            stands for the next one. None takes the first moment when every camera has an image;
            each one's nearest counts.
        :raises HoocError: where an image is damaged or holds no reading.
        """
        chosen = self._source_views if images is None else self._views_of(images)
        return tuple(replace(view, camera=camera)
                     for view, camera in zip(chosen, self.cameras))

    def depth(self):
        """Return the tuple of DepthView of the first frame set."""
        return self.views()

    def labels(self):
        """Return {camera: (H, W) uint8 instance labels}, None where the bag holds none."""
        wanted = {self._sibling(name, 'instance_labels'): name for name in self.depth_topics}
        result = {}
        for message in iter_messages(self.path, set(wanted)):
            image = message.read(self.path)
            if image.encoding != 'mono8':
                raise HoocError(f'{self.path}: {message.topic.name} has encoding '
                                f'{image.encoding!r}; record instance labels as mono8')
            result[wanted[message.topic.name]] = decode_image(
                image.data, image.height, image.width, np.uint8, image.step).copy()
        return result or None

    @cached_property
    def _source_views(self):
        """Return the frame set with the cameras as the bag has them."""
        names = {topic: i for i, topic in enumerate(self.depth_topics.values())}
        start = max(_stamp_ns(image.header) for image in self._firsts.values())
        nearest, passed = {}, set()
        for message in iter_messages(self.path, set(names)):
            topic = message.topic.name
            if topic in passed:
                continue
            image = message.read(self.path)
            away = abs(_stamp_ns(image.header) - start)
            if topic not in nearest or away < nearest[topic][0]:
                nearest[topic] = away, image
            if _stamp_ns(image.header) >= start:
                passed.add(topic)
            if len(passed) == len(names):
                break
        return tuple(self._view(camera, topic, nearest[topic][1])
                     for camera, topic in zip(self._source_cameras, names))

    def _views_of(self, images):
        """Return the DepthViews of images that are counted by camera, cameras as in the bag."""
        cameras = {self.depth_topics[camera.name]: camera for camera in self._source_cameras}
        left = {topic: images[camera.name] for topic, camera in cameras.items()}
        views = {}
        for message in iter_messages(self.path, set(left)):
            topic = message.topic.name
            left[topic] -= 1
            if left[topic] >= 0 or topic in views:
                continue
            try:
                views[topic] = self._view(cameras[topic], topic, message.read(self.path))
            except HoocError:
                continue        # ingestion has dropped it, too
            if len(views) == len(cameras):
                return tuple(views[topic] for topic in cameras)
        raise HoocError(f'{self.path}: it holds no such frame set')

    def _view(self, camera, topic, image):
        """Return the DepthView of an image message."""
        try:
            depth = decode_depth(image.data, image.height, image.width, image.encoding,
                                 image.step, image.is_bigendian)
        except HoocError as error:
            raise HoocError(f'{self.path}: {topic}: {error}') from None
        if depth.shape != (camera.height, camera.width):
            raise HoocError(f'{self.path}: {topic} has {image.width} x {image.height} pixels, '
                            f'but its camera_info says width {camera.width} and height '
                            f'{camera.height}; correct the driver')
        if not np.isfinite(depth).any():
            raise HoocError(f'{self.path}: {topic} holds no reading in its first image; '
                            'record again')
        return DepthView(camera, depth)

    def _read_small_topics(self):
        """Return (FrameTree, {topic: CameraInfo}, info, {topic: first depth-like Image})."""
        wanted = {topic.name for topic in self.topics.values() if topic.type_name in (
            'sensor_msgs/msg/CameraInfo', TRANSFORM, TF) and topic.name != '/tf'}
        wanted |= {name for name, topic in self.topics.items()
                   if name.endswith(SUFFIX) and topic.type_name == 'std_msgs/msg/String'}
        tree, infos, info = FrameTree(), {}, {}
        for message in iter_messages(self.path, wanted):
            topic = message.topic
            if topic.type_name == 'sensor_msgs/msg/CameraInfo':
                if topic.name not in infos:
                    infos[topic.name] = message.read(self.path)
            elif topic.name.endswith(SUFFIX):
                info = parsed_info(message.read(self.path).data, f'{self.path}: {topic.name}')
            else:
                content = message.read(self.path)
                for stamped in getattr(content, 'transforms', None) or [content]:
                    tree.add(stamped, f'{self.path}: {topic.name}')
        self._firsts = self._first_images()
        return tree, infos, {**default_info(self.path.resolve().stem), **info}, self._firsts

    def _first_images(self):
        """Return {topic: its first Image message}."""
        left = {topic.name for topic in self.topics.values()
                if topic.type_name == 'sensor_msgs/msg/Image' and topic.count}
        firsts = {}
        for message in iter_messages(self.path, set(left)):
            if message.topic.name in left:
                firsts[message.topic.name] = message.read(self.path)
                left.discard(message.topic.name)
                if not left:
                    break
        return firsts

    def _in_camera_order(self, found):
        """Return {camera: topic} in the order of scene_info; keep only those images."""
        order = self.info['cameras']
        found = dict(sorted(found.items(), key=lambda item: (
            order.index(item[0]) if item[0] in order else len(order), item[0])))
        self._firsts = {topic: self._firsts[topic] for topic in found.values()}
        return found

    def _sibling(self, camera_name, name):
        """Return the topic `name` of a camera: beside the folder of its depth image."""
        return f'{self.depth_topics[camera_name].rsplit("/", 2)[0]}/{name}'

    def _posed(self, cameras, frames, world_frame):
        """Return the cameras with their poses; note whether the world is known to be a table's."""
        wanted = world_frame or self.info['world_frame']
        if wanted and plain(wanted) not in self._tree:
            raise HoocError(f'{self.path}: no transform names the world frame {wanted!r}; '
                            'record /tf_static or name another frame')
        if not wanted and TABLE_FRAME in self._tree:
            wanted = TABLE_FRAME
        self._table_known = wanted is not None
        world = plain(wanted or self._tree.root(next(iter(frames.values()))))
        posed = []
        for camera in cameras:
            T_world_camera = self._tree.transform(world, frames[camera.name])
            if T_world_camera is None:
                raise HoocError(
                    f'{self.path}: nothing connects camera {camera.name} (frame '
                    f'{frames[camera.name]!r}) with {world!r}; record /tf_static or '
                    f'{self._sibling(camera.name, "extrinsics")} too')
            posed.append(replace(camera, T_world_camera=T_world_camera))
        return tuple(posed)


def _stamp_ns(header):
    """Return a header's stamp in nanoseconds."""
    return header.stamp.sec * 10 ** 9 + header.stamp.nanosec
