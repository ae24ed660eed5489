# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes that came to nothing, beside others that did not."""

import sys


def tell_failures(failures):
    """
    Name every failed scene on standard error; return the exit code.

    :param failures: {scene: HoocError}.
    """
    for scene, error in failures.items():
        text = str(error).removeprefix(f'{scene}: ')
        print(f'hooc: scene {scene}: {text}', file=sys.stderr)
    return int(bool(failures))
