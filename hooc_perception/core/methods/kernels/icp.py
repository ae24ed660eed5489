# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Iterative closest point against a fixed cloud with a nearest-neighbour lattice."""

from typing import NamedTuple

from hooc_perception.core.arrays import Float64Array, Int32Array
from hooc_perception.core.kernels.linalg import cholesky, cholesky_solve
import numba as nb
import numpy as np

# With fewer pairs six degrees of freedom are not determined.
FEWEST_PAIRS = 6
# Ridge, as a share of the trace: what the data leave free (a turn about an axis of symmetry)
# stays where it is.
RIDGE = 1e-9


class TargetCloud(NamedTuple):
    """
    A fixed cloud ready for nearest-neighbour look-ups; made by `core.methods.icp.target_cloud`.

    :ivar points: (P, 3) float64 metres; `normals` (P, 3) float64 unit, or zeros.
    :ivar grid: (nx, ny, nz) int32 nearest point of each node of a lattice with its first node
        at `origin` (3,) and steps of `cell` metres; it ends at least `margin` metres away from
        all points.
    :ivar graph: (P, k) int32 nearest neighbours of each point; (P, 0) = `nearest` does not walk.
    """

    points: Float64Array
    normals: Float64Array
    grid: Int32Array
    origin: Float64Array
    cell: float
    margin: float
    graph: Int32Array


class Passes(NamedTuple):
    """
    How to iterate.

    :ivar stride: every stride-th source point takes part.
    :ivar reach: pairs farther apart than this, metres, do not count.
    :ivar iterations: most steps.
    :ivar plane: minimise distances to the tangent planes of the target instead of its points.
    :ivar tolerance: stop when a step turns by fewer radians and moves by fewer metres than this
        times the spread of the source (one radian's worth of metres).
    """

    stride: int
    reach: float
    iterations: int
    plane: bool
    tolerance: float


class System(NamedTuple):
    """
    Normal equations A x = b of one Gauss-Newton step; x turns (3) about `centre`, then moves (3).

    :ivar A: (6, 6) float64, of which the lower triangle is filled; b (6,), centre (3,) metres.
    """

    A: Float64Array
    b: Float64Array
    centre: Float64Array


@nb.njit(cache=True, inline='always')
def _squared_distance(points: Float64Array, n: int, x: float, y: float, z: float) -> float:
    """Return the squared distance between points[n] and (x, y, z)."""
    return (points[n, 0] - x) ** 2 + (points[n, 1] - y) ** 2 + (points[n, 2] - z) ** 2


@nb.njit(cache=True)
def nearest(x: float, y: float, z: float, target: TargetCloud,
            reach: float) -> tuple[int, float]:
    """
    Return (index, squared distance) of the point nearest to (x, y, z); (-1, inf) beyond reach.

    The lattice names the point nearest to each of its nodes. The best of the eight nodes
    around the query starts a walk down the graph of neighbours, which ends at the nearest
    point, save for rare ties. Outside the lattice, which is `margin` away from all points,
    every point is tried.
    """
    points, grid, graph = target.points, target.grid, target.graph
    best, d2 = -1, np.inf
    u = (x - target.origin[0]) / target.cell
    v = (y - target.origin[1]) / target.cell
    w = (z - target.origin[2]) / target.cell
    if (u < 0.0 or v < 0.0 or w < 0.0 or u >= grid.shape[0] - 1 or v >= grid.shape[1] - 1
            or w >= grid.shape[2] - 1):
        if reach > target.margin:
            for n in range(points.shape[0]):
                other = _squared_distance(points, n, x, y, z)
                if other < d2:
                    best, d2 = n, other
    else:
        i, j, k = int(u), int(v), int(w)
        for corner in range(8):
            n = grid[i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)]
            if n != best:
                other = _squared_distance(points, n, x, y, z)
                if other < d2:
                    best, d2 = n, other
        walking = graph.shape[1] > 0
        while walking:
            here = best
            walking = False
            for e in range(graph.shape[1]):
                n = graph[here, e]
                other = _squared_distance(points, n, x, y, z)
                if other < d2:
                    best, d2 = n, other
                    walking = True
    if d2 > reach * reach:
        return -1, np.inf
    return best, d2


