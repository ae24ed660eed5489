# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A table that the sensor bends, and the low thing on it that is still seen."""

from dataclasses import replace

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.uneven import uneven_table
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np
import pytest


def bent(shape=(120, 160), amplitude=0.004):
    """Return (H, W) heights of a table with two bumps and two hollows."""
    v, u = np.mgrid[:shape[0], :shape[1]]
    return amplitude * np.sin(2 * np.pi * u / shape[1]) * np.cos(np.pi * v / shape[0])


def test_the_bend_is_followed_and_low_things_are_not():
    rng = np.random.default_rng(0)
    height = bent() + 0.001 * rng.standard_normal((120, 160))
    height[60:66, 40:80] += 0.008
    base, sigma = uneven_table(height, np.abs(height) < 0.025, 31)
    inner = np.s_[15:-15, 15:-15]
    assert np.abs(base - bent())[inner].max() < 0.0025
    assert sigma == pytest.approx(0.0012, abs=0.0004)
    assert (height - base)[60:66, 42:78].mean() > 0.0065


def test_a_perfect_plane_and_no_table_at_all_are_no_special_cases():
    base, sigma = uneven_table(np.zeros((20, 30)), np.ones((20, 30), bool), 9)
    assert (base == 0).all() and sigma == 0
    base, sigma = uneven_table(np.full((20, 30), np.nan), np.zeros((20, 30), bool), 9)
    assert (base == 0).all() and sigma == np.inf


def test_a_fork_stands_out_of_a_bent_table_and_a_high_plate_still_does():
    shape, rng = (240, 320), np.random.default_rng(1)
    K = np.array([[300.0, 0, 160], [0, 300.0, 120], [0, 0, 1]])
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[2, 3] = 1.0                               # one metre above the table, looking down
    height = bent(shape) + 0.0006 * rng.standard_normal(shape)
    fork, plate = np.zeros(shape, bool), np.zeros(shape, bool)
    fork[118:122, 215:265], plate[40:100, 40:110] = True, True
    height += 0.007 * fork + 0.012 * plate
    camera = Camera('above', shape[1], shape[0], K, np.zeros(5), T, 'plumb_bob')
    view = RectifiedView(camera, (1.0 - height).astype(np.float32))
    flat = observe([view], ObserveConfig(uneven_m=0.0)).views[0].foreground
    seen = observe([view]).views[0].foreground
    assert flat[fork].mean() < 0.3 and seen[fork].mean() > 0.9
    assert seen[plate].mean() >= flat[plate].mean() > 0.9
    assert seen[~fork & ~plate].mean() < 0.02
    assert not (flat & ~seen).any(), 'what stands out of the plane stays foreground'


def test_taking_the_table_for_flat_is_what_the_paper_does():
    from hooc_perception.core.profiles import profile
    assert profile('paper').observe.uneven_m == 0
    best = profile('best').observe
    # Nor does it look at more than one frame set.
    assert profile('paper').observe.accumulate.accumulate_frames == 1
    assert replace(profile('paper').observe, uneven_m=0.12, min_foreground_m=0.004,
                   accumulate=best.accumulate) == best
