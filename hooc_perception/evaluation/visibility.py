# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How much of every true object can be seen at all (the paper's Table 1)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from hooc_perception.core.arrays import AnyArray, BoolArray, Float64Array, Int32Array
from hooc_perception.core.kernels import raster
from hooc_perception.core.render import projected, render_depth, render_patch
from hooc_perception.core.types import Camera, GenericModel
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.matching import PosedObject
import numpy as np

SAMPLES = 4000
# Rendered this much finer than the camera, a surface seen at a grazing angle moves little in
# depth from one pixel to the next, and the tolerance can stay below the thickness of a glass.
ZOOM = 3
TOLERANCE_M = 0.001
MAX_SLANT_M = 0.01


@dataclass(frozen=True)
class Visibility:
    """
    Table 1's row of one object.

    :ivar pixels: (V,) float64 share of the pixels that the object alone would cover which are
        still its own among the others; NaN in views that it would not be in.
    :ivar surface: (V,) float64 share of its surface that each camera sees.
    :ivar total: share of its surface that some camera sees.
    """

    category: str
    pixels: Float64Array
    surface: Float64Array
    total: float


def _zoomed(camera: Camera) -> Camera:
    """Return the camera with ZOOM times the resolution, without distortion."""
    K = camera.K.astype(np.float64).copy()
    # The image's corner, not its first pixel's centre, stays where it is.
    K[:2, 2] = (K[:2, 2] + 0.5) * ZOOM - 0.5
    K[0, 0] *= ZOOM
    K[1, 1] *= ZOOM
    return replace(camera, width=camera.width * ZOOM, height=camera.height * ZOOM, K=K)


def surface_samples(vertices: Float64Array, faces: Int32Array, n: int,
                    rng: np.random.Generator) -> tuple[Float64Array, Float64Array]:
    """Return (points (n, 3), normals (n, 3)), uniform on a mesh's surface."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(faces), n, p=areas / areas.sum())
    a, b = rng.random((2, n, 1))
    over = a + b > 1
    a, b = np.where(over, 1 - a, a), np.where(over, 1 - b, b)
    c = corners[chosen]
    return (c[:, 0] + a * (c[:, 1] - c[:, 0]) + b * (c[:, 2] - c[:, 0]),
            normals[chosen] / areas[chosen, None])


def _edges_paired(faces: Int32Array) -> bool:
    """Return whether every directed edge has its opposite: closed, wound one way."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    n = edges.max() + 1
    return np.array_equal(np.sort(edges[:, 0] * n + edges[:, 1]),
                          np.sort(edges[:, 1] * n + edges[:, 0]))


def _outward(vertices: Float64Array, faces: Int32Array) -> int:
    """Return +1 or -1 where normals point outward or inward, 0 where the mesh is open."""
    if not _edges_paired(faces):
        return 0
    corners = vertices[faces] - vertices.mean(0)
    return int(np.sign(np.einsum('ij,ij->', corners[:, 0],
                                 np.cross(corners[:, 1], corners[:, 2]))))


def scene_visibility(objects: Sequence[PosedObject], models: Mapping[str, GenericModel],
                     cameras: Sequence[Camera], rng: np.random.Generator,
                     samples: int = SAMPLES) -> list[Visibility]:
    """
    Return one Visibility per object, in order: Table 1 of a scene.

    Objects are the generic models, scaled to the true sizes, at the true poses; lens
    distortion is ignored, and so is the table, as in the paper.

    :param rng: draws the surface samples.
    """
    meshes = [world_mesh(o, models[o.category]) for o in objects]
    sampled = [surface_samples(v, f, samples, rng) for v, f in meshes]
    outward = [_outward(v, f) for v, f in meshes]
    pixels = np.full((len(objects), len(cameras)), np.nan)
    seen = np.zeros((len(objects), len(cameras), samples), bool)
    for j, camera in enumerate(cameras):
        ids = render_depth(meshes, camera)[1]
        fine = _zoomed(camera)
        depth, fine_ids = render_depth(meshes, fine)
        for i, (vertices, faces) in enumerate(meshes):
            alone = len(render_patch(vertices, faces, camera)[0])
            if alone:
                pixels[i, j] = (ids == i).sum() / alone
            seen[i, j] = _sees(*sampled[i], outward[i], fine, depth, fine_ids == i)
    return [Visibility(o.category, pixels[i], seen[i].mean(1), float(seen[i].any(0).mean()))
            for i, o in enumerate(objects)]


def _sees(points: Float64Array, normals: Float64Array, outward: int, camera: Camera,
          depth: AnyArray, own: BoolArray) -> BoolArray:
    """
    Return (n,) bool: the surface points that the camera sees in a rendering of all objects.

    :param depth: (H, W) of that rendering; `own` says where it shows the object.
    """
    uvz = projected(points, camera)
    ahead = uvz[:, 2] > raster.NEAR_M
    u, v = np.rint(np.where(ahead[:, None], uvz[:, :2], -1)).clip(-1, 1e6).astype(int).T
    inside = (ahead & (u >= 1) & (v >= 1)
              & (u < camera.width - 1) & (v < camera.height - 1))
    u, v = np.where(inside, u, 1), np.where(inside, v, 1)
    ray = camera.T_world_camera[:3, 3] - points
    cosine = np.einsum('ij,ij->i', normals, ray) / np.linalg.norm(ray, axis=1)
    # From one pixel to the next a slanted surface gains this much depth.
    slope = uvz[:, 2] / camera.K[0, 0] / np.maximum(np.abs(cosine), 1e-3)
    limit = uvz[:, 2] - TOLERANCE_M - np.minimum(slope, MAX_SLANT_M)
    near = np.zeros(len(points), bool)
    # The neighbours too: at the outline, a sample may lie beside the centre of its pixel.
    for du, dv in ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)):
        at = (v + dv, u + du)
        near |= own[at] & (limit <= depth[at])
    if outward:
        near &= outward * cosine > 0
    return inside & near
