# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Import message packages that only some ROS installations have."""

import importlib
from typing import Any

from hooc_perception.errors import HoocError

SWITCH = ('auto', 'on', 'off')


def is_on(switch: str, package: str) -> bool:
    """
    Return whether an output in the messages of a package is wanted.

    :param switch: one of SWITCH; auto = where the package can be imported.
    """
    if switch != 'auto':
        return switch == 'on'
    try:
        importlib.import_module(f'{package}.msg')
    except ImportError:
        return False
    return True


def messages_of(package: str, parameter: str) -> Any:
    """
    Return the module `package`.msg.

    :param parameter: the parameter that requires it, for the error message.
    :raises HoocError: if it is not installed.
    """
    try:
        return importlib.import_module(f'{package}.msg')
    except ImportError as error:
        raise HoocError(f'parameter {parameter} needs the package {package}, which is not '
                        f'installed ({error}); install ros-jazzy-{package.replace("_", "-")} '
                        f'or set {parameter} to off') from error
