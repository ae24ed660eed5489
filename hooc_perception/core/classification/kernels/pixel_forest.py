# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Depth-difference tests in all views around one 3D point: the `paper` forest's features."""

import numba as nb
import numpy as np

BLOCK = 16


@nb.njit(cache=True, nogil=True)
def centres(points, K, T_camera_world):
    """
    Return (n, V, 3) float32 rows (u, v, pixels per metre) of world points in every view.

    A point behind a camera gets u = -1e6, outside of every image.
    """
    out = np.empty((points.shape[0], K.shape[0], 3), np.float32)
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for k in range(K.shape[0]):
            T = T_camera_world[k]
            zc = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
            if zc < 0.05:
                out[i, k, 0], out[i, k, 1], out[i, k, 2] = -1e6, -1e6, 1.0
                continue
            xc = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]
            yc = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]
            out[i, k, 0] = K[k, 0, 0] * xc / zc + K[k, 0, 2]
            out[i, k, 1] = K[k, 1, 1] * yc / zc + K[k, 1, 2]
            out[i, k, 2] = K[k, 0, 0] / zc
    return out


@nb.njit(cache=True, nogil=True, inline='always')
def _depth_at(image, u, v, far):
    """Return the depth (mm) at the pixel nearest to (u, v), `far` outside of the image."""
    c, r = int(np.floor(u + 0.5)), int(np.floor(v + 0.5))
    if c < 0 or r < 0 or r >= image.shape[0] or c >= image.shape[1]:
        return far
    return int(image[r, c])


@nb.njit(cache=True, nogil=True)
def respond(image, centre, du1, dv1, du2, dv2, far):
    """
    Return the difference in mm of the depths at two offsets (metres) from a centre.

    :param image: (H, W) uint16 millimetres; :param centre: (3,) u, v, pixels per metre.
    """
    s = centre[2]
    return (_depth_at(image, centre[0] + s * du1, centre[1] + s * dv1, far)
            - _depth_at(image, centre[0] + s * du2, centre[1] + s * dv2, far))


@nb.njit(cache=True, nogil=True)
def walk_pixels(images, scene, centre, test_view, offsets, feature, threshold, left, root, far,
                out):
    """
    Fill (n,) int32 with the leaf of each pixel.

    :param images: (S, V, H, W) uint16 mm; scene (n,) index into S.
    :param centre: (n, V, 3) from `centres`.
    :param test_view: (k,) uint8 and offsets (k, 4) float32 of the tests; an inner node's
        `feature` is the row of its test, -1 marks a leaf; a pixel goes left where the
        response <= threshold.
    """
    node = np.empty(BLOCK, np.int32)
    for start in range(0, centre.shape[0], BLOCK):
        n = min(BLOCK, centre.shape[0] - start)
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
                    v, p = test_view[f], start + i
                    r = respond(images[scene[p], v], centre[p, v], offsets[f, 0], offsets[f, 1],
                                offsets[f, 2], offsets[f, 3], far)
                    node[i] = left[k] if r <= threshold[k] else left[k] + 1
        for i in range(n):
            out[start + i] = node[i]


@nb.njit(cache=True, parallel=True)
def predict_pixels(images, scene, centre, test_view, offsets, feature, threshold, left, roots,
                   far, leaf, leaf_p):
    """Return (n, C) float32, the mean leaf distribution of each pixel over all trees."""
    n, n_classes = centre.shape[0], leaf_p.shape[1]
    out = np.zeros((n, n_classes), np.float32)
    chunk = 512
    for b in nb.prange((n + chunk - 1) // chunk):
        lo, hi = b * chunk, min(n, (b + 1) * chunk)
        end = np.empty(hi - lo, np.int32)
        for t in range(roots.shape[0]):
            walk_pixels(images, scene[lo:hi], centre[lo:hi], test_view, offsets, feature,
                        threshold, left, roots[t], far, end)
            for i in range(hi - lo):
                row = leaf_p[leaf[end[i]]]
                for c in range(n_classes):
                    out[lo + i, c] += row[c]
        for i in range(lo, hi):
            total = np.float32(0.0)
            for c in range(n_classes):
                total += out[i, c]
            for c in range(n_classes):
                out[i, c] /= total
    return out
