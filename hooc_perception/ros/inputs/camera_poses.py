# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Camera poses from parameters and from tf2."""

from typing import Any

from builtin_interfaces.msg import Time as Stamp
from geometry_msgs.msg import TransformStamped
from hooc_perception.errors import HoocError
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import is_rigid, nanoseconds
import numpy as np
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time

try:
    from tf2_ros import (  # pyright: ignore[reportMissingImports] - on ROS installations only
        Buffer,
        ExtrapolationException,
        TransformException,
        TransformListener,
    )
except ImportError:
    Buffer = TransformListener = None
    ExtrapolationException = TransformException = LookupError


class PoseNotYet(HoocError):
    """/tf knows where a camera is, but not at the stamp that was asked for."""


class TfPoses:
    """Camera poses from /tf and /tf_static if tf2 is installed; else always None."""

    def __init__(self, node: StageNode[Any, Any]) -> None:
        """Listen for a StageNode until it is cleaned up."""
        self._buffer: Any = None
        # (source frame, who asks) -> last stamp in ns.
        self._asked: dict[tuple[str, str], int] = {}
        if Buffer is not None and TransformListener is not None:
            self._buffer = Buffer()
            node.owned(TransformListener.unregister, TransformListener(self._buffer, node))

    def lookup(self, target: str, source: str, stamp: Stamp,
               asker: str = '') -> TransformStamped | None:
        """
        Return the TransformStamped T_target_source at a stamp, or None if none is known.

        A static pose holds at every stamp; a camera on an arm was elsewhere a moment ago.

        :param asker: whose stamps these are: time was set back if they are not in order.
        :raises PoseNotYet: if it is known at other stamps only.
        """
        if self._buffer is None or not source:
            return None
        stamp_ns = nanoseconds(stamp)
        key = source, asker
        asked, self._asked[key] = self._asked.get(key, stamp_ns), stamp_ns
        try:
            return self._buffer.lookup_transform(target, source, Time.from_msg(stamp))
        except ExtrapolationException:
            if stamp_ns < asked:
                # Time was set back, and tf2 ignores transforms much older than its latest.
                self.clear()
            raise PoseNotYet(f'/tf does not say where {source} was in {target} at the stamp of '
                             'its image, even when the next image came; synchronise the clocks, '
                             'and send the transforms at least as often as the images') from None
        except TransformException:
            return None

    def clear(self) -> None:
        """Forget all poses that are not static, because time was set back."""
        if self._buffer is not None:
            self._buffer.clear()


class PoseParameters:
    """
    The parameters `extrinsics.<camera>` of a node: seven numbers x y z qx qy qz qw, or none.

    They may change while the node runs; anything that is no pose is rejected.
    """

    def __init__(self, node: Node) -> None:
        """Check those that are declared later."""
        self._node = node
        node.add_on_set_parameters_callback(self._on_set)

    def declare(self, name: str) -> None:
        """Declare the parameter of a camera; HoocError if its value is no pose."""
        key = f'extrinsics.{name}'
        if not self._node.has_parameter(key):
            self._node.declare_parameter(key, [], ParameterDescriptor(
                dynamic_typing=True, description=f'Pose of the optical frame of {name} in the '
                'target frame: x y z qx qy qz qw; empty takes topics or tf. [m]'))
        pose_numbers(key, self._node.get_parameter(key).value)

    def __getitem__(self, name: str) -> tuple[float, ...]:
        """Return the pose of a camera as it is now, () for none."""
        return tuple(self._node.get_parameter(f'extrinsics.{name}').value or ())

    def _on_set(self, parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            # Those that are still being declared are checked by `declare`.
            if parameter.name.startswith('extrinsics.') and (
                    self._node.has_parameter(parameter.name)):
                try:
                    pose_numbers(parameter.name, parameter.value)
                except HoocError as error:
                    return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)


def pose_numbers(key: str, value: Any) -> tuple[float, ...]:
    """Return the value of a parameter as a tuple of 0 or 7 floats; HoocError for no pose."""
    try:
        # An empty list in a file, as `ros2 param dump` writes it, arrives as None.
        pose = tuple(float(x) for x in (() if value is None else value))
    except (TypeError, ValueError):
        raise HoocError(f'parameter {key} is {value!r}; give x y z qx qy qz qw') from None
    if len(pose) not in (0, 7):
        raise HoocError(f'parameter {key} has {len(pose)} numbers; give x y z qx qy qz qw')
    if pose and not is_rigid(np.array(pose[:3]), np.array(pose[3:])):
        raise HoocError(f'parameter {key} is no pose; give x y z qx qy qz qw, finite and the '
                        'quaternion of norm 1')
    return pose
