# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Find the depth cameras among the topics of a bag, and their calibrations."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
import re
from typing import Any, TYPE_CHECKING

from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.images import base_topic
from hooc_perception.io.camera_info import camera_from_info, is_rectified
from hooc_perception.io.depth_encodings import DEPTH_ENCODINGS

if TYPE_CHECKING:
    from hooc_perception.io.bags.files import BagTopic

# Drivers publish the same image in several states; the rawest one of a camera is used.
_STATES = ('image_raw', 'image_rect_raw', 'image', 'image_rect')
# Folders by which drivers tell the streams of one camera apart: realsense2, azure_kinect and
# orbbec, openni and rgbd_launch, kinect2_bridge. The latter four hold depth that was warped or
# scaled to another image, which invents surfaces at depth edges.
_STREAM = re.compile(r'depth|sd')
_REGISTERED = re.compile(r'aligned_depth_to_\w+|depth_to_\w+|(depth|hw|sw)_registered|q?hd')
_NOT_DEPTH = re.compile(r'(?<!_to_)infra|confiden|dispar|intensity|amplitude|(^|[/_])ir([/_]|$)')


def depth_topics(firsts: Mapping[str, Any], infos: Collection[str],
                 path: str | Path) -> dict[str, str]:
    """
    Return {camera name: depth image topic} of a bag, one topic per camera.

    A depth topic carries images in a depth encoding and has `depth` in its name, which
    distinguishes it from infrared images; if no name has, the encoding alone decides.

    :param firsts: {topic: its first image as Image message}.
    :param infos: the topics of CameraInfo messages.
    :raises HoocError: if there is none; the message lists the images of the bag.
    """
    cameras = all_depth_topics(firsts, infos)
    if not cameras:
        there = ', '.join(f'{topic} ({image.encoding})' for topic, image in firsts.items())
        raise HoocError(f'{path}: there is no depth topic among its images ({there or "none"}); '
                        'record sensor_msgs/Image topics in 16UC1 or 32FC1')
    return {name: topics[0] for name, topics in cameras.items()}


def all_depth_topics(firsts: Mapping[str, Any], infos: Collection[str]) -> dict[str, list[str]]:
    """Return {camera name: its depth topics, the one to use first}; see `depth_topics`."""
    found = [topic for topic, image in firsts.items() if image.encoding in DEPTH_ENCODINGS
             and not _NOT_DEPTH.search(topic.lower())]
    cameras: defaultdict[str, list[str]] = defaultdict(list)
    for topic in [t for t in found if 'depth' in t.lower()] or found:
        cameras[camera_of_topic(topic)].append(topic)
    return {name: sorted(topics, key=lambda topic: _rank(topic, infos))
            for name, topics in sorted(cameras.items())}


def bag_camera(name: str, topic: str, infos: Mapping[str, Any], image: Any, path: str | Path,
               rectified: bool | None = None) -> Camera:
    """
    Return the Camera, without a pose, of a depth topic.

    :param infos: {topic: CameraInfo message}.
    :param image: an Image message of the topic, for its size and frame.
    :param rectified: whether the images are; None lets the name of the topic decide.
    :raises HoocError: if there is no CameraInfo or it is not a calibration.
    """
    info_topic = info_topic_of(topic, infos)
    info = infos.get(info_topic)
    if info is None:
        raise HoocError(f'{path}: {info_topic} is missing, so {topic} has no calibration; '
                        'record it too')
    rectified = is_rectified(base_topic(topic)) if rectified is None else rectified
    return camera_from_info(name, info, (image.width, image.height), rectified,
                            f'{path}: {info_topic}')


def camera_of_topic(topic: str) -> str:
    """Return the name of the camera of an image topic: /hooc/kinect1/depth/image_raw: kinect1."""
    return _camera_name(_folder(topic))


def info_topic_of(topic: str, infos: Collection[str]) -> str:
    """Return the CameraInfo topic of an image: beside it, below it, or in the folder above."""
    beside = f'{_folder(topic)}/camera_info'
    others = (f'{base_topic(topic)}/camera_info', f'{_folder(topic)}/depth_camera_info',
              f'{_folder(topic).rpartition("/")[0]}/camera_info')
    return next((name for name in (beside, *others) if name in infos), beside)


def cameras_without_depth(topics: Mapping[str, 'BagTopic'], found: Iterable[str],
                          listed: Iterable[str]) -> list[str]:
    """
    Return the names of cameras that a bag mentions without any depth image.

    A bag mentions a camera by its calibration, its pose or an empty image topic.

    :param topics: {name: BagTopic}.
    :param found: the names from `depth_topics`.
    :param listed: the names in scene_info.
    """
    names = set(listed)
    for topic, details in topics.items():
        folder, _, last = topic.rpartition('/')
        kind = details.type_name.rpartition('/')[2]
        if (kind == 'TransformStamped' and last == 'extrinsics'
                or kind == 'CameraInfo' and 'depth' in topic.lower()
                or kind == 'Image' and 'depth' in topic.lower() and not details.count):
            names.add(_camera_name(folder))
    return sorted(names - set(found))


def in_camera_order(found: Mapping[str, str], order: Sequence[str]) -> dict[str, str]:
    """Return {camera: topic} in the order of scene_info, unlisted cameras last."""
    return dict(sorted(found.items(), key=lambda item: (
        order.index(item[0]) if item[0] in order else len(order), item[0])))


def _rank(topic: str, infos: Collection[str]) -> tuple[bool, bool, bool, bool, int, str]:
    """Return a sort key: the rawest state of an image first, then by name."""
    base = base_topic(topic)
    state = base.rpartition('/')[2]
    return (any(_REGISTERED.fullmatch(token) for token in base.split('/')),
            info_topic_of(topic, infos) not in infos, is_rectified(base), base != topic,
            _STATES.index(state) if state in _STATES else len(_STATES), topic)


def _folder(topic: str) -> str:
    """Return the folder of an image topic, whatever the transport."""
    return base_topic(topic).rpartition('/')[0]


def _camera_name(folder: str) -> str:
    """Return a camera's name from the folder of its image: /hooc/kinect1/depth -> kinect1."""
    tokens = [t for t in folder.split('/') if t]
    if tokens and tokens[0] == 'hooc':
        tokens = tokens[1:]
    tokens = [t for t in tokens
              if not _STREAM.fullmatch(t) and not _REGISTERED.fullmatch(t)] or ['camera']
    name = re.sub(r'\W', '_', '_'.join(tokens))
    return name if name[0].isalpha() else f'camera_{name}'
