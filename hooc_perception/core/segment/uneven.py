# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Depth distortion: how far from flat a sensor measures a flat table.

Time-of-flight and structured-light cameras bend a plane by a few millimetres, smoothly over
the image and differently in every unit (lens, multiple paths, cyclic errors): as much as a
fork is high. Relative to the table as it is measured nearby, the fork stands out again.
"""

from hooc_perception.core.arrays import BoolArray, Float64Array
import numpy as np
from scipy.ndimage import uniform_filter

LEAST_SHARE = 0.1


def uneven_table(height: Float64Array, table: BoolArray, window: float,
                 rounds: int = 3) -> tuple[Float64Array, float]:
    """
    Return the measured height of the table around every pixel, and the noise that is left.

    :param height: (H, W) metres above the plane, NaN = none.
    :param table: (H, W) bool, pixels that may be table; low objects among them are trimmed.
    :param window: pixels, the width of the neighbourhood of a pixel.
    :return: (H, W) float64 metres, 0 (the plane) where little table is near; standard
        deviation of the heights from it in metres, infinite if there is no table.
    """
    # A distortion that is smooth over a dozen pixels is captured by every second one as well.
    step = 2 if window > 12 else 1
    h = height[::step, ::step].astype(np.float32)
    table = table[::step, ::step]
    width = int(window / step) | 1
    base, use, sigma = np.zeros(h.shape, np.float32), table, np.inf
    if width < 3 or not table.any():
        return np.zeros(height.shape), sigma
    z = np.where(table, h, np.float32(0))
    for _ in range(rounds):
        share = uniform_filter(use.astype(np.float32), width, mode='constant')
        mean = uniform_filter(np.where(use, z, np.float32(0)), width, mode='constant')
        base = mean / np.maximum(share, LEAST_SHARE)
        off = np.abs(z - base)
        sigma = 1.4826 * float(np.median(off[use]))
        use = table & (off <= 2.5 * sigma)
    full = base.repeat(step, 0).repeat(step, 1)[:height.shape[0], :height.shape[1]]
    return full.astype(np.float64), sigma
