# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Core Config dataclasses as ROS parameters: declared once, in the dataclass.

A field `f` of section `parse` becomes the parameter `parse.f`; a node's own fields have no
prefix. Values that a Config rejects are rejected with its sentence as the reason.
"""

from collections.abc import Callable, Mapping
from dataclasses import Field, field
import sys
from typing import Any, TypeVar

from hooc_perception.core.config import Config, param
from hooc_perception.errors import HoocError
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rcl_interfaces.msg import (
    Parameter as ParameterMessage,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

_INT64 = 2 ** 63 - 1
C = TypeVar('C', bound=Config)


def fixed_param(*args: Any, **kwargs: Any) -> Any:
    """Declare a parameter that never changes after the node has started; as `param`."""
    declared = param(*args, **kwargs)
    return field(default=declared.default, metadata={**declared.metadata, 'read_only': True})


def descriptor(f: Field) -> ParameterDescriptor:
    """Return the ParameterDescriptor of a Config field: meaning, unit, range, read-only."""
    m = f.metadata
    message = ParameterDescriptor(description=m['doc'] + (f' [{m["unit"]}]' if m['unit'] else ''))
    message.read_only = m.get('read_only', False)
    # An empty list has no type for rclpy to infer. YAML reads a bare `on` or `off` as a Boolean.
    message.dynamic_typing = isinstance(f.default, tuple) or _is_switch(f)
    low, high = m['low'], m['high']
    if low is not None or high is not None:
        if isinstance(f.default, int):
            message.integer_range = [IntegerRange(
                from_value=-_INT64 if low is None else int(low),
                to_value=_INT64 if high is None else int(high))]
        else:
            message.floating_point_range = [FloatingPointRange(
                from_value=-sys.float_info.max if low is None else float(low),
                to_value=sys.float_info.max if high is None else float(high))]
    if m['choices']:
        message.additional_constraints = 'one of: ' + ', '.join(map(repr, m['choices']))
    if not m['runtime']:
        note = 'may change only while the node is unconfigured'
        message.additional_constraints = '; '.join(
            filter(None, [message.additional_constraints, note]))
    return message


class Parameters:
    """
    The declared parameters of a node and the Config objects that they amount to.

    :ivar configs: {section: Config}, always consistent with the node's parameters.
    """

    def __init__(self, node: Node, is_unconfigured: Callable[[], bool]) -> None:
        """
        Attach to a node.

        :param is_unconfigured: whether start-up parameters may still change.
        """
        self._node, self._is_unconfigured = node, is_unconfigured
        self.configs: dict[str, Config] = {}
        node.add_on_set_parameters_callback(self._on_set)

    def declare(self, section: str, config: C) -> C:
        """
        Declare every field of a Config, with the values of `config` as defaults.

        :return: the Config with the overrides of YAML files and the command line.
        :raises HoocError: if such an override is rejected, naming the parameter.
        """
        values = {}
        defaults = config.values()
        for f in config.parameters().values():
            name = f'{section}.{f.name}' if section else f.name
            default = defaults[f.name]
            default = list(default) if isinstance(default, tuple) else default
            try:
                value = self._node.declare_parameter(name, default, descriptor(f)).value
            except Exception as error:      # rclpy raises several unrelated types here
                raise HoocError(f'parameter {name} of {self._node.get_name()} cannot be used: '
                                f'{error}') from error
            values[f.name] = _from_ros(value, f)
        declared = self.configs[section] = _checked(section, config, values)
        return declared

    def __getitem__(self, section: str) -> Config:
        """Return the Config of a section, as it is now."""
        return self.configs[section]

    def get(self, section: str, kind: type[C]) -> C:
        """Return the Config of a section, as it is now, which is known to be of a class."""
        config = self.configs[section]
        assert isinstance(config, kind)
        return config

    def _on_set(self, parameters: list[Parameter]) -> SetParametersResult:
        """Accept the changes that the Configs accept; give the reason otherwise."""
        changed = dict(self.configs)
        for parameter in parameters:
            section, _, name = parameter.name.rpartition('.')
            # Unknown here: still being declared, or not one of ours (use_sim_time, QoS).
            if section not in changed or name not in changed[section].parameters():
                continue
            f = changed[section].parameters()[name]
            if not f.metadata['runtime'] and not self._is_unconfigured():
                return SetParametersResult(successful=False, reason=(
                    f'{parameter.name} shapes what the node has already built: deactivate and '
                    f'clean up {self._node.get_name()} first, then set it and configure again'))
            try:
                changed[section] = _checked(section, changed[section],
                                            {name: _from_ros(parameter.value, f)})
            except HoocError as error:
                return SetParametersResult(successful=False, reason=str(error))
        self.configs = changed
        return SetParametersResult(successful=True)


def _from_ros(value: Any, f: Field) -> Any:
    """
    Return a parameter's value as the type of its field; the Config judges the rest.

    An empty list in a file, as `ros2 param dump` writes it, arrives as None.
    """
    if value is None and isinstance(f.default, tuple):
        return ()
    if isinstance(value, bool) and _is_switch(f):
        return switch_text(value)
    listed: Any = value
    is_list = isinstance(f.default, tuple) and not isinstance(value, (str, bytes))
    return tuple(listed) if is_list and hasattr(value, '__iter__') else value


def _is_switch(f: Field) -> bool:
    """Return whether a parameter is text that may be `off`."""
    return 'off' in (f.metadata['choices'] or ())


def switch_text(value: Any) -> Any:
    """Return `on` or `off` for a Boolean, anything else as it is."""
    return {True: 'on', False: 'off'}[value] if isinstance(value, bool) else value


def _checked(section: str, config: C, values: Mapping[str, Any]) -> C:
    """Return `config` with `values`; its error names the section as well."""
    try:
        return config.changed(values)
    except HoocError as error:
        text = str(error)
        raise HoocError(text.replace('parameter ', f'parameter {section}.', 1)
                        if section else text) from error


def parameter_message(name: str, value: Any) -> ParameterMessage:
    """Return the rcl_interfaces/Parameter of a name and a Python value; () is a text list."""
    kind = Parameter.Type.STRING_ARRAY if value in ((), []) else None
    value = list(value) if isinstance(value, tuple) else value
    return (Parameter(name, kind, value) if kind else Parameter(name, value=value)
            ).to_parameter_msg()
