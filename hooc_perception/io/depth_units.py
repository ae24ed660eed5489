# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Detect depth images in another unit than their encoding promises."""

from hooc_perception.core.arrays import Float32Array
from hooc_perception.io.depth_encodings import METRES
import numpy as np

# No depth camera measures nearer than this; readings that do are in another unit.
NEAREST_M = 0.05
# Median of an image that its encoding says is in metres but that is in millimetres.
MILLIMETRES_BEYOND_M = 100
# 16-bit counts of the largest value are 65.535 m: a median of this much is saturation.
SATURATED_M = 65
# Least share of readings that lie within the range of interest in a plausible image.
MIN_SHARE_IN_RANGE = 0.02


def depth_unit_error(depth: Float32Array, encoding: str, max_depth_m: float) -> str | None:
    """
    Return what is wrong with the unit of a depth image in words, None if it is plausible.

    :param depth: (H, W) float32 metres, NaN = none, as decoded.
    :param encoding: of the message, which promises a unit.
    :param max_depth_m: farther readings are not used.
    """
    readings = depth[::4, ::4]
    readings = readings[np.isfinite(readings)]
    if not len(readings):
        return None
    median = float(np.median(readings))
    if (readings <= max_depth_m).mean() < MIN_SHARE_IN_RANGE:
        seems = _unit_beyond_range(median, encoding)
        return (f'its readings lie {median:.3g} m away, beyond {max_depth_m:g} m (observe.'
                f'max_depth_m)' + (f', so {encoding} seems to hold {seems}' if seems else '')
                + '; publish 16UC1 in millimetres or 32FC1 in metres')
    if median < NEAREST_M:
        seems = 'metres or centimetres' if encoding != METRES else 'kilometres'
        return (f'its readings lie {1000 * median:.3g} mm away, so {encoding} seems to hold '
                f'{seems}; publish 16UC1 in millimetres or 32FC1 in metres')
    return None


def _unit_beyond_range(median: float, encoding: str) -> str | None:
    """Return what an image whose readings are all too far away seems to contain, if known."""
    if encoding == METRES:
        return 'millimetres' if median > MILLIMETRES_BEYOND_M else None
    return 'a finer unit than millimetres' if median < SATURATED_M else 'saturated readings'
