# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Noisy views of boxes on a table."""

from dataclasses import replace

import numpy as np
import pytest

# x, y, z of the middle and of the sides, metres
CUBE = ([0.1, 0.05, 0.05], [0.1, 0.1, 0.1])
BOARD = ([-0.2, 0.0, 0.04], [0.08, 0.2, 0.08])


@pytest.fixture(scope='session')
def seen(small):
    """Return a function: boxes (middle, sides) -> RectifiedViews, 1 mm of noise at 1 m."""
    def look(*boxes, seed=0, cameras=None):
        views, rng = [], np.random.default_rng(seed)
        for view in small.views_of([small.box(*b) for b in boxes], cameras or small.rig())[0]:
            noise = 0.001 * view.depth ** 2 * rng.normal(size=view.depth.shape)
            views.append(replace(view, depth=(view.depth + noise).astype(np.float32)))
        return views
    return look


@pytest.fixture(scope='session')
def shown(small):
    """Return a function: boxes, number of one -> per view (H, W) bool, the pixels that show it."""
    def look(boxes, k, cameras=None):
        return [ids == k for ids in small.views_of([small.box(*b) for b in boxes],
                                                   cameras or small.rig())[1]]
    return look


@pytest.fixture(scope='session')
def cube():
    """Return a cube on the table."""
    return CUBE


@pytest.fixture(scope='session')
def board():
    """Return a board on the table."""
    return BOARD
