# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One answer as every way out of the parsing node takes it: services, tf2, MoveIt, vision_msgs."""

from dataclasses import dataclass

from hooc_perception.chain import topic_token
from hooc_perception.core.types import GenericModel
from hooc_perception.ros.messages.conversions import header
import numpy as np


@dataclass(frozen=True)
class DetectedObject:
    """
    An object that stands on the table.

    :ivar id: instance id, lasting; class_id: 1..N.
    :ivar translation: (3,) float64 centre of its bounding box, target frame, metres.
    :ivar rotation_xyzw: (4,) float64, model axes to target frame.
    :ivar size: (3,) float64 extents along the model's axes, metres.
    :ivar sigma_t, sigma_r: metres and radians within which 68 % of the errors lie, NaN = not
        estimated.
    :ivar model: the GenericModel of its category.
    """

    id: int
    class_id: int
    score: float
    translation: np.ndarray
    rotation_xyzw: np.ndarray
    size: np.ndarray
    sigma_t: float
    sigma_r: float
    model: GenericModel

    @property
    def category(self):
        """Return the category's name."""
        return self.model.name

    @property
    def name(self):
        """Return a name that no other object has, such as teacup_7."""
        return f'{topic_token(self.category)}_{self.id}'


@dataclass(frozen=True)
class DetectedScene:
    """The objects (DetectedObject) of a frame set, `stamp_ns`, in the target frame `frame`."""

    stamp_ns: int
    frame: str
    objects: tuple

    @property
    def header(self):
        """Return the std_msgs/Header of all that says this answer."""
        return header(self.stamp_ns, self.frame)


def detected_scene(parsed, ids, models, stamp_ns, frame):
    """
    Return the DetectedScene of a ParsedScene.

    :param ids: (n,) instance ids.
    :param models: tuple of GenericModel; class id c is models[c - 1].
    """
    found = parsed.objects
    sigma_t, sigma_r = (np.full(len(found), np.nan) if sigma is None else sigma
                        for sigma in (parsed.sigma_t, parsed.sigma_r))
    return DetectedScene(stamp_ns, frame, tuple(
        DetectedObject(int(ids[i]), int(found.category[i]), float(found.score[i]),
                    found.translation[i], found.rotation_xyzw[i], found.size[i].astype(float),
                    float(sigma_t[i]), float(sigma_r[i]), models[int(found.category[i]) - 1])
        for i in range(len(found))))
