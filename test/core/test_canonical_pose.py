# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A pose that is the same number by number in every process that hands it on."""

from hooc_perception.core.geometry import canonical_pose, matrix_from_pose, pose_from_matrix
import numpy as np


def test_survives_quaternions_bit_by_bit():
    rng = np.random.default_rng(0)
    changed = 0
    for _ in range(2000):
        T = matrix_from_pose(rng.normal(size=3), rng.normal(size=4))
        once = matrix_from_pose(*pose_from_matrix(T))
        changed += once.tobytes() != T.tobytes()
        canonical = canonical_pose(T)
        assert canonical_pose(once).tobytes() == canonical.tobytes()
        assert canonical_pose(canonical).tobytes() == canonical.tobytes()
    # The trip does change most matrices: without the rounding this test would fail.
    assert changed > 500


def test_moves_less_than_any_calibration():
    rng = np.random.default_rng(1)
    for _ in range(100):
        T = matrix_from_pose(rng.normal(size=3), rng.normal(size=4))
        canonical = canonical_pose(T)
        assert np.abs(canonical - T).max() < 3e-9
        np.testing.assert_array_equal(canonical[:3, 3], T[:3, 3])
        np.testing.assert_allclose(canonical[:3, :3] @ canonical[:3, :3].T, np.eye(3), atol=1e-14)
