# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Find a mesh's rotation symmetries about its own axes by comparing it with itself turned."""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
import trimesh

# A turned surface is the same when 98 % of it comes to lie within this share of its greatest
# distance from the axis: low enough to see a teacup's handle or the two widths of a box, high
# enough for the facets of a hexagonal pencil to count as round. For thin
# things the share of the thinnest side counts: a knife's blade is not like its handle.
TOLERANCE = 0.07
TOLERANCE_THIN = 0.12
QUANTILE = 0.98
SAMPLES, DENSE = 500, 12000
ORDERS = (6, 4, 3, 2)
REVOLUTION_DEG = (11.0, 47.0, 77.0, 133.0)


def axis_symmetry(mesh, rng):
    """
    Return the order of symmetry about x, y, z, (3,) int32: 1 none, 2, 3, 4, 6, 0 revolution.

    The axes pass through the bounding-box centre, which is the model's origin.

    :param mesh: trimesh.Trimesh, centred.
    :param rng: numpy Generator for the surface samples.
    """
    dense = cKDTree(trimesh.sample.sample_surface(mesh, DENSE, seed=rng)[0])
    samples = trimesh.sample.sample_surface(mesh, SAMPLES, seed=rng)[0]
    # What sampling alone costs, turned by nothing.
    floor = np.quantile(dense.query(samples)[0], QUANTILE)
    out = np.ones(3, np.int32)
    for axis in range(3):
        radius = np.linalg.norm(np.delete(mesh.vertices, axis, axis=1), axis=1).max()
        limit = floor + min(TOLERANCE * radius, TOLERANCE_THIN * mesh.extents.min())

        def same(degrees, axis=axis, limit=limit):
            turned = Rotation.from_euler('xyz'[axis], degrees, degrees=True).apply(samples)
            return np.quantile(dense.query(turned)[0], QUANTILE) <= limit

        if all(same(degrees) for degrees in REVOLUTION_DEG):
            out[axis] = 0
        else:
            out[axis] = next((n for n in ORDERS if same(360.0 / n)), 1)
    return out


def equivalent_directions(direction, symmetry):
    """
    Return (n, 3) directions that the symmetry cannot tell from `direction` (3,), itself included.

    Two continuous axes make a ball, for which this is meaningless: see is_ball.
    """
    out = np.asarray(direction, np.float64)[None]
    # Turning about each axis in turn, twice over, reaches the whole group of two- and four-fold
    # axes as well as a continuous axis with its perpendicular flips.
    for axis in (0, 1, 2, 0, 1):
        order = 72 if symmetry[axis] == 0 else int(symmetry[axis])
        turned = [Rotation.from_euler('xyz'[axis], 360.0 * k / order, degrees=True).apply(out)
                  for k in range(1, order)]
        out = np.unique(np.round(np.concatenate([out, *turned]), 6), axis=0)
    return out


def is_ball(symmetry):
    """Tell whether every direction is like every other."""
    return int(np.sum(np.asarray(symmetry) == 0)) >= 2
