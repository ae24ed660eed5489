# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes that grow by a margin, so that errors of the robot's pose leave no rim of it behind."""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.segment.hidden import Mesh
from hooc_perception.errors import HoocError
import numpy as np
import numpy.typing as npt
import trimesh

# A vertex of a sharp edge moves farther than the margin, so that all its faces move by the
# margin, but at most this many times as far.
MOST_MITRE = 2.0


def padded(mesh: trimesh.Trimesh, padding_m: float) -> list[Mesh]:
    """
    Return meshes that together cover a mesh and everything within a margin of its surface.

    The vertices of a closed mesh move outwards. Where the mesh does not tell where that is, as
    with many meshes made for display, they move to both sides.

    :param padding_m: how far every face moves, metres.
    :return: (vertices (V, 3) float64, faces (F, 3) int32) in the frame of the mesh.
    """
    mesh = mesh.copy()
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.remove_unreferenced_vertices()
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32)
    if not padding_m or not len(faces):
        return [(vertices, faces)]
    offsets = padding_m * _mitred_normals(mesh)
    if mesh.is_watertight and mesh.is_winding_consistent and mesh.volume:
        return [(vertices + np.sign(mesh.volume) * offsets, faces)]
    return [(vertices + offsets, faces), (vertices, faces), (vertices - offsets, faces)]


def boxes_of(numbers: Sequence[float]) -> list[trimesh.Trimesh]:
    """
    Return boxes along the axes of their frame.

    :param numbers: six per box: smallest x y z, largest x y z, metres.
    :raises HoocError: if they are no boxes.
    """
    rows: npt.NDArray[np.float64] = np.asarray(numbers, np.float64)
    if len(rows) % 6 or not np.isfinite(rows).all():
        raise HoocError(f'{len(rows)} numbers are no boxes; give six finite numbers per box: the '
                        'smallest x y z and the largest x y z')
    boxes = rows.reshape(-1, 2, 3)
    if not (boxes[:, 0] < boxes[:, 1]).all():
        raise HoocError('a box has no extent along an axis; give the smallest x y z first, then '
                        'the largest x y z')
    return [trimesh.creation.box(bounds=box) for box in boxes]


def _mitred_normals(mesh: trimesh.Trimesh) -> Float64Array:
    """Return (V, 3), for each vertex how far it moves where its faces move by 1."""
    normals, faces = np.asarray(mesh.vertex_normals), mesh.faces
    cosine = np.einsum('fvx,fx->fv', normals[faces], mesh.face_normals)
    least = np.full(len(normals), 1.0)
    np.minimum.at(least, faces.ravel(), cosine.ravel())
    return normals / np.clip(least, 1 / MOST_MITRE, 1.0)[:, None]
