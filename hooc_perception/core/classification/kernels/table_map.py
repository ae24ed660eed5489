# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Orthographic map of the table: heights of all readings over each cell, and its interpolation."""

from hooc_perception.core.arrays import BoolArray, Float32Array, Float64Array
from hooc_perception.core.classification.kernels.projective_field import DepthImages
import numba as nb
import numpy as np

# Of all readings over a cell: mean and largest height, count; of the foreground alone: smallest
# and largest height, count.
MEAN, HIGHEST, FRONT_LOWEST, FRONT_HIGHEST, COUNT, FRONT_COUNT, HEIGHT_LAYERS = range(7)
# What a layer of heights holds where there is no reading, and which readings count, metres.
EMPTY_M = -0.02
LOWEST_M, HIGHEST_M = -0.03, 0.5


@nb.njit(cache=True)
def heights(images: DepthImages, foreground: BoolArray, origin: Float64Array, cell: float,
            shape: tuple[int, int]) -> Float32Array:
    """
    Return (HEIGHT_LAYERS, nx, ny) float32 layers of heights in metres and of counts.

    :param foreground: (V, H, W), padded as the images are.
    :param origin: centre of cell (0, 0); its first two coordinates count. `cell` metres.
    """
    nx, ny = shape
    out = np.zeros((HEIGHT_LAYERS, nx, ny), np.float32)
    out[HIGHEST] = out[FRONT_HIGHEST] = EMPTY_M
    out[FRONT_LOWEST] = np.inf
    for v in range(images.depth.shape[0]):
        K, T = images.K[v], images.T_camera_world[v]
        R, t = T[:3, :3], T[:3, 3]
        for row in range(images.heights[v]):
            for col in range(images.widths[v]):
                d = images.depth[v, row, col]
                if not d > 0:
                    continue
                a = (col - K[0, 2]) / K[0, 0] * d - t[0]
                b = (row - K[1, 2]) / K[1, 1] * d - t[1]
                c = d - t[2]
                z = R[0, 2] * a + R[1, 2] * b + R[2, 2] * c
                if z <= LOWEST_M or z >= HIGHEST_M:
                    continue
                x, y = (R[0, 0] * a + R[1, 0] * b + R[2, 0] * c,
                        R[0, 1] * a + R[1, 1] * b + R[2, 1] * c)
                i = int(np.floor((x - origin[0]) / cell + 0.5))
                j = int(np.floor((y - origin[1]) / cell + 0.5))
                if 0 <= i < nx and 0 <= j < ny:
                    out[MEAN, i, j] += z
                    out[COUNT, i, j] += 1
                    out[HIGHEST, i, j] = max(out[HIGHEST, i, j], z)
                    if foreground[v, row, col]:
                        out[FRONT_COUNT, i, j] += 1
                        out[FRONT_LOWEST, i, j] = min(out[FRONT_LOWEST, i, j], z)
                        out[FRONT_HIGHEST, i, j] = max(out[FRONT_HIGHEST, i, j], z)
    for i in range(nx):
        for j in range(ny):
            n = out[COUNT, i, j]
            out[MEAN, i, j] = out[MEAN, i, j] / n if n else EMPTY_M
            if not out[FRONT_COUNT, i, j]:
                out[FRONT_LOWEST, i, j] = EMPTY_M
    return out


@nb.njit(cache=True, parallel=True)
def sample(layers: Float32Array, places: Float64Array, out: Float32Array) -> None:
    """
    Write the bilinear interpolation of `layers` (C, nx, ny) at `places` into `out` (n, C).

    :param places: (n, 2) float64 coordinates in cells, the centre of cell (0, 0) at 0; places
        beyond the map take its border.
    """
    count, nx, ny = layers.shape
    for k in nb.prange(len(places)):
        x = min(max(places[k, 0], 0.0), nx - 1.0)
        y = min(max(places[k, 1], 0.0), ny - 1.0)
        i, j = min(int(x), nx - 2), min(int(y), ny - 2)
        a, b = x - i, y - j
        for c in range(count):
            near = layers[c, i, j] * (1 - b) + layers[c, i, j + 1] * b
            far = layers[c, i + 1, j] * (1 - b) + layers[c, i + 1, j + 1] * b
            out[k, c] = near * (1 - a) + far * a


@nb.njit(cache=True, parallel=True)
def dense(x: Float32Array, weight: Float32Array, bias: Float32Array) -> Float32Array:
    """
    Return (n, m) float32 x @ weight + bias of x (n, k), weight (k, m) and bias (m,).

    Libraries of linear algebra give other last bits on other numbers of threads.
    """
    out = np.empty((len(x), weight.shape[1]), np.float32)
    for r in nb.prange(len(x)):
        row = out[r]
        row[:] = bias
        for k in range(x.shape[1]):
            value = x[r, k]
            if value != 0:
                for j in range(len(row)):
                    row[j] += value * weight[k, j]
    return out
