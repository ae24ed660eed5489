# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Contests of images: rendering views and candidates, undistortion."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import cv2
from hooc_perception.benchmark.measure import Contest, Contestant
from hooc_perception.benchmark.scene import BenchScene, candidate_meshes
from hooc_perception.core.arrays import AnyArray, Float32Array, Int32Array
from hooc_perception.core.geometry import rays
from hooc_perception.core.render import projected, render_depth, render_patch
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Camera, DepthView
import numpy as np
import open3d as o3d

# Silhouettes differ by a pixel here and there: rounding decides who owns a pixel on an edge.
EDGE_SHARE = 0.002
AGREE_M = 1e-4
# OpenCV first rounds coordinates to 1/32 pixel, so it picks another neighbour here and there.
ROUNDED_SHARE = 0.06
KINECT_V2_D = np.array([0.0916, -0.2702, 0.0008, -0.0006, 0.0941])
# Pixel indices and depths of one mesh in one view.
Patch: TypeAlias = tuple[Int32Array, Float32Array]


def view_contest(scene: BenchScene) -> Contest:
    """Return the Contest of rendering one whole view of all objects."""
    camera = scene.cameras[0]
    return Contest(
        'render a view', f'{len(scene.meshes)} objects, {camera.width} x {camera.height}', (
            Contestant('z-buffer in numba (ours)', lambda: render_depth(scene.meshes, camera)[0]),
            Contestant('Open3D ray casting', lambda: cast(scene.meshes, camera)),
            Contestant('z-buffer in numpy', lambda: numpy_depth(scene.meshes, camera))),
        differing_share, EDGE_SHARE)


def candidates_contest(scene: BenchScene) -> Contest:
    """Return the Contest of rendering every candidate alone into every view."""
    meshes = candidate_meshes(scene)

    def ours() -> list[Patch]:
        return [render_patch(v, f, camera) for v, f in meshes for camera in scene.cameras]

    def open3d() -> list[Patch]:
        return [cast_patch(v, f, camera) for v, f in meshes for camera in scene.cameras]

    def disagreement(a: list[Patch], b: list[Patch]) -> float:
        pixels = sum(len(p) for p, _ in a)
        odd = sum(len(np.setxor1d(p, q)) for (p, _), (q, _) in zip(a, b))
        return odd / pixels

    return Contest('render the candidates',
                   f'{len(meshes)} candidates x {len(scene.cameras)} views', (
                       Contestant('z-buffer in numba (ours)', ours),
                       Contestant('Open3D ray casting', open3d)), disagreement, 0.02)


def undistortion_contest(scene: BenchScene) -> Contest:
    """Return the Contest of rectifying one raw image."""
    camera = replace(scene.cameras[0], D=KINECT_V2_D)
    view = DepthView(camera, np.ascontiguousarray(scene.views[0].depth))
    size = (camera.width, camera.height)

    def opencv() -> AnyArray:
        x, y = cv2.initUndistortRectifyMap(camera.K, camera.D, None, camera.K, size,
                                           cv2.CV_32FC1)
        return cv2.remap(view.depth, x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT,
                         borderValue=float('nan'))

    return Contest('undistort an image', f'{size[0]} x {size[1]}, nearest pixel', (
        Contestant('numba, limits included (ours)', lambda: rectify(view).depth),
        Contestant('OpenCV', opencv)), differing_share, ROUNDED_SHARE)


def differing_share(a: AnyArray, b: AnyArray) -> float:
    """Return the share of pixels where two depth images (inf or NaN = none) differ."""
    a, b = (np.where(np.isfinite(image), image, 0) for image in (a, b))
    return float((np.abs(a - b) > AGREE_M).mean())


def cast(meshes: Sequence[tuple[AnyArray, AnyArray]], camera: Camera) -> Float32Array:
    """Return (H, W) float32 depth by Open3D; the scene is rebuilt each time."""
    scene = o3d.t.geometry.RaycastingScene()
    for vertices, faces in meshes:
        scene.add_triangles(_tensor(vertices.astype(np.float32)),
                            _tensor(faces.astype(np.uint32)))
    return _cast(scene, camera, slice(0, camera.height), slice(0, camera.width))


def cast_patch(vertices: AnyArray, faces: AnyArray, camera: Camera) -> Patch:
    """Return (pixels, depth) of one mesh by Open3D, rays in its bounding window only."""
    uvz = projected(vertices, camera)
    low = np.maximum(np.floor(uvz[:, :2].min(axis=0)), 0).astype(int)
    high = np.minimum(np.ceil(uvz[:, :2].max(axis=0)) + 1,
                      [camera.width, camera.height]).astype(int)
    if (high <= low).any():
        return np.zeros(0, np.int32), np.zeros(0, np.float32)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(_tensor(vertices.astype(np.float32)),
                        _tensor(faces.astype(np.uint32)))
    depth = _cast(scene, camera, slice(low[1], high[1]), slice(low[0], high[0]))
    rows, columns = np.nonzero(np.isfinite(depth))
    return (((rows + low[1]) * camera.width + columns + low[0]).astype(np.int32),
            depth[rows, columns])


def _tensor(array: AnyArray) -> o3d.core.Tensor:
    """Return an array as a tensor; the stub has no default for its type and device."""
    return o3d.core.Tensor(array)  # pyright: ignore[reportCallIssue]


def _cast(scene: o3d.t.geometry.RaycastingScene, camera: Camera, rows: slice,
          columns: slice) -> Float32Array:
    """Return the depth of a window of pixels."""
    window = rays(camera.K, camera.height, camera.width)[rows, columns]
    directions = window @ camera.T_world_camera[:3, :3].T
    origins = np.broadcast_to(camera.T_world_camera[:3, 3], directions.shape)
    both = np.concatenate([origins, directions], axis=-1).astype(np.float32)
    # Directions have z = 1 in the camera: the ray parameter is the depth.
    return scene.cast_rays(_tensor(both))['t_hit'].numpy()


def numpy_depth(meshes: Sequence[tuple[AnyArray, AnyArray]], camera: Camera) -> Float32Array:
    """Return (H, W) float32 depth by a plain z-buffer: a loop over triangles, numpy inside."""
    depth = np.full((camera.height, camera.width), np.inf)
    for vertices, faces in meshes:
        uvz = projected(vertices, camera)
        for (u, v, z) in uvz[faces].transpose(0, 2, 1):
            u0, v0 = max(int(np.ceil(u.min())), 0), max(int(np.ceil(v.min())), 0)
            u1 = min(int(u.max()) + 1, camera.width)
            v1 = min(int(v.max()) + 1, camera.height)
            area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0])
            if u0 >= u1 or v0 >= v1 or abs(area) < 1e-12 or z.min() <= 0:
                continue
            x, y = np.meshgrid(np.arange(u0, u1), np.arange(v0, v1))
            w1 = ((x - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (y - v[0])) / area
            w2 = ((u[1] - u[0]) * (y - v[0]) - (x - u[0]) * (v[1] - v[0])) / area
            w0 = 1 - w1 - w2
            # 1 / z is linear in the image.
            here = 1 / (w0 / z[0] + w1 / z[1] + w2 / z[2])
            inside = (w0 >= 0) & (w1 >= 0) & (w2 >= 0)
            patch = depth[v0:v1, u0:u1]
            np.minimum(patch, np.where(inside, here, np.inf), out=patch)
    return depth.astype(np.float32)
