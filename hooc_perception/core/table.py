# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
How far from flat a sensor sees a flat table.

Time-of-flight and structured-light cameras bend a plane by a few millimetres, smoothly over
the image and differently in every unit (lens, multiple paths, cyclic errors): as much as a
fork is high. Against the table as it is seen nearby, the fork stands out again.
"""

import numpy as np
from scipy.ndimage import uniform_filter

LEAST_SHARE = 0.1


def uneven_table(height, table, window, rounds=3):
    """
    Return the table's seen height around every pixel, and the noise that is left.

    :param height: (H, W) metres over the plane, NaN = none.
    :param table: (H, W) bool, pixels that may be table; low objects among them are trimmed.
    :param window: pixels, the width of the neighbourhood of a pixel.
    :return: (H, W) float64 metres, 0 (the plane) where little table is near; standard
        deviation of the heights from it, metres.
    """
    window = int(window) | 1
    base, use, sigma = np.zeros(height.shape), table, np.inf
    if window < 3 or not table.any():
        return base, sigma
    z = np.where(table, height, 0.0)
    for _ in range(rounds):
        share = uniform_filter(use.astype(np.float64), window, mode='constant')
        mean = uniform_filter(np.where(use, z, 0.0), window, mode='constant')
        base = mean / np.maximum(share, LEAST_SHARE)
        off = np.abs(z - base)
        sigma = 1.4826 * float(np.median(off[use]))
        use = table & (off <= 2.5 * sigma)
    return base, sigma
