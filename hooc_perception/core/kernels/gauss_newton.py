# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
One Gauss-Newton step of a posed, scaled model towards the measured surface.

The nine unknowns are translation (3, metres, world), rotation (3, radians, about world axes
through the model's centre) and log scale (3, model axes). The residuals r are distances along
measured normals (point to plane); with J their derivatives and w their weights, the step solves

    (sum w J J^T + damping) step = -sum w r J

Random steps (core/kernels/pose.py) see the whole cost but need dozens of trials to find a way
down; a Gauss-Newton step sees only the points that agree but has a descent direction. Refinement
alternates between them.
"""

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.kernels.linalg import cholesky_clamped, cholesky_solve
from hooc_perception.core.kernels.pose import quaternion_multiply, QW, QX, SX, TX, WIDTH
import numba as nb
import numpy as np

# Rows of the equations, and their columns: sum w J J^T, then sum w r J.
UNKNOWNS = 9
COLUMNS = UNKNOWNS + 1
RIGHT_SIDE = UNKNOWNS
# First unknown of each kind.
ROTATION, LOG_SCALE = 3, 6
# Longest step that the linearization is trusted for: metres, radians, log scale.
MAX_STEP = (0.02, 0.3, 0.15)
# Levenberg-Marquardt damping, relative to the diagonal.
DAMPING = 1.02
# Ridge: a step of MAX_STEP costs as much as a squared residual of RIDGE_M2 at this share of the
# points. It holds back unknowns that the points do not determine.
RIDGE, RIDGE_M2 = 0.02, 1e-4
LEAST_PIVOT = 1e-12

Triple = tuple[float, float, float]


@nb.njit(cache=True, inline='always')
def add_equation(A: Float64Array, h: Float64Array, R: Float64Array,
                 point: Triple, normal: Triple, residual: float, weight: float) -> None:
    """
    Add the equation of one point to A (9, 10).

    :param h: the hypothesis, `R` (3, 3) its rotation.
    :param point: model point in the world, metres.
    :param normal: measured normal; `residual` metres from the measured surface along it.
    """
    x, y, z = point
    nx, ny, nz = np.float64(normal[0]), np.float64(normal[1]), np.float64(normal[2])
    px, py, pz = x - h[TX], y - h[TX + 1], z - h[TX + 2]
    j3, j4, j5 = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
    j6 = ((R[0, 0] * nx + R[1, 0] * ny + R[2, 0] * nz)
          * (R[0, 0] * px + R[1, 0] * py + R[2, 0] * pz))
    j7 = ((R[0, 1] * nx + R[1, 1] * ny + R[2, 1] * nz)
          * (R[0, 1] * px + R[1, 1] * py + R[2, 1] * pz))
    j8 = ((R[0, 2] * nx + R[1, 2] * ny + R[2, 2] * nz)
          * (R[0, 2] * px + R[1, 2] * py + R[2, 2] * pz))
    # Called for every pixel of every trial: a loop over the rows takes four times as long.
    row = (nx, ny, nz, j3, j4, j5, j6, j7, j8, residual)
    _add_row(A, 0, weight * nx, row)
    _add_row(A, 1, weight * ny, row)
    _add_row(A, 2, weight * nz, row)
    _add_row(A, 3, weight * j3, row)
    _add_row(A, 4, weight * j4, row)
    _add_row(A, 5, weight * j5, row)
    _add_row(A, 6, weight * j6, row)
    _add_row(A, 7, weight * j7, row)
    _add_row(A, 8, weight * j8, row)


@nb.njit(cache=True, inline='always')
def _add_row(A: Float64Array, k: int, factor: float, row: tuple[float, ...]) -> None:
    """Add `factor` times a row of ten numbers to row k of A."""
    A[k, 0] += factor * row[0]
    A[k, 1] += factor * row[1]
    A[k, 2] += factor * row[2]
    A[k, 3] += factor * row[3]
    A[k, 4] += factor * row[4]
    A[k, 5] += factor * row[5]
    A[k, 6] += factor * row[6]
    A[k, 7] += factor * row[7]
    A[k, 8] += factor * row[8]
    A[k, 9] += factor * row[9]


@nb.njit(cache=True)
def gauss_newton_step(A: Float64Array, n: float, h: Float64Array, prior: float,
                      scale_limits: tuple[float, float], out: Float64Array) -> None:
    """
    Write the hypothesis one step from `h` into out (10,).

    The step is shortened as a whole to the longest that the linearization is trusted for.

    :param A: (9, 10) float64 from add_equation.
    :param n: sum of the weights in A.
    :param prior: cost of the squared log scale, in units of a weight times a squared metre.
    :param scale_limits: least and greatest scale of the result along an axis.
    """
    L, step = _damped(A, n, h, prior)
    cholesky_clamped(L, LEAST_PIVOT)
    cholesky_solve(L, step)
    _shorten(step)
    low, high = scale_limits
    out[:] = h[:WIDTH]
    for i in range(3):
        out[TX + i] += step[i]
        out[SX + i] = min(high, max(low, h[SX + i] * np.exp(step[LOG_SCALE + i])))
    q = np.array((step[ROTATION] / 2, step[ROTATION + 1] / 2, step[ROTATION + 2] / 2, 1.0))
    quaternion_multiply(q, out[QX:QW + 1], out[QX:QW + 1])


@nb.njit(cache=True)
def _damped(A: Float64Array, n: float, h: Float64Array, prior: float,
            ) -> tuple[Float64Array, Float64Array]:
    """Return the lower triangle (9, 9) and the right side (9,) of the damped equations."""
    L = np.zeros((UNKNOWNS, UNKNOWNS))
    b = np.empty(UNKNOWNS)
    for i in range(UNKNOWNS):
        b[i] = -A[i, RIGHT_SIDE]
        hold = RIDGE * n * MAX_STEP[i // 3] ** -2 * RIDGE_M2
        for j in range(i):
            L[i, j] = A[j, i]
        L[i, i] = A[i, i] * DAMPING + hold
        if i >= LOG_SCALE:
            L[i, i] += prior
            b[i] -= prior * np.log(h[SX + i - LOG_SCALE])
    return L, b


@nb.njit(cache=True)
def _shorten(step: Float64Array) -> None:
    """Scale a step (9,) down, in place, so that no part of it exceeds MAX_STEP."""
    shrink = 1.0
    for part in range(3):
        length = np.sqrt(step[3 * part] ** 2 + step[3 * part + 1] ** 2 + step[3 * part + 2] ** 2)
        if length * shrink > MAX_STEP[part]:
            shrink = MAX_STEP[part] / length
    for i in range(UNKNOWNS):
        step[i] *= shrink
