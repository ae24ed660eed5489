# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Iterative closest point: align a cloud to a fixed one, or to a generic model.

The `paper` profile runs 5,000 alignments per scene. Own kernels, rather than Open3D's, build the
nearest-neighbour lattice of a model only once per process. The tests compare the results with
Open3D's registration_icp.
"""

from dataclasses import dataclass

from hooc_perception.core.arrays import AnyArray, Float64Array, Int64Array
from hooc_perception.core.memo import per_model
from hooc_perception.core.methods.kernels import icp as kernels
from hooc_perception.core.methods.kernels.icp import Passes, TargetCloud
from hooc_perception.core.types import GenericModel
import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

# Steps along the longest side of the lattice, which is the cloud's box and a margin around it
# of half the longest side; a finer one only saves steps of the walk that follows the look-up.
CELLS = 32
MARGIN = 0.5
NEIGHBOURS = 12


@dataclass(frozen=True)
class IcpResult:
    """
    An alignment with its evidence.

    :ivar T_target_source: (4, 4) float64.
    :ivar iterations: steps done.
    :ivar pairs: number of source points with a partner within reach.
    :ivar rms_m: root mean square distance of these pairs, metres.
    :ivar converged: whether the steps became smaller than the tolerance.
    """

    T_target_source: Float64Array
    iterations: int
    pairs: int
    rms_m: float
    converged: bool


def target_cloud(points: AnyArray, normals: AnyArray | None = None) -> TargetCloud:
    """Return the TargetCloud of (P, 3) points in metres, P > 0, with optional normals (P, 3)."""
    points = np.ascontiguousarray(points, np.float64)
    normals = (np.zeros_like(points) if normals is None
               else np.ascontiguousarray(normals, np.float64))
    low, high = points.min(0), points.max(0)
    longest = max(float((high - low).max()), 1e-6)
    margin = MARGIN * longest
    cell = (longest + 2 * margin) / CELLS
    origin = low - margin
    shape = np.ceil((high + margin - origin) / cell).astype(int) + 1
    nodes = np.stack(np.meshgrid(*[origin[a] + cell * np.arange(shape[a]) for a in range(3)],
                                 indexing='ij'), -1).reshape(-1, 3)
    tree = cKDTree(points)
    grid = tree.query(nodes)[1].reshape(shape).astype(np.int32)
    k = min(NEIGHBOURS + 1, len(points))
    graph = tree.query(points, k=k)[1].reshape(len(points), k)[:, 1:].astype(np.int32)
    return TargetCloud(points, normals, grid, origin, float(cell), float(margin),
                       np.ascontiguousarray(graph))


@per_model
def model_cloud(model: GenericModel) -> TargetCloud:
    """Return the TargetCloud of a GenericModel's surface samples, at its own size."""
    return target_cloud(model.surface_points, model.surface_normals)


def nearest(target: TargetCloud, points: AnyArray,
            reach: float = np.inf) -> tuple[Int64Array, Float64Array]:
    """
    Return (index (n,), distance (n,) metres) of the target's point nearest to each of `points`.

    :param points: (n, 3) metres.
    :param reach: beyond this distance in metres the index is -1 and the distance inf.
    """
    index, distance = np.zeros(len(points), np.int64), np.zeros(len(points))
    for i, (x, y, z) in enumerate(np.asarray(points, np.float64)):
        index[i], d2 = kernels.nearest(x, y, z, target, reach)
        distance[i] = np.sqrt(d2)
    return index, distance


def align(target: TargetCloud, source: AnyArray, T_target_source: Float64Array, reach: float,
          iterations: int = 50, plane: bool = False, tolerance: float = 1e-6) -> IcpResult:
    """
    Align a cloud to a fixed one by ICP.

    :param source: (n, 3) metres, n >= 6.
    :param T_target_source: (4, 4) initial transform.
    :param reach: pairs farther apart than this, metres, do not count.
    :param plane: minimise distances to tangent planes instead of points.
    :param tolerance: radians, and the same times the source's spread in metres.
    """
    R, t = (np.array(T_target_source[:3, :3], np.float64, order='C'),
            np.array(T_target_source[:3, 3], np.float64))
    done, pairs, rms, converged = kernels.align(
        np.ascontiguousarray(source, np.float64), target, R, t,
        Passes(1, float(reach), iterations, plane, float(tolerance)))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return IcpResult(T, done, pairs, rms, converged)
