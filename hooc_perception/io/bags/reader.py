# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Read one frame set from a bag: a bag of `hooc convert` or a recording from elsewhere.

In other recordings, the depth topics are found by type and encoding, a camera's calibration
beside its image, and its pose in extrinsics topics or /tf_static. If no frame is known to be a
table's, it is estimated from the depth.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

from hooc_perception.core.arrays import Float64Array, UInt8Array
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.camera_topics import (
    all_depth_topics,
    bag_camera,
    cameras_without_depth,
    depth_topics,
    in_camera_order,
)
from hooc_perception.io.bags.contents import beside, image_frames, read_contents, TABLE_FRAME
from hooc_perception.io.bags.files import BagMessage, BagTopic, iter_messages, oddities, topics
from hooc_perception.io.bags.frames import FrameTree, plain
from hooc_perception.io.bags.images import read_image
from hooc_perception.io.depth_encodings import decode_depth, decode_image, encoded_unit
from hooc_perception.io.depth_units import depth_unit_error
from hooc_perception.io.scenes.plausible import check_aim, check_unit
from hooc_perception.io.scenes.scene import TrueObject
from hooc_perception.io.scenes.table_frame import TableFrameScene
import numpy as np

__all__ = ['BagMessage', 'BagScene', 'BagTopic', 'iter_messages', 'topics']

_UNIT_FIX = ('publish 16UC1 in millimetres or 32FC1 in metres, state depth_unit in hooc.yaml '
             'beside the recording, or correct the unit of the extrinsics')


