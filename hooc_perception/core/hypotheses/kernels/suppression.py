# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Non-maximum suppression: leave out hypotheses that nearly equal better ones."""

from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.core.kernels.pose import QW, QX, QY, QZ, SX, SY, SZ, TX, TY, TZ
import numba as nb
import numpy as np

# Near duplicates: |cosine of half the angle between them|, and log ratio of their scales.
SAME_ROTATION = 0.92
SAME_LOG_SCALE = 0.22


@nb.njit(cache=True, inline='always')
def _near_duplicates(a: Float64Array, b: Float64Array, reach: float) -> bool:
    """Return whether two hypotheses (10,) about agree in place, rotation and scale."""
    distance2 = (a[TX] - b[TX]) ** 2 + (a[TY] - b[TY]) ** 2 + (a[TZ] - b[TZ]) ** 2
    if distance2 >= reach * reach:
        return False
    # A quaternion and its negative are the same rotation.
    cosine = abs(a[QX] * b[QX] + a[QY] * b[QY] + a[QZ] * b[QZ] + a[QW] * b[QW])
    stretch = max(abs(np.log(a[SX] / b[SX])), abs(np.log(a[SY] / b[SY])),
                  abs(np.log(a[SZ] / b[SZ])))
    return cosine > SAME_ROTATION and stretch < SAME_LOG_SCALE


@nb.njit(cache=True, error_model='numpy')
def suppress_near_duplicates(H: Float64Array, reach: float, most: int) -> Int64Array:
    """
    Return (k,) int64, the first `most` rows of H that are no near duplicates of one before.

    :param H: (m, 10) float64 hypotheses, best first.
    :param reach: near duplicates are less than this far apart, metres.
    """
    kept = np.empty(min(most, H.shape[0]), np.int64)
    n = 0
    for i in range(H.shape[0]):
        if n >= most:
            break
        duplicate = False
        for k in range(n):
            if _near_duplicates(H[i], H[kept[k]], reach):
                duplicate = True
                break
        if not duplicate:
            kept[n] = i
            n += 1
    return kept[:n]
