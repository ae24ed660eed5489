# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read a mesh file of unknown origin and return a clean, centred mesh in metres."""

import math
from pathlib import Path
import warnings

from hooc_perception.core.arrays import Float64Array
from hooc_perception.errors import HoocError, HoocWarning
from hooc_perception.objects.mesh_checks import size_trouble, stray_parts
from hooc_perception.objects.mesh_file import MAX_FACES, read_mesh_file
import numpy as np
import trimesh

MIN_SIDE_M = 1e-6
# Columns of the z-up frame in terms of the file's axes: right stays right, up becomes z.
_TO_Z_UP = {'x': np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]),
            'y': np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])}


def load_mesh(path: str | Path, scale: float | None = None,
              up: str | None = None) -> trimesh.Trimesh:
    """
    Return the mesh of a file: merged, without degenerate faces, centred, in metres, z up.

    The file is read from memory without a resolver, so that no file it refers to (materials,
    textures, external buffers) is ever opened. A file with several meshes gives their union
    as one face list.

    :param path: PLY, OBJ, STL, OFF or another mesh format that trimesh reads.
    :param scale: model unit in metres; None takes the unit that the file documents.
    :param up: axis of the file that points up, 'x', 'y' or 'z'; None takes the documented one
        (see mesh_file.py). The mesh is turned so that it becomes z.
    :return: float64 vertices, bounding-box centre at the origin.
    :raises HoocError: if the file is missing, empty, too large or not a mesh, or the mesh has
        vertices that are not finite, no extent along an axis, or an implausible size.
    :warns HoocWarning: if a small part lies far away from the rest.
    """
    mesh = _cleaned(path, scale, up)
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh


def mesh_box(path: str | Path, scale: float | None = None,
             up: str | None = None) -> tuple[Float64Array, Float64Array]:
    """
    Return (centre (3,), size (3,)) in metres of a file's mesh, z up, not centred.

    :raises HoocError: as `load_mesh`.
    """
    mesh = _cleaned(path, scale, up)
    return mesh.bounds.mean(axis=0), np.array(mesh.extents)


def _cleaned(path: str | Path, scale: float | None, up: str | None) -> trimesh.Trimesh:
    """Return the cleaned mesh of a file in metres, z up, not centred."""
    path = Path(path)
    if scale is not None and (isinstance(scale, bool) or not isinstance(scale, (int, float))
                              or not (math.isfinite(scale) and scale > 0)):
        raise HoocError(f'the scale of mesh {path} is {scale!r}; give a positive number of '
                        'metres per model unit')
    content = read_mesh_file(path)
    mesh = content.mesh
    if len(mesh.faces) > MAX_FACES:
        raise HoocError(f'mesh {path} has {len(mesh.faces)} faces, more than {MAX_FACES}; '
                        'simplify it first')
    faces = np.asarray(mesh.faces, np.int64)
    if faces.min() < 0 or faces.max() >= len(mesh.vertices):
        raise HoocError(f'mesh {path} has faces that name vertices it does not have; '
                        'export it again')
    scale = content.unit if scale is None else scale
    vertices = np.asarray(mesh.vertices, np.float64) * scale
    if (up or content.up) in _TO_Z_UP:
        vertices = vertices @ _TO_Z_UP[up or content.up].T
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.remove_unreferenced_vertices()
    if not np.isfinite(mesh.vertices).all():
        raise HoocError(f'mesh {path} has vertices that are not finite numbers; export it again')
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    faces = mesh.faces
    mesh.update_faces((faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])
                      & (faces[:, 2] != faces[:, 0]))
    mesh.update_faces(mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    if len(mesh.faces) == 0 or mesh.extents.min() < MIN_SIDE_M:
        raise HoocError(f'mesh {path} has no extent along one of its axes; give it some '
                        'thickness')
    _check_size(mesh, path, scale)
    return mesh


def _check_size(mesh: trimesh.Trimesh, path: Path, scale: float) -> None:
    """Refuse a mesh that is too large or too small for a table; warn of stray parts."""
    longest = float(mesh.extents.max())
    trouble = size_trouble(longest, scale)
    if stray := stray_parts(mesh):
        faces, rest = stray
        text = (f'mesh {path} has a stray part of {int(faces.sum())} faces far away from the '
                f'rest, which makes it {longest:.3g} m long instead of {rest.max():.3g} m; '
                'remove the part')
        if trouble and size_trouble(float(rest.max()), scale) is None:
            raise HoocError(text)
        warnings.warn(text, HoocWarning, stacklevel=3)
    if trouble:
        raise HoocError(f'mesh {path} is {trouble}')
