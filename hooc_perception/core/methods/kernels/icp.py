# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Iterative closest point against a fixed cloud with a nearest-neighbour lattice."""

import numba as nb
import numpy as np


@nb.njit(cache=True)
def nearest(x, y, z, points, grid, origin, cell, margin, graph, reach):
    """
    Return (index, squared distance) of the point nearest to (x, y, z); (-1, inf) beyond reach.

    The lattice names the point nearest to each of its nodes. The best of the eight nodes
    around the query starts a walk down the graph of neighbours, which ends at the nearest
    point, save for rare ties. Outside of the lattice, which is `margin` away from all points,
    every point is tried.

    :param grid: (nx, ny, nz) int32; `origin` (3,) its first node, `cell` its step, metres.
    :param graph: (P, k) int32 nearest neighbours of every point; (P, 0) = do not walk.
    """
    best, d2 = -1, np.inf
    u, v, w = (x - origin[0]) / cell, (y - origin[1]) / cell, (z - origin[2]) / cell
    if (u < 0.0 or v < 0.0 or w < 0.0 or u >= grid.shape[0] - 1 or v >= grid.shape[1] - 1
            or w >= grid.shape[2] - 1):
        if reach > margin:
            for n in range(points.shape[0]):
                other = ((points[n, 0] - x) ** 2 + (points[n, 1] - y) ** 2
                         + (points[n, 2] - z) ** 2)
                if other < d2:
                    best, d2 = n, other
    else:
        i, j, k = int(u), int(v), int(w)
        for corner in range(8):
            n = grid[i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)]
            if n != best:
                other = ((points[n, 0] - x) ** 2 + (points[n, 1] - y) ** 2
                         + (points[n, 2] - z) ** 2)
                if other < d2:
                    best, d2 = n, other
        walking = graph.shape[1] > 0
        while walking:
            here = best
            walking = False
            for e in range(graph.shape[1]):
                n = graph[here, e]
                other = ((points[n, 0] - x) ** 2 + (points[n, 1] - y) ** 2
                         + (points[n, 2] - z) ** 2)
                if other < d2:
                    best, d2 = n, other
                    walking = True
    if d2 > reach * reach:
        return -1, np.inf
    return best, d2


@nb.njit(cache=True)
def solve(A, b, x):
    """
    Solve A x = b by Cholesky, A (6, 6) symmetric; lower triangle is read, A is overwritten.

    A tiny multiple of the trace is added to the diagonal, so that what the data leave free (a
    turn about an axis of symmetry) stays where it is. Return whether A was positive definite.
    """
    trace = 0.0
    for i in range(6):
        trace += A[i, i]
    for i in range(6):
        A[i, i] += 1e-9 * trace
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            if i == j:
                if total <= 0.0:
                    return False
                A[i, i] = np.sqrt(total)
            else:
                A[i, j] = total / A[j, j]
    for i in range(6):
        total = b[i]
        for k in range(i):
            total -= A[i, k] * x[k]
        x[i] = total / A[i, i]
    for i in range(5, -1, -1):
        total = x[i]
        for k in range(i + 1, 6):
            total -= A[k, i] * x[k]
        x[i] = total / A[i, i]
    return True


@nb.njit(cache=True)
def turn(R, t, x, centre):
    """Apply the twist x (rotation vector, translation) about `centre` to (R, t) in place."""
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


@nb.njit(cache=True)
def align(source, stride, points, normals, grid, origin, cell, margin, graph, R, t, reach,
          iterations, plane, tolerance):
    """
    Move (R, t) = T_target_source, in place, so that the source lies on the target.

    Each step pairs every stride-th source point with the nearest target point within `reach`
    and takes one Gauss-Newton step of the sum of squared distances, to the points themselves
    or (`plane`) to their tangent planes.

    :param source: (n, 3) float64; `points`, `normals` (P, 3) float64: the target.
    :param tolerance: stop when a step turns by less radians and moves by less metres than this
        times the source's spread (one radian's worth of metres).
    :return: (iterations done, pairs, root mean square distance of the pairs, converged).
    """
    n = source.shape[0]
    spread = 0.0
    middle = np.zeros(3)
    for i in range(n):
        for c in range(3):
            middle[c] += source[i, c] / n
    for i in range(n):
        for c in range(3):
            spread += (source[i, c] - middle[c]) ** 2 / n
    spread = np.sqrt(spread) + 1e-12
    A, b, x, centre = np.empty((6, 6)), np.empty(6), np.zeros(6), np.empty(3)
    pairs, total = 0, 0.0
    for iteration in range(iterations + 1):
        A[:] = 0.0
        b[:] = 0.0
        pairs, total = 0, 0.0
        for c in range(3):
            centre[c] = R[c, 0] * middle[0] + R[c, 1] * middle[1] + R[c, 2] * middle[2] + t[c]
        for i in range(0, n, stride):
            p = source[i]
            qx = R[0, 0] * p[0] + R[0, 1] * p[1] + R[0, 2] * p[2] + t[0]
            qy = R[1, 0] * p[0] + R[1, 1] * p[1] + R[1, 2] * p[2] + t[1]
            qz = R[2, 0] * p[0] + R[2, 1] * p[1] + R[2, 2] * p[2] + t[2]
            m, d2 = nearest(qx, qy, qz, points, grid, origin, cell, margin, graph, reach)
            if m < 0:
                continue
            pairs += 1
            total += d2
            ax, ay, az = qx - centre[0], qy - centre[1], qz - centre[2]
            rx, ry, rz = points[m, 0] - qx, points[m, 1] - qy, points[m, 2] - qz
            if plane:
                nx, ny, nz = normals[m, 0], normals[m, 1], normals[m, 2]
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
            else:
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
        if not plane:
            for c in range(3, 6):
                A[c, c] = pairs
        rms = np.sqrt(total / max(pairs, 1))
        if pairs < 6 or iteration == iterations:
            return iteration, pairs, rms, False
        if not solve(A, b, x):
            return iteration, pairs, rms, False
        turn(R, t, x, centre)
        turned = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        moved = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
        if turned < tolerance and moved < tolerance * spread:
            return iteration + 1, pairs, rms, True
    return iterations, pairs, np.sqrt(total / max(pairs, 1)), False
