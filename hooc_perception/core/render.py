# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The one depth renderer: training, candidates, parsing and reports all use it."""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array
from hooc_perception.core.geometry import inverse
from hooc_perception.core.kernels import raster
from hooc_perception.core.memo import per_model
from hooc_perception.core.types import Camera, GenericModel
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


def projected(vertices_world: Float64Array, camera: Camera) -> Float64Array:
    """Return (V, 3) float64 rows (u, v, z) of world vertices (V, 3) in a rectified camera."""
    T_camera_world = inverse(camera.T_world_camera)
    K = camera.K
    return raster.project_vertices(
        np.ascontiguousarray(vertices_world, np.float64),
        np.ascontiguousarray(T_camera_world[:3, :3]), np.ascontiguousarray(T_camera_world[:3, 3]),
        K[0, 0], K[1, 1], K[0, 2], K[1, 2])


def render_depth(meshes: Sequence[tuple[Float64Array, Int32Array]], camera: Camera,
                 ) -> tuple[Float32Array, Int32Array]:
    """
    Return (depth, ids) of posed meshes in one rectified camera; nearest wins.

    :param meshes: sequence of (vertices (V, 3) float64 world metres, faces (F, 3) int32).
    :return: depth (H, W) float32 metres with inf where nothing is seen, and ids (H, W) int32,
        the index of the mesh seen there, -1 for none.
    """
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    ids = np.full((camera.height, camera.width), -1, np.int32)
    for i, (vertices, faces) in enumerate(meshes):
        raster.draw(projected(vertices, camera), faces, i, 0, 0, depth, ids)
    return depth, ids


def render_patch(vertices_world: Float64Array, faces: Int32Array, camera: Camera,
                 ) -> tuple[Int32Array, Float32Array]:
    """
    Return (pixels, depth) that one posed mesh covers: flat indices (n,) int32, metres (n,).

    The indices ascend; `depth` is float32. Cheap for small objects: only the bounding window
    is drawn.
    """
    uvz = projected(vertices_world, camera)
    u0, v0, u1, v1 = raster.bounding_window(uvz, camera.width, camera.height)
    depth = np.full((v1 - v0, u1 - u0), np.inf, np.float32)
    raster.draw(uvz, faces, 0, u0, v0, depth, np.zeros(depth.shape, np.int32))
    rows, cols = np.nonzero(np.isfinite(depth))
    pixels = ((rows + v0) * camera.width + cols + u0).astype(np.int32)
    return pixels, depth[rows, cols]


@per_model
def is_closed(model: GenericModel) -> bool:
    """
    Return whether a GenericModel is made of closed surfaces that are all wound outwards.

    Of such a mesh only the faces towards the camera need drawing (kernels/raster.py).
    """
    faces = model.faces.astype(np.int64)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    n = len(model.vertices)
    there, back = edges @ [n, 1], edges @ [1, n]
    paired = np.array_equal(np.sort(there), np.sort(back))
    if not len(faces) or not paired or len(np.unique(there)) < len(there):
        return False
    graph = coo_array((np.ones(len(edges), bool), edges.T), (n, n))
    part = connected_components(graph, directed=False)[1][faces[:, 0]]
    a, b, c = (model.vertices[faces[:, k]] for k in range(3))
    return bool((np.bincount(part, np.einsum('ij,ij->i', a, np.cross(b, c)))[np.unique(part)]
                 > 0).all())
