# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Read the triangles of a mesh file of unknown origin, with the unit and the up axis it documents.

glTF files are in metres with y up (glTF 2.0, section 3.4). COLLADA files state both in their
<asset>; metres and Y_UP where they do not (COLLADA 1.5, chapter 5). 3MF files state their unit
and have z up. The other formats document neither.
"""

from dataclasses import dataclass
import importlib.util
import io
import json
from pathlib import Path
import re
import struct
from typing import Any

from hooc_perception.errors import HoocError
import numpy as np
import trimesh

MAX_BYTES = 200 * 10**6
MAX_FACES = 2 * 10**6
MAX_NODES = 10**4
ARCHIVES = {'bz2', 'zip', 'tar.gz', 'tar.bz2', 'zae'}
# Metres per unit of 3MF.
UNITS_OF_3MF = {'micron': 1e-6, 'millimeter': 0.001, 'centimeter': 0.01, 'inch': 0.0254,
                'foot': 0.3048, 'meter': 1.0}
_DRACO = 'KHR_draco_mesh_compression'
_UP_AXIS = re.compile(rb'<up_axis>\s*([XYZ])_UP\s*</up_axis>')
_UNIT = re.compile(rb'<unit\b[^>]*\bmeter\s*=\s*["\']\s*([-+.0-9eE]+)\s*["\']')
_STL_HEAD, _STL_FACET = 84, 50


@dataclass(frozen=True)
class MeshFile:
    """
    What a mesh file holds.

    :ivar mesh: its triangles in its own unit and axes, all parts in one.
    :ivar unit: metres per unit that the file states, 1.0 where it states none.
    :ivar up: axis of the file that points up, 'x', 'y' or 'z'.
    """

    mesh: trimesh.Trimesh
    unit: float = 1.0
    up: str = 'z'


def read_mesh_file(path: Path) -> MeshFile:
    """
    Return the MeshFile of a file; no file that it refers to is ever opened.

    :raises HoocError: if the file is missing, empty, too large or not a mesh.
    """
    kind, data = _content(path)
    unit, up = 1.0, 'z'
    try:
        if kind in ('glb', 'gltf'):
            up = 'y'
            _check_gltf(path, data)
        elif kind == 'dae':
            unit, up = _check_collada(path, data)
        elif kind == 'stl':
            data = _exact_stl(data)
        # The parsers get arbitrary bytes, so whatever they raise means "not a mesh".
        scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False,
                                   skip_materials=True)
        _check_instances(scene)
        if kind == '3mf':
            unit = UNITS_OF_3MF.get(str(scene.units).rstrip('s').replace('metre', 'meter'), 0.001)
        mesh = scene.to_mesh()
        if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
            _refuse_points(path, scene)
            raise ValueError('it holds no faces')
    except HoocError:
        raise
    except (Exception, MemoryError) as e:
        reason = ' '.join(str(e).split())[:120] or type(e).__name__
        raise HoocError(f'mesh {path} cannot be read as {kind.upper()} ({reason}); '
                        'export it again') from e
    return MeshFile(mesh, unit, up)


def _content(path: Path) -> tuple[str, bytes]:
    """Return (format, bytes) of a file after checking both."""
    if not path.is_file():
        raise HoocError(f'mesh {path} does not exist; check the path in dataset.yaml')
    size = path.stat().st_size
    if size == 0:
        raise HoocError(f'mesh {path} is an empty file; export it again')
    if size > MAX_BYTES:
        raise HoocError(f'mesh {path} has {size / 1e6:.0f} MB, more than {MAX_BYTES / 1e6:.0f}; '
                        'simplify it first')
    kind = path.suffix.lower().lstrip('.')
    if kind == 'dae' and not _installed('collada'):
        raise HoocError(f'mesh {path} is a COLLADA file, which needs the package pycollada; run '
                        'pip install pycollada, or convert it to PLY')
    if kind in ARCHIVES or kind not in trimesh.available_formats():
        raise HoocError(f'mesh {path} has the unknown format {kind!r}; convert it to PLY, OBJ, '
                        'STL or OFF')
    return kind, path.read_bytes()


def _installed(module: str) -> bool:
    """Return whether an optional module can be imported."""
    return importlib.util.find_spec(module) is not None


def _exact_stl(data: bytes) -> bytes:
    """Return a binary STL without what was appended to it; anything else as it is."""
    if len(data) < _STL_HEAD:
        return data
    end = _STL_HEAD + _STL_FACET * struct.unpack_from('<I', data, _STL_HEAD - 4)[0]
    is_text = data[:5] == b'solid' and b'facet' in data[:1000]
    return data[:end] if _STL_HEAD < end < len(data) and not is_text else data


def _check_collada(path: Path, data: bytes) -> tuple[float, str]:
    """Return (metres per unit, up axis) that a COLLADA file documents; refuse XML entities."""
    if b'<!ENTITY' in data or b'<!DOCTYPE' in data:
        raise HoocError(f'mesh {path} declares XML entities, which are not read; export it again '
                        'without them')
    unit, up = _UNIT.search(data), _UP_AXIS.search(data)
    metres = float(unit[1]) if unit else 1.0
    if not (np.isfinite(metres) and metres > 0):
        raise HoocError(f'mesh {path} states a unit of {metres:g} m; correct <unit meter="..."/>')
    return metres, up[1].decode().lower() if up else 'y'


def _check_gltf(path: Path, data: bytes) -> None:
    """Refuse glTF that is compressed, kept in several files, or expands to a lot."""
    if data[:4] == b'glTF':
        length, = struct.unpack_from('<I', data, 12)
        data = data[20:20 + length]
    content: dict[str, Any] = json.loads(data)
    needed = set(content.get('extensionsRequired', ()))
    if _DRACO in needed and not _installed('DracoPy'):
        raise HoocError(f'mesh {path} is compressed with Draco, which needs the package DracoPy; '
                        'run pip install DracoPy, or export it without compression')
    if packed := sorted(name for name in needed if 'meshopt' in name):
        raise HoocError(f'mesh {path} is compressed ({packed[0]}), which is not read; export it '
                        'without compression')
    nodes, accessors = content.get('nodes', ()), content.get('accessors', ())
    if len(nodes) > MAX_NODES:
        raise ValueError(f'it has {len(nodes)} nodes, more than {MAX_NODES}')
    numbers = sum(int(accessor['count']) for accessor in accessors)
    if numbers > 8 * MAX_FACES:
        raise ValueError(f'its arrays have {numbers} rows')
    for part in content.get('buffers', ()):
        if (uri := str(part.get('uri', 'data:')))[:5] != 'data:':
            raise HoocError(f'mesh {path} refers to other files ({uri[:60]}), which are never '
                            'opened; export it as one file (.glb)')


def _check_instances(scene: trimesh.Scene) -> None:
    """Raise ValueError if the instances of the meshes have too many faces in total."""
    names = scene.graph.nodes_geometry
    faces = sum(len(getattr(scene.geometry[scene.graph[name][1]], 'faces', ()))
                for name in names)
    if faces > MAX_FACES:
        raise ValueError(f'its parts have {faces} faces, more than {MAX_FACES}; simplify it')


def _refuse_points(path: Path, scene: trimesh.Scene) -> None:
    """Raise HoocError where a file holds points instead of a surface."""
    points = sum(len(part.vertices) for part in scene.geometry.values()
                 if isinstance(part, trimesh.PointCloud))
    if points:
        raise HoocError(f'mesh {path} is a cloud of {points} points without faces; reconstruct '
                        'its surface first')
