# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Depth-difference tests in all views around one 3D point: the `paper` forest's features.

Basevi & Leonardis 2016, section 4, after Brachmann et al. 2014.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import (
    Float32Array,
    Float64Array,
    Int32Array,
    UInt8Array,
    UInt16Array,
)
from hooc_perception.core.classification.kernels.walk import (
    add_leaves,
    BLOCK,
    CHUNK,
    Leaves,
    Nodes,
    normalize,
)
import numba as nb
import numpy as np

NEAR_M = 0.05
# Column and row of a point behind a camera: outside of every image.
NOWHERE = -1e6


class Samples(NamedTuple):
    """
    Pixels to classify, and the images that their tests read.

    :ivar images: (S, V, H, W) uint16 mm, all views of S scenes.
    :ivar scene: (n,) int32 index into S.
    :ivar centre: (n, V, 3) float32 from `centres`.
    """

    images: UInt16Array
    scene: Int32Array
    centre: Float32Array


class DepthTests(NamedTuple):
    """
    Depth comparisons; `feature` of an inner node is the row of its test.

    :ivar in_view: (k,) uint8 view that a test reads.
    :ivar offsets: (k, 4) float32 du1 dv1 du2 dv2, metres at the point's depth.
    :ivar far: depth in mm outside of the image.
    """

    in_view: UInt8Array
    offsets: Float32Array
    far: int


@nb.njit(cache=True, nogil=True)
def centres(points: Float64Array, K: Float64Array, T_camera_world: Float64Array) -> Float32Array:
    """
    Return (n, V, 3) float32 rows (u, v, pixels per metre) of world points in every view.

    A point behind a camera gets u = v = NOWHERE.
    """
    out = np.empty((points.shape[0], K.shape[0], 3), np.float32)
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for k in range(K.shape[0]):
            T = T_camera_world[k]
            zc = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
            if zc < NEAR_M:
                out[i, k, 0], out[i, k, 1], out[i, k, 2] = NOWHERE, NOWHERE, 1.0
                continue
            xc = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]
            yc = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]
            out[i, k, 0] = K[k, 0, 0] * xc / zc + K[k, 0, 2]
            out[i, k, 1] = K[k, 1, 1] * yc / zc + K[k, 1, 2]
            out[i, k, 2] = K[k, 0, 0] / zc
    return out


@nb.njit(cache=True, nogil=True, inline='always')
def _depth_at(image: UInt16Array, u: float, v: float, far: int) -> int:
    """Return the depth (mm) at the pixel nearest to (u, v), `far` outside of the image."""
    c, r = int(np.floor(u + 0.5)), int(np.floor(v + 0.5))
    if c < 0 or r < 0 or r >= image.shape[0] or c >= image.shape[1]:
        return far
    return int(image[r, c])


@nb.njit(cache=True, nogil=True)
def respond(image: UInt16Array, centre: Float32Array, offsets: Float32Array, far: int) -> int:
    """
    Return the difference in mm of the depths at two offsets from a centre.

    :param image: (H, W) uint16 millimetres; centre (3,) u, v, pixels per metre.
    :param offsets: (4,) du1 dv1 du2 dv2, metres.
    """
    s = centre[2]
    return (_depth_at(image, centre[0] + s * offsets[0], centre[1] + s * offsets[1], far)
            - _depth_at(image, centre[0] + s * offsets[2], centre[1] + s * offsets[3], far))


@nb.njit(cache=True, nogil=True)
def walk_pixels(samples: Samples, tests: DepthTests, nodes: Nodes, root: int,
                out: Int32Array) -> None:
    """Fill out (n,) int32 with the leaf of each pixel: left where response <= threshold."""
    feature, threshold, left = nodes.feature, nodes.threshold, nodes.left
    node = np.empty(BLOCK, np.int32)
    for start in range(0, samples.centre.shape[0], BLOCK):
        n = min(BLOCK, samples.centre.shape[0] - start)
        for i in range(n):
            node[i] = root
        going = True
        while going:
            going = False
            for i in range(n):
                k = node[i]
                f = feature[k]
                if f >= 0:
                    going = True
                    v, p = tests.in_view[f], start + i
                    r = respond(samples.images[samples.scene[p], v], samples.centre[p, v],
                                tests.offsets[f], tests.far)
                    node[i] = left[k] if r <= threshold[k] else left[k] + 1
        for i in range(n):
            out[start + i] = node[i]


@nb.njit(cache=True, parallel=True)
def predict_pixels(samples: Samples, tests: DepthTests, nodes: Nodes, roots: Int32Array,
                   leaves: Leaves) -> Float32Array:
    """Return (n, C) float32, the mean leaf distribution of each pixel over all trees."""
    n = samples.centre.shape[0]
    out = np.zeros((n, leaves.p.shape[1]), np.float32)
    for b in nb.prange((n + CHUNK - 1) // CHUNK):
        lo, hi = b * CHUNK, min(n, (b + 1) * CHUNK)
        part = Samples(samples.images, samples.scene[lo:hi], samples.centre[lo:hi])
        end = np.empty(hi - lo, np.int32)
        for t in range(roots.shape[0]):
            walk_pixels(part, tests, nodes, roots[t], end)
            add_leaves(end, leaves, out[lo:hi])
        normalize(out[lo:hi])
    return out
