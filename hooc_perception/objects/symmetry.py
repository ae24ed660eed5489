# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Find a mesh's rotation symmetries about its axes by comparing it with rotated copies."""

from hooc_perception.core.arrays import Float64Array, Int32Array
import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue] (no stub)
from scipy.spatial.transform import Rotation
import trimesh

# A rotated surface is the same if 98 % of it lies within this share of its greatest distance
# from the axis: low enough to see a teacup's handle or the two widths of a box, high enough for
# the facets of a hexagonal pencil to count as round. For thin objects the share of the thinnest
# side counts: a knife's blade differs from its handle.
TOLERANCE = 0.07
TOLERANCE_THIN = 0.12
QUANTILE = 0.98
SAMPLES, DENSE = 500, 12000
ORDERS = (6, 4, 3, 2)
REVOLUTION_DEG = (11.0, 47.0, 77.0, 133.0)


def axis_symmetry(mesh: trimesh.Trimesh, rng: np.random.Generator) -> Int32Array:
    """
    Return the order of symmetry about x, y, z, (3,) int32: 1 none, 2, 3, 4, 6, 0 revolution.

    The axes pass through the bounding-box centre, which is the model's origin.

    :param mesh: centred.
    :param rng: for the surface samples.
    """
    dense = cKDTree(trimesh.sample.sample_surface(mesh, DENSE, seed=rng)[0])
    samples = trimesh.sample.sample_surface(mesh, SAMPLES, seed=rng)[0]
    # The distance that is due to sampling alone, without any rotation.
    floor = np.quantile(dense.query(samples)[0], QUANTILE)
    out = np.ones(3, np.int32)
    for axis in range(3):
        radius = np.linalg.norm(np.delete(mesh.vertices, axis, axis=1), axis=1).max()
        limit = floor + min(TOLERANCE * radius, TOLERANCE_THIN * mesh.extents.min())

        def same(degrees: float, axis: int = axis, limit: float = limit) -> bool:
            turned = Rotation.from_euler('xyz'[axis], degrees, degrees=True).apply(samples)
            return np.quantile(dense.query(turned)[0], QUANTILE) <= limit

        if all(same(degrees) for degrees in REVOLUTION_DEG):
            out[axis] = 0
        else:
            out[axis] = next((n for n in ORDERS if same(360.0 / n)), 1)
    return out


def equivalent_directions(direction: Float64Array, symmetry: Int32Array) -> Float64Array:
    """
    Return the (n, 3) directions equivalent to `direction` (3,) by symmetry, itself included.

    Two continuous axes make a ball, for which this is meaningless: see is_ball.
    """
    out = np.asarray(direction, np.float64)[None]
    # Rotations about each axis in turn, twice, reach the whole group of two- and four-fold
    # axes as well as a continuous axis with its perpendicular flips.
    for axis in (0, 1, 2, 0, 1):
        order = 72 if symmetry[axis] == 0 else int(symmetry[axis])
        turned = [Rotation.from_euler('xyz'[axis], 360.0 * k / order, degrees=True).apply(out)
                  for k in range(1, order)]
        out = np.unique(np.round(np.concatenate([out, *turned]), 6), axis=0)
    return out


def is_ball(symmetry: Int32Array) -> bool:
    """Return whether all directions are equivalent."""
    return int(np.sum(np.asarray(symmetry) == 0)) >= 2
