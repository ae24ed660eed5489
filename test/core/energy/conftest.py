# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The plain way to learn what a swap would change: flip a member, look, and flip it back."""

import numpy as np
import pytest


@pytest.fixture(scope='session')
def deltas_by_flips():
    """Return a function (energy, members) -> (m, n) deltas once each member has left."""
    def flipped(energy, members):
        mask, rows = energy.mask, []
        for k in members:
            energy.flip(int(k))
            rows.append(np.where(mask, np.inf, energy.deltas()))
            energy.flip(int(k))
        return np.array(rows).reshape(len(members), energy.n)
    return flipped
