# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Gauss-Newton steps against numeric derivatives and what they must bring about."""

from hooc_perception.core.kernels import gauss_newton as kernel
from hooc_perception.core.kernels.pose import SCALE_LIMITS
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def hypothesis(t=(0, 0, 0), rotvec=(0, 0, 0), scale=(1, 1, 1)):
    """Return (10,) translation, xyzw, scale."""
    return np.concatenate([t, Rotation.from_rotvec(rotvec).as_quat(), scale]).astype(float)


def posed(h, points):
    """Return model points in the world."""
    return Rotation.from_quat(h[3:7]).apply(points * h[7:10]) + h[:3]


def surface(rng, n=400, half=(0.05, 0.08, 0.03)):
    """Return points and outward normals on a box."""
    points = rng.uniform(-1, 1, (n, 3))
    axis = rng.integers(0, 3, n)
    points[np.arange(n), axis] = np.sign(points[np.arange(n), axis])
    normals = np.zeros((n, 3))
    normals[np.arange(n), axis] = points[np.arange(n), axis]
    return points * half, normals


def equations(h, true, points, normals):
    """Return A (9, 10) of points seen at `true` and believed to be at `h`."""
    A = np.zeros((9, 10))
    R = Rotation.from_quat(h[3:7]).as_matrix()
    n = Rotation.from_quat(true[3:7]).apply(normals)
    off = np.einsum('ij,ij->i', n, posed(h, points) - posed(true, points))
    for x, m, r in zip(posed(h, points), n, off):
        kernel.add_equation(A, h, R, tuple(x), tuple(m), r, 1.0)
    return A


def test_equations_are_those_of_numeric_derivatives(rng):
    points, normals = surface(rng, 60)
    h = hypothesis((0.2, -0.1, 0.3), (0.3, -0.2, 0.9), (1.1, 0.9, 1.2))
    n = Rotation.from_quat(h[3:7]).apply(normals)
    J = np.zeros((60, 9))
    for k in range(9):
        d = np.zeros(9)
        d[k] = 1e-6
        moved = h.copy()
        moved[:3] += d[:3]
        moved[3:7] = (Rotation.from_rotvec(d[3:6]) * Rotation.from_quat(h[3:7])).as_quat()
        moved[7:10] *= np.exp(d[6:])
        J[:, k] = np.einsum('ij,ij->i', n, posed(moved, points) - posed(h, points)) / 1e-6
    r = rng.normal(size=60)
    A, R = np.zeros((9, 10)), Rotation.from_quat(h[3:7]).as_matrix()
    for x, m, e in zip(posed(h, points), n, r):
        kernel.add_equation(A, h, R, tuple(x), tuple(m), e, 0.5)
    np.testing.assert_allclose(np.triu(A[:, :9]), np.triu(0.5 * J.T @ J), atol=1e-4)
    np.testing.assert_allclose(A[:, 9], 0.5 * J.T @ r, atol=1e-4)


def test_steps_find_the_pose_and_the_size(rng):
    points, normals = surface(rng)
    true = hypothesis((0.01, 0.02, -0.01), (0.05, -0.04, 0.1), (1.1, 0.95, 1.05))
    h = hypothesis()
    for _ in range(40):
        out = np.empty(10)
        kernel.gauss_newton_step(equations(h, true, points, normals), len(points), h, 0.0,
                                 SCALE_LIMITS, out)
        h = out
    assert np.abs(posed(h, points) - posed(true, points)).max() < 1e-3


def test_a_step_stays_within_its_limits_and_the_allowed_scales(rng):
    points, normals = surface(rng)
    true, h, out = hypothesis((0.5, 0, 0), scale=(3, 3, 3)), hypothesis(), np.empty(10)
    kernel.gauss_newton_step(equations(h, true, points, normals), len(points), h, 0.0,
                             (0.45, 1.05), out)
    assert np.linalg.norm(out[:3]) <= kernel.MAX_STEP[0] + 1e-9
    assert (out[7:] <= 1.05).all() and np.isclose(np.linalg.norm(out[3:7]), 1)


def test_without_evidence_nothing_moves():
    h, out = hypothesis((0.1, 0.2, 0.3), (0.1, 0, 0)), np.empty(10)
    kernel.gauss_newton_step(np.zeros((9, 10)), 0, h, 0.0, SCALE_LIMITS, out)
    np.testing.assert_allclose(out, h, atol=1e-12)
