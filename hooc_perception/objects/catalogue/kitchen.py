# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Plate, tray, frying pan and dustpan: wide and shallow objects."""

from hooc_perception.objects.catalogue.shapes import (
    box,
    content,
    curve,
    cylinder,
    ellipse,
    filled,
    rounded_rectangle,
    sweep,
)
from manifold3d import Manifold
import numpy as np


def plate() -> Manifold:
    """Return a dinner plate with a broad rim."""
    side = [(0.062, 0.0), (0.066, 0.003), (0.078, 0.012), (0.122, 0.022), (0.123, 0.0245)]
    well = [(0.063, 0.004), (0.077, 0.0155), (0.120, 0.0246), (0.130, 0.030)]
    return filled(side) - filled(well)


def _basin(length: float, width: float, height: float, radius: float,
           flare: float) -> Manifold:
    """Return a round-cornered block that is wider by 2 x flare at its top than at its foot."""
    low = rounded_rectangle(length - 2 * flare, width - 2 * flare, radius).extrude(0.001)
    high = rounded_rectangle(length, width, radius).extrude(0.001)
    return (low + high.translate((0.0, 0.0, height - 0.001))).hull()


def tray() -> Manifold:
    """Return a serving tray with leaning sides and a grip at each end."""
    wall = 0.004
    inside = _basin(0.380 - 2 * wall, 0.270 - 2 * wall, 0.046, 0.028, 0.014)
    shell = _basin(0.380, 0.270, 0.042, 0.030, 0.014) - inside.translate((0.0, 0.0, wall))
    grip = rounded_rectangle(0.085, 0.016, 0.0079).extrude(0.06).rotate((90.0, 0.0, 90.0))
    for x in (-0.21, 0.15):
        shell -= grip.translate((x, 0.0, 0.027))
    return shell


def frying_pan() -> Manifold:
    """Return a pan with a long, rising handle that ends in an eye."""
    side = np.vstack([[(0.092, 0.0)], curve([(0.096, 0.002), (0.110, 0.024), (0.120, 0.046)], 5)])
    inside = content(side, 0.004, 0.004, 56)
    line = curve([(0.105, 0.030), (0.150, 0.045), (0.220, 0.062), (0.300, 0.066)], 12)
    path = np.column_stack([line[:, 0], np.zeros(12), line[:, 1]])
    width = np.interp(np.linspace(0, 1, 12), [0, 0.2, 0.8, 0.95, 1],
                      [0.008, 0.009, 0.014, 0.013, 0.008])
    handle = sweep(path, width, 0.0075, sides=12)
    eye = ellipse(0.008, 0.005, at=(0.284, 0.0)).extrude(0.2)
    return (filled(side, 56) - inside) + (handle - inside - eye)


def dustpan() -> Manifold:
    """Return a dustpan: a scoop with a low front edge and a high back, on a handle."""
    def scoop(inset: float, lift: float) -> Manifold:
        front = box(0.004, 0.220 - 2 * inset, 0.003 + lift, at=(-0.105, 0.0, lift / 2))
        back = rounded_rectangle(0.080, 0.190 - 2 * inset, 0.030).extrude(0.058 + lift)
        return (front + back.translate((0.055 - inset, 0.0, lift / 2))).hull()

    inside = scoop(0.004, 0.005) + box(0.02, 0.212, 0.08, at=(-0.115, 0.0, 0.0025))
    shell = scoop(0.0, 0.0) - inside.translate((0.0, 0.0, 0.001))
    line = curve([(0.085, 0.040), (0.130, 0.050), (0.180, 0.056), (0.225, 0.054)], 12)
    path = np.column_stack([line[:, 0], np.zeros(12), line[:, 1]])
    width = np.interp(np.linspace(0, 1, 12), [0, 0.3, 0.8, 1], [0.016, 0.012, 0.016, 0.010])
    eye = cylinder(0.006, 0.1, at=(0.211, 0.0, 0.0), segments=16)
    return shell + (sweep(path, width, 0.009, sides=12) - inside - eye)


BUILDERS = {'plate': plate, 'tray': tray, 'frying_pan': frying_pan, 'dustpan': dustpan}
