# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read what a bag says besides its images: transforms, calibrations, scene description."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hooc_perception.io.bags.bag_format import CAMERA_INFO, IMAGE, STRING, TF, TRANSFORM
from hooc_perception.io.bags.files import BagTopic, iter_messages, topics
from hooc_perception.io.bags.frames import FrameTree
from hooc_perception.io.bags.scene_info import default_info, parsed_info, SUFFIX


@dataclass(frozen=True, eq=False)
class BagContents:
    """
    The small messages of a bag and the first image of each topic.

    :ivar topics: {name: BagTopic}.
    :ivar tree: of /tf_static and extrinsics topics.
    :ivar camera_infos: {topic: its first CameraInfo message}.
    :ivar info: content of /hooc/scene_info over its defaults.
    :ivar first_images: {topic: its first Image message}.
    """

    topics: dict[str, BagTopic]
    tree: FrameTree
    camera_infos: dict[str, Any]
    info: dict[str, Any]
    first_images: dict[str, Any]


def read_contents(path: Path) -> BagContents:
    """Return the BagContents of a bag; raise HoocError if the bag is damaged."""
    known = topics(path)
    wanted = {topic.name for topic in known.values()
              if topic.type_name in (CAMERA_INFO, TRANSFORM, TF) and topic.name != '/tf'}
    wanted |= {name for name, topic in known.items()
               if name.endswith(SUFFIX) and topic.type_name == STRING}
    tree, camera_infos, info = FrameTree(), {}, {}
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
    return BagContents(known, tree, camera_infos, {**default_info(path.resolve().stem), **info},
                       _first_images(path, known))


def _first_images(path: Path, known: dict[str, BagTopic]) -> dict[str, Any]:
    """Return {topic: its first Image message}."""
    left = {topic.name for topic in known.values() if topic.type_name == IMAGE and topic.count}
    firsts = {}
    for message in iter_messages(path, set(left)):
        if message.topic.name in left:
            firsts[message.topic.name] = message.read(path)
            left.discard(message.topic.name)
            if not left:
                break
    return firsts