@nb.njit(cache=True)
def solve(A: Float64Array, b: Float64Array, x: Float64Array) -> bool:
    """
    Solve A x = b with a small ridge; the lower triangle of A (6, 6) is read and overwritten.

    :return: False where A is not positive definite; then x is without meaning.
    """
    trace = 0.0
    for i in range(6):
        trace += A[i, i]
    for i in range(6):
        A[i, i] += RIDGE * trace
    if not cholesky(A):
        return False
    x[:] = b
    cholesky_solve(A, x)
    return True


@nb.njit(cache=True)
def turn(R: Float64Array, t: Float64Array, x: Float64Array, centre: Float64Array) -> None:
    """
    Apply the twist x (rotation vector, translation) about `centre` to (R, t) in place.

    The rotation is Rodrigues' formula.
    """
    angle = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
    s = np.sin(angle) / angle if angle > 1e-12 else 1.0
    c = (1.0 - np.cos(angle)) / (angle * angle) if angle > 1e-6 else 0.5
    D = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            D[i, j] = c * x[i] * x[j]
        D[i, i] += np.cos(angle)
    D[0, 1] -= s * x[2]
    D[0, 2] += s * x[1]
    D[1, 0] += s * x[2]
    D[1, 2] -= s * x[0]
    D[2, 0] -= s * x[1]
    D[2, 1] += s * x[0]
    R_new = np.empty((3, 3))
    t_new = np.empty(3)
    for i in range(3):
        for j in range(3):
            R_new[i, j] = D[i, 0] * R[0, j] + D[i, 1] * R[1, j] + D[i, 2] * R[2, j]
        t_new[i] = (D[i, 0] * (t[0] - centre[0]) + D[i, 1] * (t[1] - centre[1])
                    + D[i, 2] * (t[2] - centre[2]) + centre[i] + x[3 + i])
    R[:] = R_new
    t[:] = t_new


@nb.njit(cache=True, inline='always')
def _add_plane_pair(A: Float64Array, b: Float64Array, arm: tuple[float, float, float],
                    gap: tuple[float, float, float], normal: Float64Array) -> None:
    """
    Add one pair of the point-to-plane error (normal . (gap - turn x arm - move))^2.

    :param arm: from the centre to the source point; gap: from there to the target point.
    """
    (ax, ay, az), (rx, ry, rz) = arm, gap
    nx, ny, nz = normal[0], normal[1], normal[2]
    g0, g1, g2 = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
    r = nx * rx + ny * ry + nz * rz
    A[0, 0] += g0 * g0
    A[1, 0] += g1 * g0
    A[1, 1] += g1 * g1
    A[2, 0] += g2 * g0
    A[2, 1] += g2 * g1
    A[2, 2] += g2 * g2
    A[3, 0] += nx * g0
    A[3, 1] += nx * g1
    A[3, 2] += nx * g2
    A[4, 0] += ny * g0
    A[4, 1] += ny * g1
    A[4, 2] += ny * g2
    A[5, 0] += nz * g0
    A[5, 1] += nz * g1
    A[5, 2] += nz * g2
    A[3, 3] += nx * nx
    A[4, 3] += ny * nx
    A[4, 4] += ny * ny
    A[5, 3] += nz * nx
    A[5, 4] += nz * ny
    A[5, 5] += nz * nz
    b[0] += g0 * r
    b[1] += g1 * r
    b[2] += g2 * r
    b[3] += nx * r
    b[4] += ny * r
    b[5] += nz * r


