# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Eigenvectors and Cholesky solves of small matrices against numpy."""

from hooc_perception.core.kernels import linalg as kernel
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


@pytest.mark.parametrize('eigenvalues', [(1e-6, 2e-5, 3e-5), (0.0, 1e-5, 1e-5), (1e-7, 1e-6, 1.0),
                                         (1.0, 2.0, 4.0)])
def test_smallest_eigenvector(eigenvalues):
    rng = np.random.default_rng(1)
    for _ in range(20):
        R = Rotation.random(None, rng).as_matrix()
        C = R @ np.diag(eigenvalues) @ R.T
        C = (C + C.T) / 2
        vector = kernel.smallest_eigenvector(C)
        assert np.linalg.norm(vector) == pytest.approx(1)
        assert abs(vector @ R[:, 0]) > 1 - 1e-6


def test_smallest_eigenvector_of_a_ball_and_of_nothing_is_some_unit_vector():
    for C in (np.eye(3), np.zeros((3, 3))):
        assert np.linalg.norm(kernel.smallest_eigenvector(C)) == pytest.approx(1)


def positive_definite(n, rng):
    """Return a random (n, n) symmetric positive definite matrix."""
    B = rng.normal(size=(n, n))
    return B @ B.T + 0.1 * np.eye(n)


def test_jacobi_finds_all_eigenvectors():
    rng = np.random.default_rng(2)
    for _ in range(20):
        C = positive_definite(3, rng)
        a, v = C.copy(), np.empty((3, 3))
        kernel.eigen_jacobi(a, v)
        np.testing.assert_allclose(np.sort(np.diag(a)), np.linalg.eigvalsh(C), rtol=1e-10)
        np.testing.assert_allclose(v @ np.diag(np.diag(a)) @ v.T, C, atol=1e-10)
        np.testing.assert_allclose(v.T @ v, np.eye(3), atol=1e-12)


@pytest.mark.parametrize('n', [6, 9])
@pytest.mark.parametrize('clamped', [False, True])
def test_cholesky_solves_what_numpy_solves(n, clamped):
    rng = np.random.default_rng(n)
    A, b = positive_definite(n, rng), rng.normal(size=n)
    L, x = A.copy(), b.copy()
    if clamped:
        kernel.cholesky_clamped(L, 1e-12)
    else:
        assert kernel.cholesky(L)
    np.testing.assert_allclose(np.tril(L), np.linalg.cholesky(A), atol=1e-10)
    kernel.cholesky_solve(L, x)
    np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-8)


def test_a_matrix_that_is_not_positive_definite_is_rejected_or_clamped():
    assert not kernel.cholesky(np.zeros((6, 6)))
    assert not kernel.cholesky(np.diag([1.0, -1.0, 1.0]))
    L = np.diag([1.0, -1.0, 4.0])
    kernel.cholesky_clamped(L, 1e-12)
    np.testing.assert_allclose(np.diag(L), [1, 1e-6, 2])
