# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
What lies on the far side of a hypothesis's outline.

The outline of a real object is where something ends: beyond it lies the table, a surface further
away, a crease, or whatever hides the object. Where the measured surface goes on smoothly, the
hypothesis covers a part of something larger.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.core.frame.kernels.compare import ray
from hooc_perception.core.frame.kernels.pixel_lists import PixelLists
from hooc_perception.core.frame.kernels.records import Views
import numba as nb
import numpy as np

# Columns of `outlines`: shares of an outline whose far side was measured.
OPEN = 0            # the surface goes on smoothly
ENDING = 1          # the table, a crease or a surface further away
OUTLINE = 2
# A reading that lies this far off the rendered surface says nothing about its outline, metres.
AGREES_M = 0.02
# A neighbour is on the same surface up to this distance from the tangent plane, metres, and from
# this cosine between the normals on.
PLANE_M, SMOOTH_COSINE = 0.004, 0.92
# What is this much nearer to the camera hides the outline, metres.
NEARER_M = 0.01
HIDDEN = -1


class _Window(NamedTuple):
    """
    The pixels of one row of PixelLists in one view.

    :ivar covered: (h, w) bool; `column`, `row` of its first pixel.
    """

    covered: BoolArray
    column: int
    row: int


@nb.njit(cache=True, inline='always')
def _beyond(views: Views, view: int, here: tuple[int, int], there: tuple[int, int]) -> int:
    """Return OPEN, ENDING or HIDDEN for the step from one (column, row) to another."""
    width = views.size[view, 0]
    i: int = views.first[view] + here[1] * width + here[0]
    j: int = views.first[view] + there[1] * width + there[0]
    d, e, n = views.depth[i], views.depth[j], views.normals
    if not e > 0 or e < d - NEARER_M:
        return HIDDEN
    if not views.foreground[j] or n[i, 0] != n[i, 0] or n[j, 0] != n[j, 0]:
        return ENDING
    if n[i, 0] * n[j, 0] + n[i, 1] * n[j, 1] + n[i, 2] * n[j, 2] < SMOOTH_COSINE:
        return ENDING
    a, b = ray(views, view, here[0], here[1]), ray(views, view, there[0], there[1])
    off = (n[i, 0] * (b[0] * e - a[0] * d) + n[i, 1] * (b[1] * e - a[1] * d)
           + n[i, 2] * (b[2] * e - a[2] * d))
    return OPEN if abs(off) < PLANE_M else ENDING


@nb.njit(cache=True)
def _window(lists: PixelLists, start: int, stop: int, first: int, width: int) -> _Window:
    """Return the _Window of the entries start .. stop - 1, all in the view that starts there."""
    left, right = width, -1
    for e in range(start, stop):
        column = (lists.pixel[e] - first) % width
        left, right = min(left, column), max(right, column)
    top = (lists.pixel[start] - first) // width
    bottom = (lists.pixel[stop - 1] - first) // width
    covered = np.zeros((bottom - top + 1, right - left + 1), np.bool_)
    for e in range(start, stop):
        k = lists.pixel[e] - first
        covered[k // width - top, k % width - left] = True
    return _Window(covered, left, top)


@nb.njit(cache=True)
def _count_view(lists: PixelLists, start: int, stop: int, views: Views, view: int,
                out: Float64Array) -> int:
    """Add the outline in one view to `out` (OUTLINE,), and return the steps that it has."""
    width, height = views.size[view, 0], views.size[view, 1]
    window = _window(lists, start, stop, views.first[view], width)
    h, w = window.covered.shape
    steps = 0
    for e in range(start, stop):
        i: int = lists.pixel[e]
        if not abs(lists.depth[e] - views.depth[i]) < AGREES_M:
            continue
        row = (i - views.first[view]) // width
        column = (i - views.first[view]) % width
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            x, y = column + dx, row + dy
            a, b = x - window.column, y - window.row
            inside = 0 <= a < w and 0 <= b < h and window.covered[b, a]
            if inside or x < 0 or y < 0 or x >= width or y >= height:
                continue
            side = _beyond(views, view, (column, row), (x, y))
            steps += 1
            if side != HIDDEN:
                out[side] += 1
    return steps


@nb.njit(cache=True, parallel=True)
def outlines(lists: PixelLists, views: Views) -> Float64Array:
    """
    Return (m, OUTLINE) float64 shares of each row's outline, over all views.

    :param lists: PixelLists, whose pixels ascend within a row.
    """
    m = len(lists.offsets) - 1
    out = np.zeros((m, OUTLINE))
    for k in nb.prange(m):
        start, steps = lists.offsets[k], 0
        for view in range(len(views.size)):
            stop = start
            while stop < lists.offsets[k + 1] and lists.pixel[stop] < views.first[view + 1]:
                stop += 1
            if stop > start:
                steps += _count_view(lists, start, stop, views, view, out[k])
            start = stop
        out[k] /= max(steps, 1)
    return out
