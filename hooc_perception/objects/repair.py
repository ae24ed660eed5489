# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Turn any triangle mesh into a solid, for the overlap term of Eq. 1.

The paper left out two categories whose meshes were not watertight (dustpan, tray); here every
mesh gets a volume. The rules, applied to each connected part:

1. watertight: kept; turned inside out where its volume is negative and it is no cavity;
2. small holes, and pairs of holes that close each other (the rim of a double wall): capped;
3. other sheets (an open vessel modelled without thickness): thickened to SHEET_M, so that an
   open vessel keeps its cavity;
4. what is still no manifold after that: rebuilt as a level set of generalized winding number
   and distance (Jacobson et al. 2013) on a grid.

The parts are then united, so that parts that overlap are counted once.
"""

import manifold3d
import numba as nb
import numpy as np
from scipy.spatial import cKDTree
import trimesh

SHEET_M = 0.0025
# A hole is small when its cap has less than this share of the part's area.
SMALL_HOLE = 0.02
MAX_PARTS = 300
# Grid points times samples, at most, in the level set; bounds its time to a second or two.
GRID_WORK = 1.5e8
SOUP_SAMPLES = 2000


def closed(mesh):
    """
    Return a watertight trimesh.Trimesh of positive volume that stands for the mesh.

    :param mesh: trimesh.Trimesh in metres, finite; need not be watertight, consistently
        wound or free of self-intersections.
    """
    parts = [_solid_part(part) for part in _parts(mesh)]
    if parts and all(part is not None for part in parts):
        solid = _unite(parts)
        if solid is not None:
            return solid
    return _level_set(mesh)


def to_manifold(mesh):
    """Return the manifold3d.Manifold of a mesh; its status tells whether it is one."""
    return manifold3d.Manifold(manifold3d.Mesh64(
        np.array(mesh.vertices, np.float64, order='C'),
        np.array(mesh.faces, np.uint64, order='C')))


def from_manifold(solid):
    """Return the trimesh.Trimesh of a manifold3d.Manifold."""
    out = solid.to_mesh64()
    return trimesh.Trimesh(np.array(out.vert_properties[:, :3]),
                           np.array(out.tri_verts, np.int64), process=False)


def _is_solid(mesh):
    """Tell whether manifold3d accepts the mesh as an oriented, closed surface."""
    return (len(mesh.faces) >= 4 and mesh.is_watertight and mesh.is_winding_consistent
            and to_manifold(mesh).status() == manifold3d.Error.NoError)


def _parts(mesh):
    """
    Return the parts of a mesh that share edges, each consistently wound where possible.

    A soup of more than MAX_PARTS has no parts that mean anything: the list is empty then.
    """
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    labels = trimesh.graph.connected_component_labels(mesh.face_adjacency, len(mesh.faces))
    if labels.max() >= MAX_PARTS:
        return []
    if not mesh.is_winding_consistent:
        trimesh.repair.fix_winding(mesh)
    return list(mesh.split(only_watertight=False))


def _solid_part(part):
    """Return a closed mesh of one connected part (its winding may be inverted), or None."""
    if not _is_solid(part):
        loops = _boundary_loops(part)
        if loops is None or not part.is_winding_consistent:
            return None
        part = (_capped if _caps_are_harmless(part, loops) else _thickened)(part, loops)
        if not _is_solid(part):
            return None
    return part


def _boundary_loops(part):
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


def _vector_area(points):
    """Return half the sum of cross products around a closed polygon (n, 3): (3,) m^2."""
    centred = points - points.mean(axis=0)
    return np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0) / 2


def _caps_are_harmless(part, loops):
    """Tell whether caps over all holes add no volume that the object has not."""
    points = [part.vertices[loop] for loop in loops]
    areas = [_vector_area(p) for p in points]
    for i, (p, area) in enumerate(zip(points, areas)):
        if np.linalg.norm(area) < SMALL_HOLE * part.area:
            continue
        reach = np.sqrt(np.linalg.norm(area))
        # The other rim of a wall lies close by and runs the other way round.
        if not any(np.linalg.norm(p.mean(axis=0) - q.mean(axis=0)) < 0.2 * reach
                   and area @ other < 0
                   for j, (q, other) in enumerate(zip(points, areas)) if j != i):
            return False
    return True


def _capped(part, loops):
    """Return the part with a fan of triangles over every loop."""
    vertices, faces = [part.vertices], [part.faces]
    count = len(part.vertices)
    for loop in loops:
        vertices.append(part.vertices[loop].mean(axis=0, keepdims=True))
        # Open edges run along their face, so the cap takes them the other way round.
        faces.append(np.column_stack([np.roll(loop, -1), loop, np.full(len(loop), count)]))
        count += 1
    return trimesh.Trimesh(np.vstack(vertices), np.vstack(faces), process=False)


def _thickened(part, loops):
    """Return a sheet as a shell of thickness SHEET_M, half to each side, with closed rims."""
    # At a crease the middle line is longer than the thickness of the faces that meet there.
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


def _unite(parts):
    """Return the union of closed parts as one mesh; inverted parts inside others are cavities."""
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


def _level_set(mesh):
    """
    Return the solid of points whose winding number is over 1/2 or that are near a sheet.

    Works for any triangle soup. A sheet is where neither side of the surface is inside. The
    result's surface lies within about one grid cell, longest side / 48 for small meshes, of
    the given one.
    """
    samples, face = trimesh.sample.sample_surface(mesh, SOUP_SAMPLES, seed=0)
    normals = np.ascontiguousarray(mesh.face_normals[face])
    samples = np.ascontiguousarray(samples)
    step = max(mesh.extents.max() / 48, SHEET_M / 2,
               np.cbrt(np.prod(mesh.extents + 2 * SHEET_M) * len(samples) / GRID_WORK))
    reach = max(SHEET_M / 2, 0.6 * step)

    def inside(points):
        return np.abs(_winding(points, samples, normals, mesh.area / len(samples))) > 0.5

    lower = mesh.bounds[0] - 2 * step
    axes = [np.arange(a, b + 3 * step, step) for a, b in zip(lower, mesh.bounds[1])]
    grid = np.stack(np.meshgrid(*axes, indexing='ij'), -1).reshape(-1, 3)
    dense, face = trimesh.sample.sample_surface(mesh, 10 * SOUP_SAMPLES, seed=0)
    beside = 2 * reach * mesh.face_normals[face]
    sheet = dense[~inside(dense + beside) & ~inside(dense - beside)]
    field = cKDTree(dense).query(grid)[0]
    field = np.where(inside(grid), field, -field)
    if len(sheet):
        field = np.maximum(field, reach - cKDTree(sheet).query(grid)[0])
    field = field.reshape([len(a) for a in axes])
    solid = manifold3d.Manifold.level_set(_trilinear(field, lower, step),
                                          [*lower, *(lower + (np.array(field.shape) - 1) * step)],
                                          step)
    return from_manifold(solid.simplify(step / 4))


def _trilinear(field, lower, step):
    """Return f(x, y, z) of values on a grid; plain Python, as it is called point by point."""
    x0, y0, z0 = lower.tolist()
    nx, ny, nz = field.shape
    along_x, along_y = ny * nz, nz
    values = field.ravel().tolist()

    def at(x, y, z):
        x, y, z = (x - x0) / step, (y - y0) / step, (z - z0) / step
        if not (0 <= x < nx - 1 and 0 <= y < ny - 1 and 0 <= z < nz - 1):
            return -step
        i, j, k = int(x), int(y), int(z)
        x, y, z = x - i, y - j, z - k
        n = i * along_x + j * along_y + k
        low = ((values[n] * (1 - z) + values[n + 1] * z) * (1 - y)
               + (values[n + along_y] * (1 - z) + values[n + along_y + 1] * z) * y)
        n += along_x
        high = ((values[n] * (1 - z) + values[n + 1] * z) * (1 - y)
                + (values[n + along_y] * (1 - z) + values[n + along_y + 1] * z) * y)
        return low * (1 - x) + high * x
    return at


@nb.njit(cache=True)
def _winding(points, samples, normals, area):
    """Return the generalized winding number (n,) of points, the surface taken as dipoles."""
    out = np.zeros(len(points))
    for i in range(len(points)):
        total = 0.0
        for j in range(len(samples)):
            x = samples[j, 0] - points[i, 0]
            y = samples[j, 1] - points[i, 1]
            z = samples[j, 2] - points[i, 2]
            r2 = max(x * x + y * y + z * z, 1e-12)
            total += (x * normals[j, 0] + y * normals[j, 1] + z * normals[j, 2]) / (
                r2 * np.sqrt(r2))
        out[i] = total * area / (4.0 * np.pi)
    return out
