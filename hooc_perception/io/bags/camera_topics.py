# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Find the depth cameras among the topics of a bag, and their calibrations."""

from collections.abc import Iterable, Mapping
from pathlib import Path
import re
from typing import Any, TYPE_CHECKING

from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.depth_encodings import DEPTH_ENCODINGS
from hooc_perception.io.scenes import camera_files
import numpy as np

if TYPE_CHECKING:
    from hooc_perception.io.bags.files import BagTopic

# Drivers publish the same image in several states; the rawest one of a camera is used.
_STATES = ('image_raw', 'image_rect_raw', 'image', 'image_rect')
RECTIFIED = ('image_rect',)


def depth_topics(firsts: Mapping[str, Any], path: str | Path) -> dict[str, str]:
    """
    Return {camera name: depth image topic} of a bag.

    A depth topic carries images in a depth encoding and has `depth` in its name, which
    distinguishes it from infrared images; if no name has, the encoding alone decides.

    :param firsts: {topic: its first Image message}.
    :raises HoocError: if there is none; the message lists the images of the bag.
    """
    depth_like = [topic for topic, image in firsts.items() if image.encoding in DEPTH_ENCODINGS]
    named = [topic for topic in depth_like if 'depth' in topic.lower()]
    chosen: dict[str, str] = {}
    for topic in sorted(named or [t for t in depth_like if 'infra' not in t and '/ir' not in t],
                        key=_rank):
        chosen.setdefault(topic.rpartition('/')[0], topic)
    if not chosen:
        there = ', '.join(f'{topic} ({image.encoding})' for topic, image in firsts.items())
        raise HoocError(f'{path}: there is no depth topic among its images ({there or "none"}); '
                        'record sensor_msgs/Image topics in 16UC1 or 32FC1')
    names: dict[str, str] = {}
    for folder, topic in chosen.items():
        name = _camera_name(folder)
        while name in names:
            name += '_'
        names[name] = topic
    return names


def camera_from_info(name: str, topic: str, infos: Mapping[str, Any], image: Any,
                     path: str | Path) -> Camera:
    """
    Return the Camera, without a pose, of the CameraInfo topic beside a depth topic.

    :param infos: {topic: CameraInfo message}.
    :param image: an Image message of the topic, for its size.
    :raises HoocError: if there is no CameraInfo or it is not a calibration.
    """
    info_topic = topic.rpartition('/')[0] + '/camera_info'
    if info_topic not in infos:
        raise HoocError(f'{path}: {info_topic} is missing, so {topic} has no calibration; '
                        'record it too')
    info, where = infos[info_topic], f'{path}: {info_topic}'
    if (info.width, info.height) != (image.width, image.height):
        raise HoocError(f'{where} says width {info.width} and height {info.height}, but {topic} '
                        f'has {image.width} x {image.height} pixels; correct the driver')
    rectified = topic.rpartition('/')[2] in RECTIFIED
    K = np.reshape(info.p, (3, 4))[:, :3] if rectified else np.reshape(info.k, (3, 3))
    K = camera_files.intrinsics(K.ravel().tolist(), info.width, info.height,
                                f'{where} {"P" if rectified else "K"}')
    D = np.zeros(0) if rectified else np.asarray(info.d)
    model = info.distortion_model or 'plumb_bob'
    if not D.any():
        D, model = np.zeros(0), model if model in camera_files.COEFFICIENTS else 'plumb_bob'
    return Camera(name, info.width, info.height, K,
                  camera_files.distortion(D.tolist(), model, where), np.eye(4), model)


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


def _rank(topic: str) -> tuple[int, str]:
    """Return a sort key: the rawest state of an image first, then by name."""
    state = topic.rpartition('/')[2]
    return _STATES.index(state) if state in _STATES else len(_STATES), topic


def _camera_name(folder: str) -> str:
    """Return a camera's name from the folder of its image: /hooc/kinect1/depth -> kinect1."""
    tokens = [t for t in folder.split('/') if t]
    if tokens and tokens[0] == 'hooc':
        tokens = tokens[1:]
    tokens = [t for t in tokens if t != 'depth'] or ['camera']
    name = re.sub(r'\W', '_', '_'.join(tokens))
    return name if name[0].isalpha() else f'camera_{name}'
