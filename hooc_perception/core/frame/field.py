# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The fused cloud and the voxel field that hypotheses are scored in."""

from dataclasses import dataclass

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array, Int64Array
from hooc_perception.core.frame.kernels import field as kernel
from hooc_perception.core.frame.kernels.records import Field
from hooc_perception.core.geometry import back_project, inverse
from hooc_perception.core.types import Observation, PixelProbabilities
import numba as nb
import numpy as np

# Pixels to each side, and distance in space, of the points that a normal is fitted to.
NORMAL_RADIUS_PX, NORMAL_GATE_M = 3, 0.025


@dataclass(frozen=True)
class Cloud:
    """
    The foreground of all views as one thinned cloud.

    :ivar points: (n, 3) float64 world, metres; one per voxel and octant of facing.
    :ivar normals: (n, 3) float64 unit, towards a camera that saw the point.
    :ivar p: (n, N + 1) float32 class probabilities averaged over the voxel.
    :ivar row: one (H, W) int32 per view: the row of the cloud that a pixel fell into, -1 = none.
    :ivar view_normals: one (H, W, 3) float32 per view, the pixel's own normal, NaN = none.
    """

    points: Float64Array
    normals: Float64Array
    p: Float32Array
    row: tuple[Int32Array, ...]
    view_normals: tuple[Float32Array, ...]


def fuse_cloud(observation: Observation, probabilities: PixelProbabilities,
               voxel_m: float = 0.004) -> Cloud:
    """
    Return the Cloud of an Observation's foreground with the classifier's probabilities.

    :param voxel_m: pixels of all views within a voxel of this side, metres, are averaged.
    """
    points, normals, p, used, view_normals = [], [], [], [], []
    for index, view in enumerate(observation.views):
        xyz = back_project(view.depth, view.camera)
        n = kernel.normals_of_view(xyz, view.foreground, view.camera.T_world_camera[:3, 3],
                                   NORMAL_RADIUS_PX, NORMAL_GATE_M)
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
    voxel_of, count = _voxels(points, normals, voxel_m)
    first = np.cumsum([0] + [int(use.sum()) for use in used])
    for k, use in enumerate(used):
        row[k][use] = voxel_of[first[k]:first[k + 1]]
    order = np.argsort(voxel_of, kind='stable')
    starts = np.concatenate([[0], np.cumsum(count)[:-1]])

    def mean(x: Float64Array | Float32Array) -> Float64Array:
        return np.add.reduceat(x[order], starts, axis=0) / count[:, None]

    normals = mean(normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return Cloud(mean(points), normals, mean(p).astype(np.float32), tuple(row),
                 tuple(view_normals))


def _voxels(points: Float64Array, normals: Float64Array, voxel_m: float,
            ) -> tuple[Int64Array, Int64Array]:
    """Return (n,) int64, the voxel of each point, numbered through, and the points of each."""
    key = np.floor((points - points.min(0)) / voxel_m).astype(np.int64)
    key = (key[:, 0] * 100003 + key[:, 1]) * 100003 + key[:, 2]
    # Opposite sides of a sheet must not cancel out: split a voxel by the octant of the normal.
    key = key * 8 + (normals > 0) @ np.array([1, 2, 4])
    _, voxel_of, count = np.unique(key, return_inverse=True, return_counts=True)
    return voxel_of, count


def build_field(observation: Observation, cloud: Cloud, voxel_m: float = 0.005,
                truncation_m: float = 0.02, margin_m: float = 0.012, full_m: float = 0.02,
                border_m: float = 0.06) -> Field:
    """
    Return the Field around a cloud.

    :param margin_m: a voxel counts as free space from this far in front of the reading on.
    :param full_m: and with full weight this much farther.
    :param border_m: how far the field reaches beyond the cloud.
    """
    lo = np.append(cloud.points[:, :2].min(0) - border_m, -0.02)
    hi = cloud.points.max(0) + border_m
    shape = np.ceil((hi - lo) / voxel_m).astype(int)
    data = np.zeros((*shape, kernel.CHANNELS), np.uint8)
    field = Field(data, lo, voxel_m, truncation_m)
    kernel.fill_distance(field, cloud.points, cloud.normals, nb.get_num_threads())
    for view in observation.views:
        T = inverse(view.camera.T_world_camera)
        kernel.fill_free(field, view.depth, np.ascontiguousarray(T[:3, :3]),
                         np.ascontiguousarray(T[:3, 3]), view.camera.K, margin_m, full_m)
    return field
