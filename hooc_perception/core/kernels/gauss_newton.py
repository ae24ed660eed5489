# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Pull a posed, scaled model onto the seen surface: one Gauss-Newton step in nine unknowns.

The unknowns are translation (3, world), rotation (3, world axes through the model's centre) and
log scale (3, model axes); the residuals are point-to-plane distances along measured normals.
Random steps (kernels/hypotheses.py, explain.py) see all of the cost but need dozens of trials to
find where to go; a pull sees only the agreeing surface but knows the way. They take turns.
"""

import numba as nb
import numpy as np

# Longest step that the linearisation is trusted for: metres, radians, log scale.
REACH = (0.02, 0.3, 0.15)
# Least and greatest scale of a hypothesis along an axis.
SCALES = (0.45, 2.0)
# Share of the agreeing points that hold an unknown back which they do not determine.
RIDGE = 0.02


@nb.njit(cache=True, inline='always')
def multiply(a, b, out):
    """Write the quaternion product a * b (xyzw) into out (4,)."""
    x = a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1]
    y = a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0]
    z = a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3]
    w = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]
    s = 1.0 / np.sqrt(x * x + y * y + z * z + w * w)
    out[0], out[1], out[2], out[3] = x * s, y * s, z * s, w * s


@nb.njit(cache=True, inline='always')
def accumulate(A, h, R, x, y, z, nx, ny, nz, residual, weight):
    """
    Add a point's equation to A (9, 10): J^T J, and J^T r in the last column.

    :param h: the hypothesis, R its rotation; (x, y, z) the model point, world.
    :param residual: metres along the measured normal (nx, ny, nz).
    """
    nx, ny, nz = np.float64(nx), np.float64(ny), np.float64(nz)
    px, py, pz = x - h[0], y - h[1], z - h[2]
    j3, j4, j5 = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
    j6 = ((R[0, 0] * nx + R[1, 0] * ny + R[2, 0] * nz)
          * (R[0, 0] * px + R[1, 0] * py + R[2, 0] * pz))
    j7 = ((R[0, 1] * nx + R[1, 1] * ny + R[2, 1] * nz)
          * (R[0, 1] * px + R[1, 1] * py + R[2, 1] * pz))
    j8 = ((R[0, 2] * nx + R[1, 2] * ny + R[2, 2] * nz)
          * (R[0, 2] * px + R[1, 2] * py + R[2, 2] * pz))
    # Called for every pixel of every trial: loops over a tuple take four times as long.
    _add(A, 0, weight * nx, nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)
    _add(A, 1, weight * ny, nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)
    _add(A, 2, weight * nz, nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)
    _add(A, 3, weight * j3, nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)
    _add(A, 4, weight * j4, nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)
    _add(A, 5, weight * j5, nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)
    _add(A, 6, weight * j6, nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)
    _add(A, 7, weight * j7, nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)
    _add(A, 8, weight * j8, nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)


@nb.njit(cache=True, inline='always')
def _add(A, row, w, a, b, c, d, e, f, g, i, j, k):
    """Add w times ten numbers to a row of A."""
    A[row, 0] += w * a
    A[row, 1] += w * b
    A[row, 2] += w * c
    A[row, 3] += w * d
    A[row, 4] += w * e
    A[row, 5] += w * f
    A[row, 6] += w * g
    A[row, 7] += w * i
    A[row, 8] += w * j
    A[row, 9] += w * k


@nb.njit(cache=True)
def pulled(A, n, h, prior, low, high, out):
    """
    Write the hypothesis one step along A from `h` into out (10,).

    :param n: sum of the weights in A; prior: cost of squared log scale, in units of a weight
        times a squared metre.
    :param low: least and `high` greatest scale.
    """
    L = np.zeros((9, 9))
    b = np.empty(9)
    for i in range(9):
        b[i] = -A[i, 9]
        hold = RIDGE * n * REACH[i // 3] ** -2 * 1e-4
        for j in range(i):
            L[i, j] = A[j, i]
        L[i, i] = A[i, i] * 1.02 + hold
        if i >= 6:
            L[i, i] += prior
            b[i] -= prior * np.log(h[1 + i])
    # Cholesky in place, then both triangular solves.
    for i in range(9):
        for j in range(i + 1):
            s = L[i, j]
            for k in range(j):
                s -= L[i, k] * L[j, k]
            if i == j:
                L[i, i] = np.sqrt(max(s, 1e-12))
            else:
                L[i, j] = s / L[j, j]
    for i in range(9):
        for k in range(i):
            b[i] -= L[i, k] * b[k]
        b[i] /= L[i, i]
    for i in range(8, -1, -1):
        for k in range(i + 1, 9):
            b[i] -= L[k, i] * b[k]
        b[i] /= L[i, i]
    shrink = 1.0
    for part in range(3):
        length = np.sqrt(b[3 * part] ** 2 + b[3 * part + 1] ** 2 + b[3 * part + 2] ** 2)
        if length * shrink > REACH[part]:
            shrink = REACH[part] / length
    for i in range(9):
        b[i] *= shrink
    out[:] = h[:10]
    for i in range(3):
        out[i] += b[i]
        out[7 + i] = min(high, max(low, h[7 + i] * np.exp(b[6 + i])))
    q = np.array((b[3] / 2, b[4] / 2, b[5] / 2, 1.0))
    multiply(q, out[3:7], out[3:7])


@nb.njit(cache=True)
def stepped(sigma_t, sigma_r, sigma_s, step, yaw, q, trial):
    """
    Move a hypothesis (10,) by a random step, in place: place, rotation, sizes or some of them.

    :param sigma_t: metres, `sigma_r` radians, `sigma_s` log scale, all times `step`.
    :param yaw: how much farther it turns about the vertical.
    :param q: (4,) scratch.
    """
    part = np.random.random()
    if part < 0.75:
        for k in range(3):
            trial[k] += np.random.normal() * sigma_t * step
    if part > 0.4:
        q[0] = np.random.normal() * sigma_r * step / 2
        q[1] = np.random.normal() * sigma_r * step / 2
        q[2] = np.random.normal() * sigma_r * step / 2 * yaw
        q[3] = 1.0
        multiply(q, trial[3:7], trial[3:7])
    if part > 0.6 or part < 0.2:
        for k in range(3):
            trial[7 + k] = min(SCALES[1], max(SCALES[0], trial[7 + k] * np.exp(
                np.random.normal() * sigma_s * step)))
