# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes that failed, beside others that succeeded."""

from collections.abc import Mapping
import sys

from hooc_perception.errors import HoocError


def tell_failures(failures: Mapping[str, HoocError]) -> int:
    """
    Print every failed scene on standard error; return the exit code.

    :param failures: {scene: HoocError}.
    """
    for scene, error in failures.items():
        text = str(error).removeprefix(f'{scene}: ')
        print(f'hooc: scene {scene}: {text}', file=sys.stderr)
    return int(bool(failures))
