# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The fused field over the table: what hypotheses are scored against."""

from dataclasses import dataclass

from hooc_perception.core.frame.kernels import field as kernel
from hooc_perception.core.geometry import back_project, inverse
import numpy as np


@dataclass(frozen=True)
class Cloud:
    """
    The foreground of all views as one thinned cloud.

    :ivar points: (n, 3) float64 world, metres; one a voxel.
    :ivar normals: (n, 3) float64 unit, towards a camera that saw the point.
    :ivar p: (n, N + 1) float32 class probabilities averaged over the voxel.
    :ivar row: one (H, W) int32 a view: the row of the cloud that a pixel fell into, -1 none.
    :ivar view_normals: one (H, W, 3) float32 a view, the pixel's own normal, NaN = none.
    """

    points: np.ndarray
    normals: np.ndarray
    p: np.ndarray
    row: tuple
    view_normals: tuple


@dataclass(frozen=True)
class Field:
    """
    A voxel grid of what is known about the nearest surface.

    Channels: distance 0, free evidence 1, normal 2-4, signed distance to its plane 5; see
    kernels/field.py.

    :ivar data: (X, Y, Z, 8) uint8.
    :ivar origin: (3,) float64 world corner of voxel (0, 0, 0), metres.
    :ivar voxel: side of a voxel, metres.
    :ivar truncation: distance that channel 0 = 255 stands for, metres.
    """

    data: np.ndarray
    origin: np.ndarray
    voxel: float
    truncation: float


def fuse_cloud(observation, probabilities, voxel_m=0.004):
    """Return the Cloud of an Observation's foreground with the classifier's opinion."""
    points, normals, p, used, view_normals = [], [], [], [], []
    for index, view in enumerate(observation.views):
        xyz = back_project(view.depth, view.camera)
        n = kernel.normals_of_view(xyz, view.foreground, view.camera.T_world_camera[:3, 3],
                                   3, 0.025)
        use = view.foreground & np.isfinite(n[..., 0])
        used.append(use)
        view_normals.append(n)
        points.append(xyz[use])
        normals.append(n[use].astype(np.float64))
        rows = probabilities.camera == index
        dense = np.zeros((*view.depth.shape, probabilities.p.shape[1]), np.float32)
        uv = probabilities.uv[rows]
        dense[uv[:, 1], uv[:, 0]] = probabilities.p[rows].astype(np.float32) / 255
        p.append(dense[use])
    points, normals, p = (np.concatenate(x) for x in (points, normals, p))
    row = [np.full(use.shape, -1, np.int32) for use in used]
    if not len(points):
        return Cloud(points, normals, p, tuple(row), tuple(view_normals))
    key = np.floor((points - points.min(0)) / voxel_m).astype(np.int64)
    key = (key[:, 0] * 100003 + key[:, 1]) * 100003 + key[:, 2]
    # Opposite sides of a sheet must not average to nothing: split a voxel by facing.
    key = key * 8 + (normals > 0) @ np.array([1, 2, 4])
    _, inverse_index, count = np.unique(key, return_inverse=True, return_counts=True)
    first = np.cumsum([0] + [int(use.sum()) for use in used])
    for k, use in enumerate(used):
        row[k][use] = inverse_index[first[k]:first[k + 1]]
    order = np.argsort(inverse_index, kind='stable')
    starts = np.concatenate([[0], np.cumsum(count)[:-1]])

    def mean(x):
        return np.add.reduceat(x[order], starts, axis=0) / count[:, None]

    normals = mean(normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return Cloud(mean(points), normals, mean(p).astype(np.float32), tuple(row),
                 tuple(view_normals))


def build_field(observation, cloud, voxel_m=0.005, truncation_m=0.02, margin_m=0.012,
                full_m=0.02, border_m=0.06):
    """
    Return the Field around a cloud.

    :param margin_m: a voxel counts as seen through from this far in front of the reading on.
    :param full_m: and with full weight this much farther.
    """
    lo = np.append(cloud.points[:, :2].min(0) - border_m, -0.02)
    hi = cloud.points.max(0) + border_m
    shape = np.ceil((hi - lo) / voxel_m).astype(int)
    data = np.zeros((*shape, kernel.CHANNELS), np.uint8)
    data[..., 0] = 255
    kernel.fill_distance(data, lo, voxel_m, cloud.points, cloud.normals, truncation_m)
    for view in observation.views:
        T = inverse(view.camera.T_world_camera)
        kernel.fill_free(data, lo, voxel_m, view.depth, np.ascontiguousarray(T[:3, :3]),
                         np.ascontiguousarray(T[:3, 3]), view.camera.K, margin_m, full_m)
    return Field(data, lo, voxel_m, truncation_m)
