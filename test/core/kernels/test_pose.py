# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Poses of hypotheses against scipy, random steps against what they promise."""

from hooc_perception.core.kernels import pose as kernel
import numba
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


def test_rotations_and_products_are_scipys():
    rng = np.random.default_rng(0)
    for _ in range(20):
        a, b = Rotation.random(2, rng)
        h, R, out = np.zeros(10), np.empty((3, 3)), np.empty(4)
        h[3:7] = a.as_quat()
        kernel.rotation_of(h, R)
        np.testing.assert_allclose(R, a.as_matrix(), atol=1e-12)
        kernel.quaternion_multiply(3.0 * a.as_quat(), b.as_quat(), out)
        np.testing.assert_allclose(Rotation.from_quat(out).as_matrix(), (a * b).as_matrix(),
                                   atol=1e-12)
        assert np.linalg.norm(out) == pytest.approx(1)
        kernel.quaternion_multiply(a.as_quat(), h[3:7], h[3:7])
        np.testing.assert_allclose(Rotation.from_quat(h[3:7]).as_matrix(), (a * a).as_matrix(),
                                   atol=1e-12)


def test_a_hypothesis_scales_turns_and_moves_its_model():
    rng = np.random.default_rng(3)
    h = np.concatenate([rng.normal(size=3), Rotation.random(None, rng).as_quat(), [1.2, 0.7, 1.0]])
    vertices, out = rng.normal(size=(20, 3)), np.empty((20, 3))
    kernel.posed(h, vertices, out)
    expected = (Rotation.from_quat(h[kernel.QUATERNION]).apply(vertices * h[kernel.SCALE])
                + h[kernel.TRANSLATION])
    np.testing.assert_allclose(out, expected, atol=1e-12)
    assert kernel.squared_log_scale(h) == pytest.approx((np.log([1.2, 0.7, 1.0]) ** 2).sum())


@numba.njit
def seed_kernels(seed):
    """Start the random numbers of compiled code, which has its own."""
    np.random.seed(seed)  # noqa: NPY002


def test_random_steps_have_the_sizes_asked_for_and_stay_within_the_scale_limits():
    start = np.array([0.1, 0.2, 0.3, 0, 0, 0, 1.0, 1, 1, 1])
    sizes, q, steps = kernel.StepSizes(0.01, 0.1, 0.05), np.empty(4), []
    seed_kernels(0)
    for _ in range(4000):
        trial = start.copy()
        kernel.random_step(sizes, 0.5, 2.0, q, trial)
        steps.append(np.concatenate([
            trial[kernel.TRANSLATION] - start[kernel.TRANSLATION],
            Rotation.from_quat(trial[kernel.QUATERNION]).as_rotvec(),
            np.log(trial[kernel.SCALE])]))
    steps = np.array(steps)
    moved = steps != 0
    # Translation in three of four steps, rotation and scale in three of five.
    np.testing.assert_allclose(moved.mean(0), [0.75] * 3 + [0.6] * 6, atol=0.04)
    deviation = [steps[moved[:, k], k].std() for k in range(9)]
    np.testing.assert_allclose(deviation, [0.005] * 3 + [0.05, 0.05, 0.1] + [0.025] * 3, rtol=0.06)
    for _ in range(200):
        kernel.random_step(kernel.StepSizes(0.0, 0.0, 1.0), 1.0, 1.0, q, start)
        assert kernel.SCALE_LIMITS[0] <= start[kernel.SCALE].min()
        assert start[kernel.SCALE].max() <= kernel.SCALE_LIMITS[1]
