# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Linear algebra of small symmetric matrices.

LAPACK would serve as well, but a call costs ten times as much as a 3 x 3 or 9 x 9 problem.
"""

from hooc_perception.core.arrays import Float64Array
import numba as nb
import numpy as np


@nb.njit(cache=True)
def smallest_eigenvector(C: Float64Array) -> Float64Array:
    """
    Return (3,), the unit eigenvector of the smallest eigenvalue of a symmetric (3, 3) matrix.

    In closed form, by the trigonometric solution of the characteristic polynomial (Smith 1961):
    faster than `eigen_jacobi`, less accurate where the two smaller eigenvalues nearly agree.
    That suits normals, which are without meaning there. A multiple of the identity gives
    (0, 0, 1).
    """
    q = (C[0, 0] + C[1, 1] + C[2, 2]) / 3
    p2 = ((C[0, 0] - q) ** 2 + (C[1, 1] - q) ** 2 + (C[2, 2] - q) ** 2
          + 2 * (C[0, 1] ** 2 + C[0, 2] ** 2 + C[1, 2] ** 2))
    p = np.sqrt(p2 / 6) + 1e-30
    b00, b11, b22 = (C[0, 0] - q) / p, (C[1, 1] - q) / p, (C[2, 2] - q) / p
    b01, b02, b12 = C[0, 1] / p, C[0, 2] / p, C[1, 2] / p
    det = (b00 * (b11 * b22 - b12 * b12) - b01 * (b01 * b22 - b12 * b02)
           + b02 * (b01 * b12 - b11 * b02)) / 2
    phi = np.arccos(min(1.0, max(-1.0, det))) / 3
    lam = q + 2 * p * np.cos(phi + 2 * np.pi / 3)
    a0, a1, a2 = C[0, 0] - lam, C[1, 1] - lam, C[2, 2] - lam
    best = np.zeros(3)
    norm = -1.0
    # The eigenvector is the cross product of two rows of C - lam; take the most stable pair.
    for k in range(3):
        if k == 0:
            x, y, z = (C[0, 1] * C[1, 2] - C[0, 2] * a1, C[0, 2] * C[0, 1] - a0 * C[1, 2],
                       a0 * a1 - C[0, 1] * C[0, 1])
        elif k == 1:
            x, y, z = (C[0, 1] * a2 - C[0, 2] * C[1, 2], C[0, 2] * C[0, 2] - a0 * a2,
                       a0 * C[1, 2] - C[0, 1] * C[0, 2])
        else:
            x, y, z = (a1 * a2 - C[1, 2] * C[1, 2], C[1, 2] * C[0, 2] - C[0, 1] * a2,
                       C[0, 1] * C[1, 2] - a1 * C[0, 2])
        m = x * x + y * y + z * z
        if m > norm:
            norm = m
            best[0], best[1], best[2] = x, y, z
    if norm < 1e-40:
        best[0], best[1], best[2] = 0.0, 0.0, 1.0
        return best
    return best / np.sqrt(norm)


@nb.njit(cache=True, error_model='numpy')
def eigen_jacobi(a: Float64Array, v: Float64Array) -> None:
    """
    Diagonalize a symmetric (3, 3) matrix in place; v (3, 3) gets the eigenvectors as columns.

    Cyclic Jacobi rotations (Golub & Van Loan, 8.5): all eigenvalues, unordered, and eigenvectors
    to machine precision, at several times the cost of `smallest_eigenvector`.
    """
    for i in range(3):
        for j in range(3):
            v[i, j] = 1.0 if i == j else 0.0
    for _ in range(12):
        off = abs(a[0, 1]) + abs(a[0, 2]) + abs(a[1, 2])
        if off <= 1e-12 * (abs(a[0, 0]) + abs(a[1, 1]) + abs(a[2, 2])):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] == 0.0:
                    continue
                theta = 0.5 * (a[q, q] - a[p, p]) / a[p, q]
                t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
                if theta < 0:
                    t = -t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    x, y = a[k, p], a[k, q]
                    a[k, p], a[k, q] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = a[p, k], a[q, k]
                    a[p, k], a[q, k] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = v[k, p], v[k, q]
                    v[k, p], v[k, q] = c * x - s * y, s * x + c * y


@nb.njit(cache=True)
def cholesky(A: Float64Array) -> bool:
    """
    Replace the lower triangle of a symmetric (n, n) matrix by its Cholesky factor.

    :return: False, with A half done, where A is not positive definite.
    """
    for i in range(A.shape[0]):
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
    return True


@nb.njit(cache=True)
def cholesky_clamped(A: Float64Array, least: float) -> None:
    """
    Do what `cholesky` does, but raise squared pivots below `least` to it and never fail.

    For a matrix that is positive definite up to rounding, where some step is wanted in any case.
    """
    for i in range(A.shape[0]):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            if i == j:
                A[i, i] = np.sqrt(max(total, least))
            else:
                A[i, j] = total / A[j, j]


@nb.njit(cache=True)
def cholesky_solve(L: Float64Array, x: Float64Array) -> None:
    """Replace the right side x (n,) of L L^T x = b by the solution; L from `cholesky`."""
    n = L.shape[0]
    for i in range(n):
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]
