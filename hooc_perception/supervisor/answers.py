# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes say of one frame set, from the messages of its stamp."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from geometry_msgs.msg import PoseArray
from hooc_perception.core.arrays import Float64Array, UInt32Array
from hooc_perception.core.parsing.events import EventLog
from hooc_perception.core.types import (
    Energy,
    GenericModel,
    ParsedScene,
    PixelProbabilities,
    UnknownObjects,
)
from hooc_perception.io.scenes.results import scene_result, with_ids
from hooc_perception.ros.messages.point_clouds import cloud_rows
from hooc_perception.ros.messages.stages import (
    candidates_from_messages,
    FLAG_HIDDEN,
    probabilities_from_message,
)
from hooc_perception.ros.messages.unknown import unknown_from_messages
import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String

# The topics of a result, with their types.
OBJECT_PARTS: dict[str, Any] = {
    'objects/poses': PoseArray, 'objects/attributes': PointCloud2, 'scene/summary': String,
    'objects/unknown': PoseArray, 'objects/unknown_attributes': PointCloud2}
NO_ENERGY = dict.fromkeys(('depth', 'probability', 'overlap'), float('nan'))


@dataclass(frozen=True)
class FrameSetResult:
    """
    The result of the nodes for one frame set.

    :ivar stamp_ns: stamp of the frame set.
    :ivar parsed: its pool holds the first proposals, not those of later rounds.
    :ivar seconds: from the arrival of the last depth image to the publication of the objects.
    :ivar probabilities: None if they were not received.
    :ivar images: {camera: index of its image in the bag, from 0 on}.
    :ivar ids: (n,) uint32 of the objects; `unknown_ids` of the things of no category.
    """

    stamp_ns: int
    parsed: ParsedScene
    seconds: float
    probabilities: PixelProbabilities | None
    images: dict[str, int]
    ids: UInt32Array
    unknown_ids: UInt32Array

    def moved(self, T: Float64Array | None) -> 'FrameSetResult':
        """Return the result in another frame; T (4, 4) maps into it, None = it stays."""
        return replace(self, parsed=self.parsed.moved(T))

    def entry(self, name: str, categories: Sequence[str], **extra: Any) -> dict[str, Any]:
        """
        Return the dict of this result as one scene of a results file.

        :param categories: names of the class ids 1..N.
        """
        return with_ids(scene_result(
            name, self.parsed, categories, self.seconds, stamp_ns=self.stamp_ns,
            images=self.images, **extra), self.ids, self.unknown_ids)


def frame_set_result(stamp_ns: int, parts: Mapping[str, Any], seconds: float,
                     images: dict[str, int]) -> FrameSetResult:
    """
    Return the result that messages tell.

    :param parts: {topic: its message of this stamp}, `scene/summary` as a mapping; all but
        objects/poses and objects/attributes may be missing.
    :param seconds: see FrameSetResult, as is `images`.
    :raises HoocError: if the messages do not belong together.
    """
    found = candidates_from_messages(parts['objects/poses'], parts['objects/attributes'])
    rows = cloud_rows(parts['objects/attributes'])
    pool = found
    if {'candidates/poses', 'candidates/attributes'} <= parts.keys():
        pool = candidates_from_messages(parts['candidates/poses'], parts['candidates/attributes'])
    unknown, unknown_ids = UnknownObjects.empty(), np.zeros(0, np.uint32)
    if {'objects/unknown', 'objects/unknown_attributes'} <= parts.keys():
        unknown = unknown_from_messages(parts['objects/unknown'],
                                        parts['objects/unknown_attributes'])
        unknown_ids = cloud_rows(parts['objects/unknown_attributes'])['id'].astype(np.uint32)
    summary = parts.get('scene/summary', {})
    energy = summary.get('energy', NO_ENERGY)
    parsed = ParsedScene(
        found, Energy(energy['depth'], energy['probability'], energy['overlap']),
        rows['visible_ratio'].copy(), rows['residual_m'].copy(), rows['energy_delta'].copy(),
        rows['n_views'].copy(), pool, converged=summary.get('converged', True),
        seconds=summary.get('seconds', {}), sigma_t=rows['sigma_t'].copy(),
        sigma_r=rows['sigma_r'].copy(), unknown=unknown,
        hidden_s=np.where(rows['flags'] & FLAG_HIDDEN, rows['age_s'], 0).astype(np.float32))
    probabilities = parts.get('pixels/probabilities')
    return FrameSetResult(
        stamp_ns, parsed, seconds,
        None if probabilities is None else probabilities_from_message(probabilities),
        images, rows['id'].astype(np.uint32), unknown_ids)


def images_of(stamp_ns: int, image_stamps: Mapping[str, Iterable[int]]) -> dict[str, int]:
    """Return {camera: index of its image} of a frame set: the first ones not before it."""
    return {camera: sum(stamp < stamp_ns for stamp in stamps)
            for camera, stamps in image_stamps.items()}


def events_between(results: Iterable[FrameSetResult],
                   models: Sequence[GenericModel]) -> list[list[dict[str, Any]]]:
    """Return what happened before each of several results, as `objects/events` tells it."""
    log = EventLog(models)
    return [[event.to_dict() for event in log.update(r.ids, r.parsed.objects, r.parsed.hidden_s)]
            for r in results]
