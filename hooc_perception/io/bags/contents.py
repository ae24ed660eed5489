# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read what a bag says besides its images: transforms, calibrations, scene description."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import CAMERA_INFO, STRING, TF, TRANSFORM
from hooc_perception.io.bags.files import BagTopic, iter_messages, topics
from hooc_perception.io.bags.frames import FrameTree, plain
from hooc_perception.io.bags.images import base_topic, may_hold_depth, read_image
from hooc_perception.io.bags.notes import read_notes, RecordingNotes
from hooc_perception.io.bags.scene_info import default_info, parsed_info, SUFFIX

TABLE_FRAME = 'table'


@dataclass(frozen=True, eq=False)
class BagContents:
    """
    The small messages of a bag and the first image of each topic.

    :ivar topics: {name: BagTopic}.
    :ivar tree: of /tf_static and extrinsics topics.
    :ivar camera_infos: {topic: its first CameraInfo message}.
    :ivar info: content of /hooc/scene_info over its defaults.
    :ivar first_images: {topic: its first depth or other image, as Image message}.
    :ivar extrinsics: {extrinsics topic: the frame of the camera that it places}.
    :ivar notes: what the user states beside the bag.
    """

    topics: dict[str, BagTopic]
    tree: FrameTree
    camera_infos: dict[str, Any]
    info: dict[str, Any]
    first_images: dict[str, Any]
    extrinsics: dict[str, str]
    notes: RecordingNotes


def read_contents(path: Path) -> BagContents:
    """Return the BagContents of a bag; raise HoocError if the bag is damaged."""
    known = topics(path)
    wanted = {topic.name for topic in known.values()
              if topic.type_name in (CAMERA_INFO, TRANSFORM, TF) and topic.name != '/tf'}
    wanted |= {name for name, topic in known.items()
               if name.endswith(SUFFIX) and topic.type_name == STRING}
    tree, camera_infos, info, extrinsics = FrameTree(), {}, {}, {}
    for message in iter_messages(path, wanted):
        topic = message.topic
        if topic.type_name == CAMERA_INFO:
            if topic.name not in camera_infos:
                camera_infos[topic.name] = message.read(path)
        elif topic.name.endswith(SUFFIX):
            info = parsed_info(message.read(path).data, f'{path}: {topic.name}')
        else:
            content = message.read(path)
            for stamped in content.transforms if topic.type_name == TF else [content]:
                tree.add(stamped, f'{path}: {topic.name}')
            if topic.type_name == TRANSFORM:
                extrinsics[topic.name] = plain(content.child_frame_id)
    firsts = _first_images(path, known)
    if any(tree.transform(info.get('world_frame') or TABLE_FRAME, image.header.frame_id) is None
           for image in firsts.values()):
        _add_unmoved(path, known, tree)
    return BagContents(known, tree, camera_infos, {**default_info(path.resolve().stem), **info},
                       firsts, extrinsics, read_notes(path))


def image_frames(topics: Mapping[str, str], contents: BagContents, path: Path) -> dict[str, str]:
    """
    Return {camera: frame of its images}, that of its extrinsics topic if they name none.

    :param topics: {camera: depth topic}.
    :raises HoocError: if images carry no frame_id, or those of two cameras the same.
    """
    cameras: dict[str, str] = {}
    for name, topic in topics.items():
        frame = plain(contents.first_images[topic].header.frame_id)
        placed = contents.extrinsics.get(beside(topic, 'extrinsics'))
        if frame not in contents.tree and placed:
            frame = placed
        if not frame and len(contents.tree):
            raise HoocError(f'{path}: the images of {topic} carry no frame_id, so no transform '
                            'belongs to them; let the driver set it, or record '
                            f'{beside(topic, "extrinsics")}')
        if frame in cameras:
            raise HoocError(f'{path}: the images of {cameras[frame]} and {name} carry the same '
                            f'frame_id {frame!r}, so only one of the cameras has a pose; let '
                            'their drivers name a frame each')
        cameras[frame] = name
    return {name: frame for frame, name in cameras.items()}


def beside(topic: str, name: str) -> str:
    """Return the topic `name` of a camera: beside the folder of its depth image."""
    return f'{base_topic(topic).rsplit("/", 2)[0]}/{name}'


def _add_unmoved(path: Path, known: dict[str, BagTopic], tree: FrameTree) -> None:
    """Add what did not move on /tf, where robot_state_publisher sends fixed joints, too."""
    names = {topic.name for topic in known.values()
             if topic.type_name == TF and topic.name == '/tf'}
    tree.add_unmoved((stamped for message in iter_messages(path, names)
                      for stamped in message.read(path).transforms), f'{path}: /tf')


def _first_images(path: Path, known: dict[str, BagTopic]) -> dict[str, Any]:
    """Return {topic: its first Image message}."""
    left = {topic.name for topic in known.values() if may_hold_depth(topic) and topic.count}
    firsts = {}
    for message in iter_messages(path, set(left)):
        if message.topic.name in left:
            firsts[message.topic.name] = read_image(message, path)
            left.discard(message.topic.name)
            if not left:
                break
    return firsts
