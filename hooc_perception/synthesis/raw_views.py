# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Raw, still distorted depth images of posed meshes: one ray per pixel, through the lens."""

from collections.abc import Sequence
from typing import Any

from hooc_perception.core.arrays import (
    AnyArray,
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
)
from hooc_perception.core.geometry import inverse, transform
from hooc_perception.core.types import Camera
import numpy as np
import open3d as o3d

# A point is visible if nothing on the ray to it is nearer by more than this.
SEEN_M = 1e-4


def undistorted_rays(camera: Camera) -> Float64Array:
    """
    Return the (H, W, 3) float64 directions, with z = 1, of a camera's raw pixels.

    Inverts the lens model of CameraInfo (plumb_bob and rational_polynomial) by fixed-point
    iteration, which converges for every lens that can be rectified.
    """
    d = np.zeros(8)
    d[:len(camera.D)] = camera.D
    u, v = np.meshgrid(np.arange(camera.width, dtype=float),
                       np.arange(camera.height, dtype=float))
    y0 = (v - camera.K[1, 2]) / camera.K[1, 1]
    x0 = (u - camera.K[0, 2] - camera.K[0, 1] * y0) / camera.K[0, 0]
    x, y = x0, y0
    for _ in range(60):
        r2 = x * x + y * y
        radial = ((1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4])))
                  / (1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]))))
        x, y = ((x0 - 2 * d[2] * x * y - d[3] * (r2 + 2 * x * x)) / radial,
                (y0 - d[2] * (r2 + 2 * y * y) - 2 * d[3] * x * y) / radial)
    return np.stack([x, y, np.ones_like(x)], axis=-1)


class Caster:
    """Casts rays into posed meshes; mesh i has id i."""

    def __init__(self, meshes: Sequence[tuple[AnyArray, AnyArray]]) -> None:
        """Take a sequence of (vertices (V, 3) world metres, faces (F, 3))."""
        self.scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        self.count = len(meshes)
        for vertices, faces in meshes:
            self.scene.add_triangles(_tensor(vertices, np.float32), _tensor(faces, np.uint32))

    def view(self, camera: Camera) -> tuple[Float32Array, Int32Array, Float32Array]:
        """
        Return (depth, ids, normals) of a raw view, noise free.

        :return: depth (H, W) float32 metres along the optical axis, inf = nothing; ids (H, W)
            int32, -1 = nothing; normals (H, W, 3) float32, camera frame, towards the camera.
        """
        along = undistorted_rays(camera)
        directions = along @ camera.T_world_camera[:3, :3].T
        origins = np.broadcast_to(camera.T_world_camera[:3, 3], directions.shape)
        hit = self.scene.cast_rays(
            _tensor(np.concatenate([origins, directions], axis=-1), np.float32))
        # Directions have z = 1 in the camera, so the ray parameter is the depth.
        depth = hit['t_hit'].numpy()
        ids = hit['geometry_ids'].numpy().astype(np.int64)
        ids[ids >= self.count] = -1
        normals = hit['primitive_normals'].numpy() @ camera.T_world_camera[:3, :3].astype(
            np.float32)
        away = np.sum(normals * along, axis=-1) > 0
        normals[away] *= -1
        return depth, ids.astype(np.int32), normals

    def seen(self, points: Float64Array, cameras: Sequence[Camera]) -> BoolArray:
        """Return (n, C) bool: which points (n, 3) each camera sees inside its image."""
        out = np.zeros((len(points), len(cameras)), bool)
        for k, camera in enumerate(cameras):
            origin = camera.T_world_camera[:3, 3]
            towards = points - origin
            distance = np.linalg.norm(towards, axis=1)
            rays = np.concatenate([np.broadcast_to(origin, points.shape),
                                   towards / distance[:, None]], axis=1)
            hit = self.scene.cast_rays(_tensor(rays, np.float32))['t_hit'].numpy()
            in_camera = transform(inverse(camera.T_world_camera), points)
            with np.errstate(divide='ignore', invalid='ignore'):
                u = in_camera[:, :2] @ camera.K[0, :2] / in_camera[:, 2] + camera.K[0, 2]
                v = camera.K[1, 1] * in_camera[:, 1] / in_camera[:, 2] + camera.K[1, 2]
            inside = ((in_camera[:, 2] > 0) & (u > -0.5) & (u < camera.width - 0.5)
                      & (v > -0.5) & (v < camera.height - 0.5))
            out[:, k] = inside & (hit > distance - SEEN_M)
        return out


def _tensor(array: AnyArray, dtype: type[np.generic]) -> Any:
    """Return an array as an Open3D tensor."""
    # The stub of open3d does not know that tensors are made of arrays.
    return o3d.core.Tensor(  # pyright: ignore[reportCallIssue]
        np.ascontiguousarray(array, dtype))
