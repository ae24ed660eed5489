# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What a user states of the images of a camera: their unit, and that they are rectified."""

from typing import NamedTuple

from hooc_perception.errors import HoocError
from hooc_perception.io.camera_info import is_rectified
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.node import Node

AUTO, YES, NO = 'auto', 'true', 'false'


class ImageNotes(NamedTuple):
    """
    What holds for the images of one camera.

    :ivar depth_unit: metres per count; None = as the encoding says.
    :ivar rectified: whether they are free of distortion, so that P holds and not K and D.
    """

    depth_unit: float | None = None
    rectified: bool = False


class ImageParameters:
    """The parameters `depth_unit.<camera>` and `rectified.<camera>` of a node."""

    def __init__(self, node: Node) -> None:
        """Declare nothing yet."""
        self._node = node

    def declare(self, name: str) -> None:
        """Declare the parameters of a camera; HoocError if a value cannot be meant."""
        if not self._node.has_parameter(f'depth_unit.{name}'):
            self._node.declare_parameter(f'depth_unit.{name}', 0.0, ParameterDescriptor(
                description=f'Metres per count of the depth images of {name}, where 16UC1 is not '
                'in millimetres or 32FC1 not in metres; 0 = as the encoding says.',
                floating_point_range=[FloatingPointRange(from_value=0.0, to_value=1.0)]))
            self._node.declare_parameter(f'rectified.{name}', AUTO, ParameterDescriptor(
                description=f'Whether the images of {name} are rectified, so that P of '
                'camera_info holds and not K and D: true, false, or auto, which takes image_rect '
                'and the like as rectified.', dynamic_typing=True))
        self._value(name)

    def notes(self, name: str, image_topic: str) -> ImageNotes:
        """
        Return what holds for the images of a camera, as it is now.

        :param image_topic: by whose name `auto` decides.
        """
        rectified = self._value(name)
        unit = self._node.get_parameter(f'depth_unit.{name}').value
        return ImageNotes(
            float(unit) if unit else None,
            is_rectified(image_topic) if rectified == AUTO else rectified == YES)

    def _value(self, name: str) -> str:
        """Return the parameter `rectified` of a camera."""
        value = str(self._node.get_parameter(f'rectified.{name}').value).lower()
        if value not in (AUTO, YES, NO):
            raise HoocError(f'parameter rectified.{name} is {value!r}; give auto, true or false')
        return value
