# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Detect depth images in another unit than their encoding promises."""

from hooc_perception.core.arrays import Float32Array
from hooc_perception.io.depth_encodings import METRES
import numpy as np

# No depth camera measures nearer than this; readings that do are in another unit.
NEAREST_M = 0.05
# Median depth of what cameras around a table see.
USUAL_M = (0.3, 2.0)
# 16-bit counts of the largest value are 65.535 m: a median of this much is saturation.
SATURATED_M = 65
_FIX = ('; publish 16UC1 in millimetres or 32FC1 in metres, or state depth_unit, the metres per '
        'count')
# Metres per count of drivers and converters (OrbbecSDK, librealsense, Astra, Ensenso, Photoneo).
_UNITS = ((1.0, 'metres'), (0.3048, 'feet'), (0.0254, 'inches'), (0.01, 'centimetres'),
          (0.001, 'millimetres'), (0.00025, 'quarters of a millimetre'),
          (0.0002, 'fifths of a millimetre'), (0.0001, 'tenths of a millimetre'),
          (1e-6, 'micrometres'))
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
        seems = _meant_unit(median, encoding)
        return (f'its readings lie {median:.3g} m away, beyond {max_depth_m:g} m (observe.'
                f'max_depth_m)' + (f', so {encoding} seems to hold {seems}' if seems else '')
                + _FIX)
    if median < NEAREST_M:
        seems = _meant_unit(median, encoding) or 'another unit'
        return (f'its readings lie {1000 * median:.3g} mm away, so {encoding} seems to hold '
                f'{seems}{_FIX}')
    return None


def _meant_unit(median: float, encoding: str) -> str | None:
    """
    Return the unit by which the median of a depth image becomes one of a tabletop, if any does.

    :param median: metres, as the encoding says.
    """
    if encoding != METRES and median > SATURATED_M:
        return 'saturated readings'
    said = 1.0 if encoding == METRES else 0.001
    # A step of less than a factor of two is no other unit: the scene is far away.
    fitting = [f'{name} (depth_unit {unit:g})' for unit, name in _UNITS
               if USUAL_M[0] < median * unit / said < USUAL_M[1]
               and not 0.5 <= unit / said <= 2.0]
    return ' or '.join(fitting) or None
