# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fusion of repeated images of a scene that stands still."""

from hooc_perception.core.fuse import fuse_depth, has_moved
import numpy as np
import pytest

rng = np.random.default_rng(0)


@pytest.mark.parametrize('n', [1, 2, 3, 5, 8])
def test_median_and_count_as_plain_python_has_them(n):
    stack = rng.uniform(0.5, 2.0, (n, 6, 7)).astype(np.float32)
    stack[rng.random(stack.shape) < 0.4] = np.nan
    depth, count = fuse_depth(stack)
    for v in range(6):
        for u in range(7):
            seen = sorted(x for x in stack[:, v, u] if x == x)
            assert count[v, u] == len(seen)
            if not seen or 2 * len(seen) < n:
                assert np.isnan(depth[v, u])
            else:
                assert depth[v, u] == seen[(len(seen) - 1) // 2]
    assert depth.dtype == np.float32 and count.dtype == np.uint8


def test_noise_falls():
    stack = (1.0 + 0.01 * rng.standard_normal((9, 50, 60))).astype(np.float32)
    assert np.std(fuse_depth(stack)[0]) < 0.5 * np.std(stack[0])


def test_noise_is_no_motion_but_a_hand_is():
    before = (1.0 + 0.003 * rng.standard_normal((100, 100))).astype(np.float32)
    after = (1.0 + 0.003 * rng.standard_normal((100, 100))).astype(np.float32)
    before[:10] = np.nan
    assert not has_moved(after, before)
    after[40:60, 40:60] = 0.7
    assert has_moved(after, before)
    assert not has_moved(np.full_like(after, np.nan), before)