class BagScene(TableFrameScene):
    """
    One frame set of a bag, with the interface of RecordedScene.

    :ivar path: the bag.
    :ivar topics: {name: BagTopic}.
    :ivar depth_topics: {camera name: image topic}, in camera order.
    :ivar info: content of /hooc/scene_info (dataset, scene, categories, max_instances, truth,
        world_frame, ...); defaults if a bag has none.
    :ivar name: the scene's name; the bag's if it has none.
    :ivar world_frame: name of the frame of `source_cameras`.
    :ivar table_known: whether the world frame is known to be a table's.
    """

    def __init__(self, path: str | Path, world_frame: str | None = None) -> None:
        """
        Read everything but the images.

        :param path: a rosbag2 folder, or a .mcap, .db3 or .bag file.
        :param world_frame: a frame of the bag with z up and z = 0 on the table top; None takes
            that of scene_info, else `table`, else estimates it from the depth.
        :raises HoocError: if the bag is damaged, has no depth, or lacks a calibration.
        """
        self.path = Path(path)
        contents = read_contents(self.path)
        self.topics: dict[str, BagTopic] = contents.topics
        self.info: dict[str, Any] = contents.info
        self.name: str = self.info['scene']
        self._notes = contents.notes
        self.depth_topics: dict[str, str] = in_camera_order(depth_topics(
            contents.first_images, contents.camera_infos, self.path), self.info['cameras'])
        self._all_topics = all_depth_topics(contents.first_images, contents.camera_infos)
        firsts = {name: contents.first_images[topic] for name, topic in self.depth_topics.items()}
        self._start_ns = max(_stamp_ns(image.header) for image in firsts.values())
        cameras = [bag_camera(name, topic, contents.camera_infos, firsts[name], self.path,
                              self._notes.rectified.of(name))
                   for name, topic in self.depth_topics.items()]
        frames = image_frames(self.depth_topics, contents, self.path)
        wanted = self._wanted_world(contents.tree, world_frame)
        self.table_known: bool = wanted is not None
        world = plain(wanted or contents.tree.root(next(iter(frames.values()))))
        self.world_frame: str = world
        self._units = {name: self.depth_unit(name) or encoded_unit(image.encoding)
                       for name, image in firsts.items()}
        self.source_cameras: tuple[Camera, ...] = tuple(
            replace(camera, T_world_camera=self._pose(contents.tree, world, camera.name,
                                                      frames[camera.name]))
            for camera in cameras)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return what the user should know though the bag can be used, in sentences."""
        sentences = oddities(self.path)
        names = cameras_without_depth(self.topics, self.depth_topics, self.info['cameras'])
        if names:
            sentences.append(
                f'{self.path}: there is no depth image of {", ".join(names)}, though the bag '
                f'names it as a camera, so only {", ".join(self.depth_topics)} will be used; '
                'record its depth topic, too')
        sentences += [
            f'{self.path}: camera {name} has several depth topics; {topics[0]} is used, not '
            f'{", ".join(topics[1:])}' for name, topics in self._all_topics.items() if topics[1:]]
        return tuple(sentences)

    @property
    def truth(self) -> tuple[TrueObject, ...] | None:
        """Return the ground truth objects, None if the bag has none."""
        return self.info['truth']

    @property
    def source_truth(self) -> tuple[TrueObject, ...] | None:
        """Return the same: a bag's truth is already in the frame of its table."""
        return self.truth

    def views(self, images: Mapping[str, int] | None = None) -> tuple[DepthView, ...]:
        """
        Return the DepthViews of one frame set, in camera order.

        :param images: {camera: which of its images, from 0 on}; an image without a reading is
            replaced by the next one. None takes the first moment at which every camera has an
            image, and each camera's image nearest to it.
        :raises HoocError: if an image is damaged or holds no reading, is in another unit than
            stated, or a camera does not look at the table.
        """
        chosen = self.source_views() if images is None else self._views_of(images)
        if self.table_known:
            check_aim(self.cameras, self.path)
            check_unit(chosen, [f'{self.path}: {topic}' for topic in self.depth_topics.values()],
                       list(self._units.values()), _UNIT_FIX)
        return tuple(replace(view, camera=camera)
                     for view, camera in zip(chosen, self.cameras))

    def depth(self) -> tuple[DepthView, ...]:
        """Return the DepthViews of the first frame set."""
        return self.views()

    def source_views(self) -> tuple[DepthView, ...]:
        """Return the DepthViews of the first frame set with the cameras of the source world."""
        return self._first_views

    def labels(self) -> dict[str, UInt8Array] | None:
        """Return {camera: (H, W) uint8 instance labels}, None if the bag holds none."""
        wanted = {beside(topic, 'instance_labels'): name
                  for name, topic in self.depth_topics.items()}
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
    def _first_views(self) -> tuple[DepthView, ...]:
        """Return the first frame set with the cameras of the source world."""
        names = tuple(self.depth_topics.values())
        start = self._start_ns
        nearest: dict[str, tuple[int, Any]] = {}
        passed = set()
        for message in iter_messages(self.path, set(names)):
            topic = message.topic.name
            if topic in passed:
                continue
            image = read_image(message, self.path)
            away = abs(_stamp_ns(image.header) - start)
            if topic not in nearest or away < nearest[topic][0]:
                nearest[topic] = away, image
            if _stamp_ns(image.header) >= start:
                passed.add(topic)
            if len(passed) == len(names):
                break
        return tuple(self._view(camera, topic, nearest[topic][1])
                     for camera, topic in zip(self.source_cameras, names))

    def _views_of(self, images: Mapping[str, int], exactly: bool = False
                  ) -> tuple[DepthView, ...]:
        """
        Return the DepthViews of images counted per camera, cameras of the source world.

        :param exactly: an image that cannot be used is an error, and not replaced by the next.
        """
        cameras = {self.depth_topics[camera.name]: camera for camera in self.source_cameras}
        left = {topic: images[camera.name] for topic, camera in cameras.items()}
        views: dict[str, DepthView] = {}
        for message in iter_messages(self.path, set(left)):
            topic = message.topic.name
            left[topic] -= 1
            if left[topic] >= 0 or topic in views:
                continue
            try:
                views[topic] = self._view(cameras[topic], topic,
                                          read_image(message, self.path))
            except HoocError:
                if exactly:
                    raise
                continue        # ingestion has dropped it, too
            if len(views) == len(cameras):
                return tuple(views[topic] for topic in cameras)
        raise HoocError(f'{self.path}: there is no such frame set in the bag; choose earlier '
                        'images')

    def _view(self, camera: Camera, topic: str, image: Any) -> DepthView:
        """Return the DepthView of an image message."""
        try:
            depth = decode_depth(image.data, image.height, image.width, image.encoding,
                                 image.step, image.is_bigendian, self.depth_unit(camera.name))
        except HoocError as error:
            raise HoocError(f'{self.path}: {topic}: {error}') from None
        if depth.shape != (camera.height, camera.width):
            raise HoocError(f'{self.path}: {topic} has {image.width} x {image.height} pixels, '
                            f'but its first image has {camera.width} x {camera.height}; record '
                            'one resolution')
        if not np.isfinite(depth).any():
            raise HoocError(f'{self.path}: {topic} holds an image with no reading; '
                            'record it again')
        if trouble := depth_unit_error(depth, image.encoding, ObserveConfig().max_depth_m):
            raise HoocError(f'{self.path}: {topic}: {trouble}')
        return DepthView(camera, depth)

    def depth_unit(self, camera_name: str) -> float | None:
        """Return the metres per count that the user states of a camera, None if nothing is."""
        return self._notes.depth_unit.of(camera_name)

    def _wanted_world(self, tree: FrameTree, world_frame: str | None) -> str | None:
        """Return the name of the frame that is a table's, None if none is known to be."""
        wanted = world_frame or self._notes.world_frame or self.info['world_frame']
        if wanted and plain(wanted) not in tree:
            raise HoocError(f'{self.path}: no transform names the world frame {wanted!r}; '
                            'record /tf_static or name another frame')
        if not wanted and TABLE_FRAME in tree:
            wanted = TABLE_FRAME
        return wanted

    def _pose(self, tree: FrameTree, world: str, camera_name: str, frame: str) -> Float64Array:
        """Return T_world_camera (4, 4) of the camera whose images are in `frame`."""
        T_world_camera = tree.transform(world, frame)
        if T_world_camera is None:
            for top in (tree.root(frame), tree.root(world)):
                if top in tree.moving:
                    raise HoocError(
                        f'{self.path}: camera {camera_name} (frame {frame!r}) is connected with '
                        f'{world!r} only by {top!r}, which moves in {tree.moving[top]!r} on /tf; '
                        'only cameras that stand still are used')
            raise HoocError(f'{self.path}: nothing connects camera {camera_name} (frame '
                            f'{frame!r}) with {world!r}; record /tf_static or '
                            f'{beside(self.depth_topics[camera_name], "extrinsics")} too')
        return T_world_camera


def _stamp_ns(header: Any) -> int:
    """Return a header's stamp in nanoseconds."""
    return header.stamp.sec * 10 ** 9 + header.stamp.nanosec