@nb.njit(cache=True, inline='always')
def _add_point_pair(A: Float64Array, b: Float64Array, arm: tuple[float, float, float],
                    gap: tuple[float, float, float]) -> None:
    """Add one pair of the point-to-point error |gap - turn x arm - move|^2, save A[3:, 3:]."""
    (ax, ay, az), (rx, ry, rz) = arm, gap
    A[0, 0] += ay * ay + az * az
    A[1, 1] += ax * ax + az * az
    A[2, 2] += ax * ax + ay * ay
    A[1, 0] -= ax * ay
    A[2, 0] -= ax * az
    A[2, 1] -= ay * az
    A[4, 0] -= az
    A[5, 0] += ay
    A[3, 1] += az
    A[5, 1] -= ax
    A[3, 2] -= ay
    A[4, 2] += ax
    b[0] += ay * rz - az * ry
    b[1] += az * rx - ax * rz
    b[2] += ax * ry - ay * rx
    b[3] += rx
    b[4] += ry
    b[5] += rz


@nb.njit(cache=True)
def _normal_equations(source: Float64Array, target: TargetCloud, R: Float64Array,
                      t: Float64Array, passes: Passes, system: System) -> tuple[int, float]:
    """
    Pair the posed source with the target and fill A and b of the system.

    :return: (number of pairs, sum of their squared distances).
    """
    A, b, centre = system.A, system.b, system.centre
    A[:] = 0.0
    b[:] = 0.0
    pairs, total = 0, 0.0
    for i in range(0, source.shape[0], passes.stride):
        p = source[i]
        qx = R[0, 0] * p[0] + R[0, 1] * p[1] + R[0, 2] * p[2] + t[0]
        qy = R[1, 0] * p[0] + R[1, 1] * p[1] + R[1, 2] * p[2] + t[1]
        qz = R[2, 0] * p[0] + R[2, 1] * p[1] + R[2, 2] * p[2] + t[2]
        m, d2 = nearest(qx, qy, qz, target, passes.reach)
        if m < 0:
            continue
        pairs += 1
        total += d2
        arm = qx - centre[0], qy - centre[1], qz - centre[2]
        gap = target.points[m, 0] - qx, target.points[m, 1] - qy, target.points[m, 2] - qz
        if passes.plane:
            _add_plane_pair(A, b, arm, gap, target.normals[m])
        else:
            _add_point_pair(A, b, arm, gap)
    if not passes.plane:
        for c in range(3, 6):
            A[c, c] = pairs
    return pairs, total


@nb.njit(cache=True)
def _centroid_and_spread(source: Float64Array) -> tuple[Float64Array, float]:
    """Return the mean (3,) of points (n, 3) and their root mean square distance from it."""
    n = source.shape[0]
    spread = 0.0
    middle = np.zeros(3)
    for i in range(n):
        for c in range(3):
            middle[c] += source[i, c] / n
    for i in range(n):
        for c in range(3):
            spread += (source[i, c] - middle[c]) ** 2 / n
    return middle, np.sqrt(spread) + 1e-12


@nb.njit(cache=True)
def align(source: Float64Array, target: TargetCloud, R: Float64Array, t: Float64Array,
          passes: Passes) -> tuple[int, int, float, bool]:
    """
    Move (R, t) = T_target_source, in place, so that the source lies on the target.

    Each step pairs the source points with the nearest target points within reach and takes one
    Gauss-Newton step of the sum of squared distances (`Passes`).

    :param source: (n, 3) float64.
    :return: (iterations done, pairs, root mean square distance of the pairs, converged).
    """
    middle, spread = _centroid_and_spread(source)
    system, x = System(np.empty((6, 6)), np.empty(6), np.empty(3)), np.zeros(6)
    pairs, total = 0, 0.0
    for iteration in range(passes.iterations + 1):
        for c in range(3):
            system.centre[c] = (R[c, 0] * middle[0] + R[c, 1] * middle[1] + R[c, 2] * middle[2]
                                + t[c])
        pairs, total = _normal_equations(source, target, R, t, passes, system)
        rms = np.sqrt(total / max(pairs, 1))
        if pairs < FEWEST_PAIRS or iteration == passes.iterations:
            return iteration, pairs, rms, False
        if not solve(system.A, system.b, x):
            return iteration, pairs, rms, False
        turn(R, t, x, system.centre)
        turned = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        moved = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
        if turned < passes.tolerance and moved < passes.tolerance * spread:
            return iteration + 1, pairs, rms, True
    return passes.iterations, pairs, np.sqrt(total / max(pairs, 1)), False
