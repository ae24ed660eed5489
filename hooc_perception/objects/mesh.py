# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read a mesh file of unknown origin and return a clean, centred mesh in metres."""

import io
import json
import math
from pathlib import Path
import struct

from hooc_perception.core.arrays import Float64Array
from hooc_perception.errors import HoocError
import numpy as np
import trimesh

MAX_BYTES = 200 * 10**6
MAX_FACES = 2 * 10**6
MAX_NODES = 10**4
# A generic model is an object on a table; anything longer is not in metres.
MAX_SIDE_M = 10.0
MIN_SIDE_M = 1e-6
ARCHIVES = {'bz2', 'zip', 'tar.gz', 'tar.bz2'}


def load_mesh(path: str | Path, scale: float = 1.0) -> trimesh.Trimesh:
    """
    Return the mesh of a file: merged, without degenerate faces, centred, in metres.

    The file is read from memory without a resolver, so that no file it refers to (materials,
    textures, external buffers) is ever opened. A file with several meshes gives their union
    as one face list.

    :param path: PLY, OBJ, STL, OFF or another mesh format that trimesh reads.
    :param scale: model unit in metres.
    :return: float64 vertices, bounding-box centre at the origin.
    :raises HoocError: if the file is missing, empty, too large or not a mesh, or the mesh has
        vertices that are not finite, no extent along an axis, or an implausible size.
    """
    mesh = _cleaned(path, scale)
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh


def mesh_box(path: str | Path, scale: float = 1.0) -> tuple[Float64Array, Float64Array]:
    """
    Return (centre (3,), size (3,)) in metres of a file's mesh, not centred.

    :raises HoocError: as `load_mesh`.
    """
    mesh = _cleaned(path, scale)
    return mesh.bounds.mean(axis=0), np.array(mesh.extents)


def _cleaned(path: str | Path, scale: float) -> trimesh.Trimesh:
    """Return the cleaned mesh of a file in metres, not centred."""
    path = Path(path)
    if isinstance(scale, bool) or not isinstance(scale, (int, float)) or not (
            math.isfinite(scale) and scale > 0):
        raise HoocError(f'the scale of mesh {path} is {scale!r}; give a positive number of '
                        'metres per model unit')
    mesh = _read(path)
    if len(mesh.faces) > MAX_FACES:
        raise HoocError(f'mesh {path} has {len(mesh.faces)} faces, more than {MAX_FACES}; '
                        'simplify it first')
    faces = np.asarray(mesh.faces, np.int64)
    if faces.min() < 0 or faces.max() >= len(mesh.vertices):
        raise HoocError(f'mesh {path} has faces that name vertices it does not have; '
                        'export it again')
    mesh = trimesh.Trimesh(np.asarray(mesh.vertices, np.float64) * scale, faces, process=False)
    mesh.remove_unreferenced_vertices()
    if not np.isfinite(mesh.vertices).all():
        raise HoocError(f'mesh {path} has vertices that are not finite numbers; export it again')
    if mesh.extents.max() > MAX_SIDE_M:
        raise HoocError(f'mesh {path} is {mesh.extents.max():.3g} m long; if its unit is not the '
                        'metre, set its scale (0.001 for millimetres)')
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    faces = mesh.faces
    mesh.update_faces((faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])
                      & (faces[:, 2] != faces[:, 0]))
    mesh.update_faces(mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    if len(mesh.faces) == 0 or mesh.extents.min() < MIN_SIDE_M:
        raise HoocError(f'mesh {path} has no extent along one of its axes; give it some '
                        'thickness')
    return mesh


def _read(path: Path) -> trimesh.Trimesh:
    """Return the file's triangles as trimesh reads them, or raise HoocError."""
    if not path.is_file():
        raise HoocError(f'mesh {path} does not exist; check the path in dataset.yaml')
    size = path.stat().st_size
    if size == 0:
        raise HoocError(f'mesh {path} is an empty file; export it again')
    if size > MAX_BYTES:
        raise HoocError(f'mesh {path} has {size / 1e6:.0f} MB, more than {MAX_BYTES / 1e6:.0f}; '
                        'simplify it first')
    kind = path.suffix.lower().lstrip('.')
    if kind in ARCHIVES or kind not in trimesh.available_formats():
        raise HoocError(f'mesh {path} has the unknown format {kind!r}; convert it to PLY, OBJ, '
                        'STL or OFF')
    data = path.read_bytes()
    try:
        if kind in ('glb', 'gltf'):
            _check_gltf(data)
        # The parsers get arbitrary bytes, so whatever they raise means "not a mesh".
        scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False,
                                   skip_materials=True)
        _check_instances(scene)
        mesh = scene.to_mesh()
        if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
            raise ValueError('it holds no faces')
    except (Exception, MemoryError) as e:
        reason = ' '.join(str(e).split())[:120] or type(e).__name__
        raise HoocError(f'mesh {path} cannot be read as {kind.upper()} ({reason}); '
                        'export it again') from e
    return mesh


def _check_gltf(data: bytes) -> None:
    """Raise ValueError if a small glTF file expands to a lot: nodes, empty arrays."""
    if data[:4] == b'glTF':
        length, = struct.unpack_from('<I', data, 12)
        data = data[20:20 + length]
    content = json.loads(data)
    nodes, accessors = content.get('nodes', ()), content.get('accessors', ())
    if len(nodes) > MAX_NODES:
        raise ValueError(f'it has {len(nodes)} nodes, more than {MAX_NODES}')
    numbers = sum(int(accessor['count']) for accessor in accessors)
    if numbers > 8 * MAX_FACES:
        raise ValueError(f'its arrays have {numbers} rows')
    if any(str(part.get('uri', 'data:'))[:5] != 'data:' for part in content.get('buffers', ())):
        raise ValueError('it refers to other files; export it as one')


def _check_instances(scene: trimesh.Scene) -> None:
    """Raise ValueError if the instances of the meshes have too many faces in total."""
    names = scene.graph.nodes_geometry
    faces = sum(len(getattr(scene.geometry[scene.graph[name][1]], 'faces', ()))
                for name in names)
    if faces > MAX_FACES:
        raise ValueError(f'its parts have {faces} faces, more than {MAX_FACES}; simplify it')
