# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Ball, banana and can."""

from hooc_perception.objects.catalogue.shapes import filled, lathe, sweep
from manifold3d import Manifold
import numpy as np


def ball() -> Manifold:
    """Return a ball."""
    return Manifold.sphere(0.036, 48)


def banana() -> Manifold:
    """Return a banana that lies on its side, with a stalk."""
    along = np.linspace(0, 1, 24)
    angle = np.radians(-52 + 104 * along)
    bend = 0.105
    path = np.column_stack([bend * np.sin(angle), bend * np.cos(angle) - bend, 0 * angle])
    girth = np.interp(along, [0, 0.05, 0.10, 0.22, 0.5, 0.78, 0.93, 0.97, 1],
                      [0.0045, 0.0045, 0.006, 0.0155, 0.019, 0.0165, 0.008, 0.0045, 0.004])
    return sweep(path, girth, girth * 0.95, sides=7)


def can() -> Manifold:
    """Return a drinks can with a drawn-in neck, a rim and a dished bottom."""
    side = [(0.024, 0.0), (0.033, 0.010), (0.033, 0.100), (0.0275, 0.1115), (0.0285, 0.113),
            (0.0285, 0.1155)]
    lid = [(0.0262, 0.111), (0.0268, 0.120)]
    dish = [(0.021, -0.001), (0.019, 0.004), (0.008, 0.0075)]
    tab = lathe([(0.005, 0.110), (0.011, 0.110), (0.011, 0.1135), (0.005, 0.1135)], 20)
    return filled(side) - filled(lid) - filled(dish) + tab.scale((1.2, 0.7, 1.0)).translate(
        (0.004, 0.0, 0.0))


BUILDERS = {'ball': ball, 'banana': banana, 'can': can}
