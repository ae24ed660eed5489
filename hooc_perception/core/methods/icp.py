# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Iterative closest point: align a cloud to a fixed one, or to a generic model.

Own kernels rather than Open3D's because a scene of the `paper` profile takes 5,000 of them:
what a model's nearest-neighbour lattice costs is paid once a process. The tests hold the result
against Open3D's registration_icp.
"""

from dataclasses import dataclass

from hooc_perception.core.memo import per_model
from hooc_perception.core.methods.kernels import icp as kernels
import numpy as np
from scipy.spatial import cKDTree

# Steps along the longest side of the lattice, which is the cloud's box and a margin around it
# of half the longest side; a finer one only saves steps of the walk that follows the look-up.
CELLS = 32
MARGIN = 0.5
NEIGHBOURS = 12


@dataclass(frozen=True)
class TargetCloud:
    """
    A fixed cloud ready for nearest-neighbour look-ups; made by `target_cloud`.

    :ivar points: (P, 3) float64 metres; `normals` (P, 3) float64 unit, or zeros.
    :ivar grid: (nx, ny, nz) int32 nearest point of each node of a lattice with its first node
        at `origin` (3,) and steps of `cell`; it ends at least `margin` metres off all points.
    :ivar graph: (P, k) int32 nearest neighbours of each point.
    """

    points: np.ndarray
    normals: np.ndarray
    grid: np.ndarray
    origin: np.ndarray
    cell: float
    margin: float
    graph: np.ndarray


@dataclass(frozen=True)
class IcpResult:
    """
    An alignment with its evidence.

    :ivar T_target_source: (4, 4) float64.
    :ivar pairs: number of source points with a partner within reach.
    :ivar rms_m: root mean square distance of these pairs, metres.
    :ivar converged: whether the steps died out before the iterations ended.
    """

    T_target_source: np.ndarray
    iterations: int
    pairs: int
    rms_m: float
    converged: bool


def target_cloud(points, normals=None):
    """Return the TargetCloud of (P, 3) points in metres, P > 0, with optional normals."""
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
def model_cloud(model):
    """Return the TargetCloud of a GenericModel's surface samples, at its own size."""
    return target_cloud(model.surface_points, model.surface_normals)


def nearest(target, points, reach=np.inf):
    """
    Return (index (n,), distance (n,) metres) of the target's point nearest to each of `points`.

    Beyond `reach` metres they are -1 and inf.
    """
    index, distance = np.zeros(len(points), np.int64), np.zeros(len(points))
    for i, (x, y, z) in enumerate(np.asarray(points, np.float64)):
        index[i], d2 = kernels.nearest(x, y, z, target.points, target.grid, target.origin,
                                       target.cell, target.margin, target.graph, reach)
        distance[i] = np.sqrt(d2)
    return index, distance


def align(target, source, T_target_source, reach, iterations=50, plane=False, tolerance=1e-6):
    """
    Align a cloud to a fixed one by ICP.

    :param target: TargetCloud.
    :param source: (n, 3) metres, n >= 6.
    :param T_target_source: (4, 4) where to start.
    :param reach: pairs farther apart than this, metres, do not count.
    :param plane: minimise distances to tangent planes instead of points.
    :param tolerance: radians, and the same times the source's spread in metres.
    :return: IcpResult.
    """
    R, t = (np.array(T_target_source[:3, :3], np.float64, order='C'),
            np.array(T_target_source[:3, 3], np.float64))
    done, pairs, rms, converged = kernels.align(
        np.ascontiguousarray(source, np.float64), 1, target.points, target.normals, target.grid,
        target.origin, target.cell, target.margin, target.graph, R, t, reach, iterations, plane,
        tolerance)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return IcpResult(T, done, pairs, rms, converged)
