# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Kinds of cases for the fuzzer: messages as broken drivers and other versions send them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from geometry_msgs.msg import TransformStamped
from hooc_perception.benchmark.fuzz_bags import small_scene
from hooc_perception.benchmark.mutate import damaged, odd_number, odd_text
from hooc_perception.core.geometry import pose_from_matrix
from hooc_perception.core.segment.checks import table_trouble
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Candidates, PixelProbabilities
from hooc_perception.errors import HoocError
from hooc_perception.ros.inputs.raw_frames import RawFrames
from hooc_perception.ros.messages import conversions as c
from hooc_perception.ros.messages.observations import (
    observation_from_messages,
    poses_message,
    segments_message,
    ViewMessages,
)
from hooc_perception.ros.messages.stages import (
    candidates_from_messages,
    candidates_messages,
    probabilities_from_message,
    probabilities_message,
)
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, Image

_SCENE, _ = small_scene()


def _raw_messages() -> tuple[Image, CameraInfo, TransformStamped]:
    """Return (Image, CameraInfo, TransformStamped) of the small scene's first camera."""
    view = _SCENE.depth()[0]
    head = c.header(10 ** 18, 'left_optical')
    counts = np.rint(view.depth * 1000).astype(np.uint16)
    return (c.image_message(counts, '16UC1', head), c.camera_info_message(view.camera, head),
            c.transform_message(*pose_from_matrix(view.camera.T_world_camera),
                                c.header(0, 'table'), 'left_optical'))


def _spoil(message: Any, rng: np.random.Generator, chance: float = 0.2) -> None:
    """Change fields of a message in place, nested ones too."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if hasattr(value, 'get_fields_and_field_types'):
            _spoil(value, rng, chance)
            continue
        if rng.random() > chance:
            continue
        try:
            setattr(message, name, _odd(value, kind, rng))
        except (AssertionError, ValueError, TypeError, OverflowError):
            pass    # a message cannot hold that value


def _odd(value: Any, kind: str, rng: np.random.Generator) -> Any:
    """Return a strange value of the same type."""
    if isinstance(value, str):
        return odd_text(rng)
    if isinstance(value, bool) or isinstance(value, (int, float)):
        return odd_number(value, rng)
    if len(value) and isinstance(value[0], (int, np.integer)):
        return damaged(bytes(value), rng)
    values = [odd_number(float(x), rng) if rng.random() < 0.3 else float(x) for x in value]
    if kind.startswith('sequence'):
        values = values[:int(rng.integers(len(values) + 1))] * int(rng.integers(1, 4))
    return values


def _camera_case(rng: np.random.Generator, _: Path) -> None:
    """Pass the corrupted messages of one camera to everything that ingestion does with them."""
    messages = _raw_messages()
    for message in messages:
        if rng.random() < 0.6:
            _spoil(message, rng)
    _decode(*messages)


def _decode(image: Image, info: CameraInfo, transform: TransformStamped) -> None:
    """Do with the messages of a camera what the ingestion node does."""
    frames = RawFrames('left')
    frame = frames.decode(image, info, transform, ObserveConfig())
    frames.remember(frame.depth, 3)
    if frame.depth.size > 2 ** 22:
        raise HoocError('the image is larger than the fuzzer has time for')
    view = rectify(frames.view(frame)[0])
    table_trouble(view, 0.025, 0.8)
    observe([view], ObserveConfig())


def _wire_case(rng: np.random.Generator, _: Path) -> None:
    """Pass bytes that are not an Image to the deserializer, as a replayed bag may."""
    image, info, transform = _raw_messages()
    data = damaged(serialize_message(image), rng)
    try:
        image = deserialize_message(data, Image)
    except Exception as error:      # what the replay node does with it
        raise HoocError('a message is damaged') from error
    _decode(image, info, transform)


def _stage_case(rng: np.random.Generator, _: Path) -> None:
    """Pass the corrupted messages of one stage to the next."""
    n = int(rng.integers(0, 6))
    head = c.header(5, 'table')
    candidates = Candidates(
        np.ones(n, np.uint16), rng.normal(size=(n, 3)), np.tile([0.0, 0, 0, 1], (n, 1)),
        np.ones((n, 3), np.float32), np.ones(n, np.float32), (np.arange(n) % 2).astype(np.uint16))
    poses, attributes = candidates_messages(candidates, head)
    observation = observe([rectify(v) for v in _SCENE.depth()])
    rows = np.arange(n) % 3
    probabilities = probabilities_message(PixelProbabilities(
        np.zeros(n, np.uint8), np.stack([rows, rows], -1).astype(np.uint16),
        np.full((n, 2), 128, np.uint8)), observation, ['box'], head)
    for message in (poses, attributes, probabilities):
        if rng.random() < 0.5:
            _spoil(message, rng, 0.1)
        for item in getattr(message, 'fields', ()):
            _spoil(item, rng, 0.02)
    probabilities_from_message(probabilities, observation, 1)
    candidates_from_messages(poses, attributes, [2])


def _observation_case(rng: np.random.Generator, _: Path) -> None:
    """Pass the corrupted messages of ingestion to the reader of the later nodes."""
    observation, head = observe([rectify(v) for v in _SCENE.depth()]), c.header(5, 'table')
    poses, views = poses_message(observation, head), {}
    if rng.random() < 0.5:
        _spoil(poses, rng, 0.1)
    for field in poses.fields:
        _spoil(field, rng, 0.02)
    for view in observation.views:
        messages = (c.camera_info_message(view.camera, head), c.depth_message(view.depth, head),
                    segments_message(view, head))
        for message in messages:
            if rng.random() < 0.2:
                _spoil(message, rng, 0.1)
        views[view.camera.name] = ViewMessages(*messages)
    observation_from_messages(views, poses)


def message_cases() -> dict[str, Callable[[np.random.Generator, Path], None]]:
    """Return {kind: function(rng, folder)}."""
    return {'messages of a camera': _camera_case, 'bytes on the wire': _wire_case,
            'messages of a stage': _stage_case, 'messages of ingestion': _observation_case}
