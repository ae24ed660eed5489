# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Score shifts of points against height maps."""

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array, Int64Array
import numba as nb
import numpy as np


@nb.njit(cache=True)
def highest(cells: Int64Array, heights: Float64Array, out: Float32Array) -> None:
    """Raise the flat map `out` (NaN = unknown) to the heights (n,) that its cells show."""
    for i in range(cells.shape[0]):
        c = cells[i]
        if not out[c] >= heights[i]:
            out[c] = heights[i]


@nb.njit(cache=True, parallel=True)
def shift_scores(maps: Float32Array, scene: Int32Array, cells: Int32Array, heights: Float64Array,
                 reach: int, tolerance_m: float) -> Int32Array:
    """
    Return the score of every shift of up to `reach` cells along both axes.

    A point at the height of the map counts one, a point above the map minus one. A point below
    it may lie on the side of what the map shows and counts nothing, unless it lies on the table,
    which no object can cover: then it counts minus one.

    :param maps: (S, G, G) float32 heights, NaN = unknown, rows along y.
    :param scene: (n,) int32 which map a point is compared with; `cells` (n, 2) its cell (x, y).
    :return: (2 reach + 1, 2 reach + 1) int32, rows along y.
    """
    side = 2 * reach + 1
    size = maps.shape[1]
    scores = np.zeros((side, side), np.int32)
    for row in nb.prange(side):
        for col in range(side):
            total = 0
            for i in range(cells.shape[0]):
                x, y = cells[i, 0] + col - reach, cells[i, 1] + row - reach
                if x < 0 or y < 0 or x >= size or y >= size:
                    continue
                above = heights[i] - maps[scene[i], y, x]
                if abs(above) < tolerance_m:
                    total += 1
                elif above > 0 or (above < 0 and heights[i] < tolerance_m):
                    total -= 1
            scores[row, col] = total
    return scores
