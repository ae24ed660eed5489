# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Two depth images compared in the mean over small windows, and readings accumulated."""

from hooc_perception.core.arrays import BoolArray, Float32Array, UInt8Array
import numba as nb
import numpy as np

# Half of the side of a window: 5 x 5 pixels.
HALF = 2


@nb.njit(cache=True, parallel=True)
def at_edges(depth: Float32Array, step: float) -> BoolArray:
    """
    Return which pixels (H, W) have a depth step within 3 x 3 pixels.

    :param depth: metres, NaN = none: a missing reading makes no step.
    :param step: least step, per metre of depth.
    """
    h, w = depth.shape
    out = np.zeros((h, w), np.bool_)
    for v in nb.prange(h):
        for u in range(w):
            low, high = np.float32(np.inf), np.float32(0)
            for y in range(max(v - 1, 0), min(v + 2, h)):
                for x in range(max(u - 1, 0), min(u + 2, w)):
                    d = depth[y, x]
                    if d == d:
                        low, high = min(low, d), max(high, d)
            out[v, u] = high - low > step * low
    return out


@nb.njit(cache=True, parallel=True)
def compare_windows(before: Float32Array, now: Float32Array, edge: BoolArray, clip: float,
                    ) -> tuple[Float32Array, Float32Array, Float32Array, Float32Array]:
    """
    Return means over the window around each pixel; beyond the image its border is repeated.

    :param before, now: (H, W) metres, NaN = none.
    :param edge: (H, W), pixels whose difference does not count.
    :param clip: a difference counts as no more than this, metres.
    :return: four (H, W): mean difference over all pixels of the window (0 where it does not
        count); shares of the window that count, that appeared and that disappeared.
    """
    h, w = before.shape
    rows = np.zeros((4, h, w), np.float32)
    for v in nb.prange(h):
        for u in range(w):
            for x in range(u - HALF, u + HALF + 1):
                c = min(max(x, 0), w - 1)
                a, b = before[v, c], now[v, c]
                if a == a and b == b:
                    if not edge[v, c]:
                        rows[0, v, u] += min(max(b - a, -clip), clip)
                        rows[1, v, u] += 1
                elif b == b:
                    rows[2, v, u] += 1
                elif a == a:
                    rows[3, v, u] += 1
    out = np.zeros((4, h, w), np.float32)
    area = (2 * HALF + 1) ** 2
    for v in nb.prange(h):
        for k in range(4):
            for u in range(w):
                total = np.float32(0)
                for y in range(v - HALF, v + HALF + 1):
                    total += rows[k, min(max(y, 0), h - 1), u]
                out[k, v, u] = total / area
    return out[0], out[1], out[2], out[3]


@nb.njit(cache=True, parallel=True)
def accumulate_pixels(depth: Float32Array, count: UInt8Array, now: Float32Array,
                      again: BoolArray, aside: BoolArray, noise: float, low: float, high: float,
                      frames: int) -> tuple[Float32Array, UInt8Array]:
    """
    Return (depth, count) after one more image.

    :param depth, now: (H, W) metres, NaN = none; count (H, W) of readings that `depth` is the
        mean of.
    :param again: (H, W), pixels that start again; `aside`, those that stay as they are.
    :param noise: readings agree within so much at 1 m; it grows with the square of the distance,
        from `low` to `high` metres.
    :param frames: most readings that count.
    """
    h, w = depth.shape
    mean, number = depth.copy(), count.copy()
    for v in nb.prange(h):
        for u in range(w):
            if aside[v, u]:
                continue
            a, b, n = depth[v, u], now[v, u], count[v, u]
            known, seen = a == a, b == b
            agree = not known and not seen
            if known and seen:
                agree = abs(b - a) <= min(max(noise * a * a, low), high)
            if again[v, u] or (not agree and n <= 1):
                mean[v, u], number[v, u] = b, 1
            elif agree:
                n = min(n + 1, frames)
                number[v, u] = n
                if known:
                    mean[v, u] = a + (b - a) / np.float32(n)
            else:
                number[v, u] = n - 1
    return mean, number
