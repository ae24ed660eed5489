# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Rebuild any triangle soup as a solid: the level set of a field on a grid.

The field combines generalized winding number (Jacobson et al. 2013) and distance.
"""

from collections.abc import Callable

from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.objects.manifold import from_manifold, SHEET_M
import manifold3d
import numba as nb
import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue] (no stub)
import trimesh

# Limit on grid points times samples; bounds the time to a second or two.
GRID_WORK = 1.5e8
SOUP_SAMPLES = 2000


def level_set_solid(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """
    Return the solid of points whose winding number exceeds 1/2 or that are near a sheet.

    A sheet is a part of the surface with neither side inside. The result's surface lies within
    about one grid cell, longest side / 48 for small meshes, of the given one.
    """
    samples, face = trimesh.sample.sample_surface(mesh, SOUP_SAMPLES, seed=0)[:2]
    normals = np.ascontiguousarray(mesh.face_normals[face])
    samples = np.ascontiguousarray(samples)
    step = max(mesh.extents.max() / 48, SHEET_M / 2,
               np.cbrt(np.prod(mesh.extents + 2 * SHEET_M) * len(samples) / GRID_WORK))
    reach = max(SHEET_M / 2, 0.6 * step)

    def inside(points: Float64Array) -> BoolArray:
        return np.abs(_winding(points, samples, normals, mesh.area / len(samples))) > 0.5

    lower = mesh.bounds[0] - 2 * step
    axes = [np.arange(a, b + 3 * step, step) for a, b in zip(lower, mesh.bounds[1])]
    grid = np.stack(np.meshgrid(*axes, indexing='ij'), -1).reshape(-1, 3)
    dense, face = trimesh.sample.sample_surface(mesh, 10 * SOUP_SAMPLES, seed=0)[:2]
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


def _trilinear(field: Float64Array, lower: Float64Array,
               step: float) -> Callable[[float, float, float], float]:
    """Return f(x, y, z) of values on a grid; plain Python, since it is called per point."""
    x0, y0, z0 = lower.tolist()
    nx, ny, nz = field.shape
    along_x, along_y = ny * nz, nz
    values = field.ravel().tolist()

    def at(x: float, y: float, z: float) -> float:
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
def _winding(points: Float64Array, samples: Float64Array, normals: Float64Array,
             area: float) -> Float64Array:
    """Return the generalized winding number (n,) of points, with samples as dipoles."""
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
