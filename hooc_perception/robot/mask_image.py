# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Mask images: pixels of a camera that always show the robot or something else to leave out."""

from pathlib import Path

from hooc_perception.core.arrays import BoolArray
from hooc_perception.io.scenes.png import read_png


def read_mask(path: str | Path, width: int, height: int) -> BoolArray:
    """
    Return the (height, width) bool mask of an 8-bit grey PNG: True where it is not black.

    :param width, height: of the raw image of the camera, pixels.
    :raises HoocError: if the file is missing, damaged or of another kind or size.
    """
    return read_png(path, width, height, 8) > 0
