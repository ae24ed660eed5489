# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters `mask_image.<camera>`: pixels of a camera that are masked in every image."""

from collections.abc import Iterable
from pathlib import Path

from hooc_perception.core.arrays import BoolArray
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.robot.mask_image import read_mask
from hooc_perception.ros.inputs.joint_states import StateUnknown
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node


class MaskImages:
    """Read the mask images of cameras when they are first needed, and when they change."""

    def __init__(self, node: Node, names: Iterable[str]) -> None:
        """
        Declare the parameters of the named cameras on a node.

        :raises HoocError: if there is no file of a path.
        """
        self._node = node
        self._masks: dict[str, tuple[str, BoolArray]] = {}     # camera -> (path, mask)
        for name in names:
            key = f'mask_image.{name}'
            if not node.has_parameter(key):
                node.declare_parameter(key, '', ParameterDescriptor(
                    description=f'8-bit grey PNG of the size of the raw images of {name}: pixels '
                    'that are not black are masked; empty = none.'))
            path = node.get_parameter(key).value
            if path and not Path(path).is_file():
                raise HoocError(f'parameter {key} is {path!r}, which does not exist; give the '
                                'path of a PNG')

    def of(self, name: str, camera: Camera) -> BoolArray | None:
        """
        Return the mask (H, W) of a camera, None if it has none.

        :raises StateUnknown: if the file cannot be used.
        """
        path = self._node.get_parameter(f'mask_image.{name}').value
        if not path:
            return None
        known = self._masks.get(name)
        if known is None or known[0] != path or known[1].shape != (camera.height, camera.width):
            try:
                known = self._masks[name] = path, read_mask(path, camera.width, camera.height)
            except HoocError as error:
                raise StateUnknown('bad_mask_image', f'mask_image.{name}: {error}') from error
        return known[1]
