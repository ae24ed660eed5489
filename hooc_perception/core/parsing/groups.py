# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Groups of points that objects leave, and which of them are the objects' own residue."""

from collections.abc import Sequence

from hooc_perception.core.arrays import BoolArray, Float64Array, Int64Array
from hooc_perception.core.geometry import matrix_from_pose, transform
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

# What lies so near to the surface of an object is its residue: generic meshes fit no better.
RESIDUE_M = 0.015
# Points are thinned to cells of this side, and belong together within this distance.
CELL_M, REACH_M = 0.008, 0.012


def near_surfaces(points: Float64Array, objects: Candidates,
                  models: Sequence[GenericModel]) -> BoolArray:
    """
    Return (n,) bool: which points (n, 3) lie at the surface of an object.

    :param objects: in the frame of the points; class id c is of models[c - 1].
    """
    if not len(objects) or not len(points):
        return np.zeros(len(points), bool)
    surfaces = []
    for i, model in enumerate(objects.shapes(models)):
        scale = objects.size[i] / np.maximum(model.extents, 1e-9)
        T = matrix_from_pose(objects.translation[i], objects.rotation_xyzw[i])
        surfaces.append(transform(T, model.surface_points * scale))
    return KDTree(np.concatenate(surfaces)).query(
        points, distance_upper_bound=RESIDUE_M)[0] < np.inf


def cells_of(points: Float64Array) -> tuple[Float64Array, Int64Array]:
    """Return ((c, 3) middles of the occupied cells, (n,) cell of each point), metres."""
    cells, cell = np.unique(np.floor(points / CELL_M).astype(np.int64), axis=0,
                            return_inverse=True)
    return ((cells + 0.5) * CELL_M).astype(np.float64), cell.ravel().astype(np.int64)


def grouped(points: Float64Array) -> tuple[Int64Array, Int64Array]:
    """
    Return ((n,) cell, (n,) connected group) of points (n, 3), n >= 1.

    Points above each other belong together.
    """
    middles, cell = cells_of(points)
    pairs = KDTree(middles).query_pairs(REACH_M, output_type='ndarray')
    above = KDTree(middles[:, :2]).query_pairs(0.75 * CELL_M, output_type='ndarray')
    pairs = np.concatenate([pairs, above])
    graph = coo_array((np.ones(len(pairs), bool), pairs.T), shape=(len(middles),) * 2)
    group = connected_components(graph, directed=False)[1].astype(np.int64)
    return cell, group[cell]
