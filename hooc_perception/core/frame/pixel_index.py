# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The numbering of pixels over all views: view after view, row after row."""

from collections.abc import Sequence

from hooc_perception.core.arrays import Int32Array, Int64Array, UInt8Array, UInt16Array
from hooc_perception.core.types import ObservedView
import numpy as np


def first_pixels(views: Sequence[ObservedView]) -> Int64Array:
    """Return (V + 1,) int64, the first pixel of each view, then the number of all pixels."""
    return np.cumsum([0] + [view.depth.size for view in views]).astype(np.int64)


def stacked_index(views: Sequence[ObservedView], camera: UInt8Array, uv: UInt16Array,
                  ) -> Int64Array:
    """
    Return (n,) int64, the numbers of single pixels among the stacked pixels of all views.

    :param camera: (n,) view of each; `uv` (n, 2) its column and row.
    """
    widths = np.array([view.depth.shape[1] for view in views], np.int64)
    k, (u, v) = camera.astype(np.int64), uv.astype(np.int64).T
    return first_pixels(views)[k] + v * widths[k] + u


def rows_of_pixels(index: Int64Array, n_pixels: int) -> Int32Array:
    """Return (n_pixels,) int32, the row of `index` that names each stacked pixel, -1 = none."""
    rows = np.full(n_pixels, -1, np.int32)
    rows[index] = np.arange(len(index))
    return rows
