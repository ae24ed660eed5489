# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Turn any triangle mesh into a solid, for the overlap term of Eq. 1.

The paper left out two categories whose meshes were not watertight (dustpan, tray); here every
mesh gets a volume. The rules, applied to each connected part:

1. watertight: kept; inverted if its volume is negative and it is not a cavity;
2. small holes, and pairs of holes that close each other (the rim of a double wall): capped;
3. other sheets (an open vessel modelled without thickness): thickened to SHEET_M, so that an
   open vessel keeps its cavity.

The parts are then united, so that overlapping parts are counted once. If any part is still not
a manifold, the whole mesh is rebuilt as a level set (level_set.py).
"""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.objects.level_set import level_set_solid
from hooc_perception.objects.manifold import from_manifold, SHEET_M, to_manifold
import manifold3d
import numpy as np
import trimesh

# A hole is small if its cap has less than this share of the part's area.
SMALL_HOLE = 0.02
MAX_PARTS = 300


def closed(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """
    Return a watertight mesh of positive volume that represents the given one.

    :param mesh: in metres, finite; need not be watertight, consistently wound or free of
        self-intersections.
    """
    parts = _parts(mesh)
    solids = [solid for part in parts if (solid := _solid_part(part)) is not None]
    if parts and len(solids) == len(parts):
        union = _unite(solids)
        if union is not None:
            return union
    return level_set_solid(mesh)


def _is_solid(mesh: trimesh.Trimesh) -> bool:
    """Return whether manifold3d accepts the mesh as an oriented, closed surface."""
    return (len(mesh.faces) >= 4 and mesh.is_watertight and mesh.is_winding_consistent
            and to_manifold(mesh).status() == manifold3d.Error.NoError)


def _parts(mesh: trimesh.Trimesh) -> list[trimesh.Trimesh]:
    """
    Return the edge-connected parts of a mesh, each consistently wound if possible.

    The list is empty for a soup of more than MAX_PARTS, whose parts have no meaning.
    """
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    labels = trimesh.graph.connected_component_labels(mesh.face_adjacency, len(mesh.faces))
    if labels.max() >= MAX_PARTS:
        return []
    if not mesh.is_winding_consistent:
        trimesh.repair.fix_winding(mesh)
    return list(mesh.split(only_watertight=False))


def _solid_part(part: trimesh.Trimesh) -> trimesh.Trimesh | None:
    """Return a closed mesh of one connected part (its winding may be inverted), or None."""
    if not _is_solid(part):
        loops = _boundary_loops(part)
        if loops is None or not part.is_winding_consistent:
            return None
        part = (_capped if _caps_are_harmless(part, loops) else _thickened)(part, loops)
        if not _is_solid(part):
            return None
    return part


def _boundary_loops(part: trimesh.Trimesh) -> list[Int64Array] | None:
    """Return the closed loops of vertex indices along open edges, or None if they branch."""
    edges = part.edges
    key = np.sort(edges, axis=1)
    _, inverse, counts = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    if counts.max() > 2:
        return None
    open_edges = edges[counts[inverse.ravel()] == 1]
    follower = dict(map(tuple, open_edges))
    if len(follower) != len(open_edges) or set(follower) != set(follower.values()):
        return None
    loops = []
    while follower:
        loop = [next(iter(follower))]
        while loop[-1] in follower:
            loop.append(follower.pop(loop[-1]))
        loops.append(np.array(loop[:-1]))
    return loops


def _vector_area(points: Float64Array) -> Float64Array:
    """Return half the sum of cross products around a closed polygon (n, 3): (3,) m^2."""
    centred = points - points.mean(axis=0)
    return np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0) / 2


def _caps_are_harmless(part: trimesh.Trimesh, loops: Sequence[Int64Array]) -> bool:
    """Return whether caps over all holes add no volume that the object does not have."""
    points = [part.vertices[loop] for loop in loops]
    areas = [_vector_area(p) for p in points]
    for i, (p, area) in enumerate(zip(points, areas)):
        if np.linalg.norm(area) < SMALL_HOLE * part.area:
            continue
        reach = np.sqrt(np.linalg.norm(area))
        # The other rim of a wall is near and runs in the opposite direction.
        if not any(np.linalg.norm(p.mean(axis=0) - q.mean(axis=0)) < 0.2 * reach
                   and area @ other < 0
                   for j, (q, other) in enumerate(zip(points, areas)) if j != i):
            return False
    return True


def _capped(part: trimesh.Trimesh, loops: Sequence[Int64Array]) -> trimesh.Trimesh:
    """Return the part with a fan of triangles over every loop."""
    vertices, faces = [np.asarray(part.vertices)], [np.asarray(part.faces)]
    count = len(part.vertices)
    for loop in loops:
        vertices.append(part.vertices[loop].mean(axis=0, keepdims=True))
        # Open edges follow their face, so the cap reverses them.
        faces.append(np.column_stack([np.roll(loop, -1), loop, np.full(len(loop), count)]))
        count += 1
    return trimesh.Trimesh(np.vstack(vertices), np.vstack(faces), process=False)


def _thickened(part: trimesh.Trimesh, loops: Sequence[Int64Array]) -> trimesh.Trimesh:
    """Return a sheet as a shell of thickness SHEET_M, half to each side, with closed rims."""
    # At a crease the middle line is longer than the thickness of the adjacent faces.
    lean = np.einsum('fkj,fj->fk', part.vertex_normals[part.faces], part.face_normals)
    count = np.bincount(part.faces.ravel(), minlength=len(part.vertices))
    lean = np.bincount(part.faces.ravel(), lean.ravel(), len(part.vertices)) / np.maximum(count, 1)
    offset = part.vertex_normals * (SHEET_M / 2 / np.maximum(lean, 0.4))[:, None]
    n = len(part.vertices)
    faces = [part.faces, part.faces[:, ::-1] + n]
    for loop in loops:
        after = np.roll(loop, -1)
        faces += [np.column_stack([after, loop, loop + n]),
                  np.column_stack([after, loop + n, after + n])]
    return trimesh.Trimesh(np.vstack([part.vertices + offset, part.vertices - offset]),
                           np.vstack(faces), process=False)


def _unite(parts: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh | None:
    """Return the union of closed parts; inverted parts inside others are cavities."""
    if sum(part.volume for part in parts) < 0 and all(part.volume < 0 for part in parts):
        for part in parts:
            part.invert()
    solids, cavities = [], []
    for part in parts:
        if part.volume < 0:
            part.invert()
            inside = any(other is not part and other.volume > part.volume
                         and (other.bounds[0] <= part.bounds[0]).all()
                         and (other.bounds[1] >= part.bounds[1]).all() for other in parts)
            (cavities if inside else solids).append(to_manifold(part))
        else:
            solids.append(to_manifold(part))
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    if cavities:
        union -= manifold3d.Manifold.batch_boolean(cavities, manifold3d.OpType.Add)
    if union.status() != manifold3d.Error.NoError or union.volume() <= 0:
        return None
    return from_manifold(union)
