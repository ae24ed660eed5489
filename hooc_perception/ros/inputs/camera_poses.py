# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where cameras stand, by parameters and by tf2."""

from hooc_perception.errors import HoocError
from hooc_perception.ros.messages.conversions import is_rigid, nanoseconds
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.time import Time

try:    # Not on PyPI; there on a ROS installation.
    from tf2_ros import Buffer, ExtrapolationException, TransformException, TransformListener
except ImportError:
    Buffer = None


class PoseNotYet(HoocError):
    """/tf knows where a camera is, but not at the stamp that was asked for."""


class TfPoses:
    """Camera poses from /tf and /tf_static, where tf2 is installed; else always None."""

    def __init__(self, node):
        """Listen for a StageNode until it is cleaned up."""
        self._buffer, self._asked = None, {}
        if Buffer:
            self._buffer = Buffer()
            node.owned(TransformListener.unregister, TransformListener(self._buffer, node))

    def lookup(self, target, source, stamp):
        """
        Return the TransformStamped T_target_source at a stamp, or None where none is known.

        What is static is so at every stamp; a camera on an arm was elsewhere a moment ago.

        :raises PoseNotYet: where it is known at other stamps only.
        """
        if self._buffer is None or not source:
            return None
        stamp_ns = nanoseconds(stamp)
        asked, self._asked[source] = self._asked.get(source, stamp_ns), stamp_ns
        try:
            return self._buffer.lookup_transform(target, source, Time.from_msg(stamp))
        except ExtrapolationException:
            if stamp_ns < asked:
                # Time was set back, and tf2 takes nothing in that is much older than what it has.
                self.clear()
            raise PoseNotYet(f'/tf does not say where {source} was in {target} at the stamp of '
                             'its image, even when the next image came; synchronise the clocks, '
                             'and send the transforms at least as often as the images') from None
        except TransformException:
            return None

    def clear(self):
        """Forget all poses that are not static: time was set back."""
        if self._buffer is not None:
            self._buffer.clear()


class PoseParameters:
    """
    The parameters `extrinsics.<camera>` of a node: seven numbers x y z qx qy qz qw, or none.

    They may change while the node runs; what is no pose is refused.
    """

    def __init__(self, node):
        """Watch over those that are declared later."""
        self._node = node
        node.add_on_set_parameters_callback(self._on_set)

    def declare(self, name):
        """Declare that of a camera; HoocError where it is set to what is no pose."""
        key = f'extrinsics.{name}'
        if not self._node.has_parameter(key):
            self._node.declare_parameter(key, [], ParameterDescriptor(
                dynamic_typing=True, description=f'Pose of the optical frame of {name} in the '
                'target frame: x y z qx qy qz qw; empty takes topics or tf. [m]'))
        _pose(key, self._node.get_parameter(key).value)

    def __getitem__(self, name):
        """Return the pose of a camera as it is now, () for none."""
        return tuple(self._node.get_parameter(f'extrinsics.{name}').value)

    def _on_set(self, parameters):
        for parameter in parameters:
            # Those that are still being declared are judged by `declare`.
            if parameter.name.startswith('extrinsics.') and (
                    self._node.has_parameter(parameter.name)):
                try:
                    _pose(parameter.name, parameter.value)
                except HoocError as error:
                    return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)


def _pose(key, value):
    """Return the value of a parameter as a tuple of 0 or 7 floats; HoocError for no pose."""
    try:
        pose = tuple(float(x) for x in value)
    except (TypeError, ValueError):
        raise HoocError(f'parameter {key} is {value!r}; give x y z qx qy qz qw') from None
    if len(pose) not in (0, 7):
        raise HoocError(f'parameter {key} has {len(pose)} numbers; give x y z qx qy qz qw')
    if pose and not is_rigid(pose[:3], pose[3:]):
        raise HoocError(f'parameter {key} is no pose; give x y z qx qy qz qw, finite and the '
                        'quaternion of norm 1')
    return pose
