# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One result as every output of the parsing node uses it: services, tf2, MoveIt, vision_msgs."""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.chain import topic_token
from hooc_perception.core.arrays import AnyArray, Float64Array
from hooc_perception.core.types import GenericModel, ParsedScene
from hooc_perception.ros.messages.conversions import header
import numpy as np
from std_msgs.msg import Header

# Namespace of the markers and prefix of the names of things of no category.
UNKNOWN = 'unknown'


@dataclass(frozen=True)
class DetectedObject:
    """
    An object on the table.

    :ivar id: persistent instance id.
    :ivar class_id: 1..N.
    :ivar member: which mesh of the category's family was found, 0 = the generic one.
    :ivar translation: (3,) float64 centre of its bounding box, target frame, metres.
    :ivar rotation_xyzw: (4,) float64, model axes to target frame.
    :ivar size: (3,) float64 extents along the axes of the model, metres.
    :ivar sigma_t: metres within which 68 % of the errors lie, NaN = not estimated.
    :ivar sigma_r: the same for the rotation, radians.
    :ivar model: that mesh.
    :ivar hidden_s: seconds since it was last seen, because the robot hides it; 0 = it was found.
    """

    id: int
    class_id: int
    member: int
    score: float
    translation: Float64Array
    rotation_xyzw: Float64Array
    size: Float64Array
    sigma_t: float
    sigma_r: float
    model: GenericModel
    hidden_s: float = 0.0

    @property
    def category(self) -> str:
        """Return the name of the category."""
        return self.model.name

    @property
    def name(self) -> str:
        """Return a unique name, such as teacup_7."""
        return f'{topic_token(self.category)}_{self.id}'


@dataclass(frozen=True)
class DetectedUnknown:
    """
    Something of no category.

    :ivar id: persistent instance id, unlike those of known objects.
    :ivar translation: (3,) float64 centre of its box, target frame, metres.
    :ivar rotation_xyzw: (4,) float64, box axes to target frame.
    :ivar size: (3,) float64 sides of the box, metres.
    :ivar hull: (k, 3) float64 corners of its convex hull, target frame, metres.
    """

    id: int
    score: float
    translation: Float64Array
    rotation_xyzw: Float64Array
    size: Float64Array
    hull: Float64Array

    @property
    def name(self) -> str:
        """Return a unique name, such as unknown_7."""
        return f'{UNKNOWN}_{self.id}'


@dataclass(frozen=True)
class DetectedScene:
    """The objects of the frame set of stamp `stamp_ns`, in the target frame `frame`."""

    stamp_ns: int
    frame: str
    objects: tuple[DetectedObject, ...]
    unknown: tuple[DetectedUnknown, ...] = ()

    @property
    def header(self) -> Header:
        """Return the std_msgs/Header of all messages of this result."""
        return header(self.stamp_ns, self.frame)


def detected_scene(parsed: ParsedScene, ids: AnyArray, models: Sequence[GenericModel],
                   stamp_ns: int, frame: str, unknown_ids: AnyArray | None = None,
                   ) -> DetectedScene:
    """
    Return the DetectedScene of a ParsedScene.

    :param ids: (n,) instance ids.
    :param unknown_ids: those of the things of no category; None = leave these out.
    :param models: class id c is models[c - 1].
    """
    found = parsed.objects
    sigma_t, sigma_r = (np.full(len(found), np.nan) if sigma is None else sigma
                        for sigma in (parsed.sigma_t, parsed.sigma_r))
    return DetectedScene(stamp_ns, frame, tuple(
        DetectedObject(int(ids[i]), int(found.category[i]), int(found.member[i]),
                       float(found.score[i]), found.translation[i], found.rotation_xyzw[i],
                       found.size[i].astype(float), float(sigma_t[i]), float(sigma_r[i]), model,
                       0.0 if parsed.hidden_s is None else float(parsed.hidden_s[i]))
        for i, model in enumerate(found.shapes(models))), tuple(
            DetectedUnknown(int(number), *row) for number, *row in zip(
                () if unknown_ids is None else unknown_ids, parsed.unknown.score.tolist(),
                parsed.unknown.translation, parsed.unknown.rotation_xyzw,
                parsed.unknown.size.astype(float), parsed.unknown.hulls)))
