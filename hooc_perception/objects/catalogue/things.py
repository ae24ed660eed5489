# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Ball, banana and can."""

from functools import partial

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.fruit import banana
from hooc_perception.objects.catalogue.shapes import filled, lathe
from manifold3d import Manifold


def ball() -> Manifold:
    """Return a ball."""
    return Manifold.sphere(0.036, 48)


def can() -> Manifold:
    """Return a drinks can with a drawn-in neck, a rim and a dished bottom."""
    side = [(0.024, 0.0), (0.033, 0.010), (0.033, 0.100), (0.0275, 0.1115), (0.0285, 0.113),
            (0.0285, 0.1155)]
    lid = [(0.0262, 0.111), (0.0268, 0.120)]
    dish = [(0.021, -0.001), (0.019, 0.004), (0.008, 0.0075)]
    tab = lathe([(0.005, 0.110), (0.011, 0.110), (0.011, 0.1135), (0.005, 0.1135)], 20)
    return filled(side) - filled(lid) - filled(dish) + tab.scale((1.2, 0.7, 1.0)).translate(
        (0.004, 0.0, 0.0))


BUILDERS = {'ball': ball, 'banana': partial(banana, Draw()), 'can': can}
