# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The text that users give to the launch files, as values; what cannot be meant gets one sentence.

Imports little, as `chain` does: launch files run in the Python of the ROS installation.
"""

from collections.abc import Mapping
import os
from typing import Any

from hooc_perception.errors import HoocError
import yaml

_BOOLEANS = {'true': True, '1': True, 'yes': True, 'on': True,
             'false': False, '0': False, 'no': False, 'off': False}


def whole_number(name: str, text: str) -> int:
    """Return an argument as int; HoocError if it is none."""
    try:
        return int(text)
    except ValueError:
        raise HoocError(f'argument {name} is {text!r}; give a whole number') from None


def number(name: str, text: str) -> float:
    """Return an argument as a finite float; HoocError if it is none."""
    try:
        value = float(text)
    except ValueError:
        value = float('nan')
    if value - value:
        raise HoocError(f'argument {name} is {text!r}; give a number')
    return value


def boolean(name: str, text: str) -> bool:
    """Return an argument as bool; HoocError if it is none."""
    try:
        return _BOOLEANS[text.lower()]
    except KeyError:
        raise HoocError(f'argument {name} is {text!r}; give true or false') from None


def text(name: str, given: str) -> str:
    """Return an argument as it is."""
    return given


def names(name: str, text: str) -> list[str]:
    """Return an argument as a list of names; one name may stand alone. HoocError if it is none."""
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        value = None
    listed = [value] if isinstance(value, str) else value
    if not isinstance(listed, list) or not all(isinstance(x, str) and x for x in listed):
        raise HoocError(f'argument {name} is {text!r}; give a list of names, such as '
                        f'{name}:="[left, right]"')
    return listed


def path(name: str, text: str) -> str:
    """Return an argument as an absolute path; HoocError if nothing is there."""
    full = os.path.abspath(os.path.expanduser(text))
    if not os.path.exists(full):
        raise HoocError(f'argument {name} is {text!r}: there is no such file or folder')
    return full


def given(arguments: Mapping[str, str], kinds: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return {argument: value} of those that are not empty; empty ones are up to a parameter file.

    :param arguments: {argument: text}.
    :param kinds: {argument: one of the functions above}.
    :raises HoocError: for text that its kind cannot mean.
    """
    values = {name: kind(name, arguments[name]) for name, kind in kinds.items()
              if arguments[name].strip()}
    return {name: value for name, value in values.items() if value != []}
