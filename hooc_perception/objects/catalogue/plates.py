# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Plates: dinner and soup plates, saucers, platters, square, divided and paper plates."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import box, curve, cylinder, filled
from hooc_perception.objects.catalogue.vessel_parts import (
    basin,
    body,
    fluted,
    polygon,
    superellipse,
    vessel,
)
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt

FINE = 40


def plate(draw: Draw) -> Manifold:
    """Return a dinner plate with a broad rim."""
    across, up, lift = draw.about(1.0), draw.about(1.0, 0.2), 0.001 * (draw.about(1.0, 0.5) - 1.0)
    side = np.array([(0.062, 0.0), (0.066, 0.003), (0.078, 0.012), (0.122, 0.022),
                     (0.123, 0.0245)]) * (across, up)
    well = np.array([(0.063, 0.004), (0.077, 0.0155), (0.120, 0.0246), (0.130, 0.030)]) * (
        across, up)
    well[:2, 1] += lift
    return filled(side) - filled(well)


def _dished(side: npt.ArrayLike, thick: float, shape: npt.ArrayLike | None = None) -> Manifold:
    """Return a dish whose wall has about the same thickness, upright, everywhere."""
    side = np.asarray(side, float)
    well = side + (0.0, thick)
    well[-1] = side[-1] + (-0.6 * thick, 1e-4)
    well = np.vstack([well[well[:, 1] <= side[-1, 1] + 2e-4], well[-1] + (0.01, 0.01)])
    return body(side, shape, FINE) - body(well, shape, FINE)


def coupe_plate(draw: Draw) -> Manifold:
    """Return a plate without a rim: one continuous curve up to its edge."""
    r, h = draw.about(0.120, 0.2), draw.about(0.026, 0.2)
    side = np.vstack([[(0.6 * r, 0.0)], curve([
        (0.64 * r, 0.001), (0.86 * r, 0.28 * h), (0.97 * r, 0.72 * h), (r, h)], 7)])
    return vessel(side, draw.about(0.004, 0.25), draw.about(0.005, 0.2))


def upright_plate(draw: Draw) -> Manifold:
    """Return a flat stoneware plate with an upstanding wall."""
    r, h = draw.about(0.115, 0.2), draw.about(0.022, 0.2)
    side = [(r * draw.between(0.9, 0.96), 0.0), (0.985 * r, 0.005), (r, 0.010), (r, h)]
    return vessel(side, draw.about(0.0045, 0.25), draw.about(0.006, 0.2))


def soup_plate(draw: Draw) -> Manifold:
    """Return a deep plate with a broad rim."""
    r, h, k = draw.about(0.115, 0.12), draw.about(0.038, 0.14), draw.between(0.66, 0.8)
    thick = draw.about(0.005, 0.2)
    side = [(0.45 * r, 0.0), (0.5 * r, 0.003), (0.94 * k * r, 0.5 * h), (k * r, 0.82 * h),
            (r, h)]
    well = [(0.42 * r, thick), (0.5 * r, thick + 0.002), (0.94 * k * r - thick, 0.55 * h),
            (k * r - 0.7 * thick, 0.84 * h + 0.002), (r - 0.0015, h + 1e-4), (r + 0.02, h + 0.01)]
    return filled(side, FINE) - filled(well, FINE)


def square_plate(draw: Draw) -> Manifold:
    """Return a square or rectangular plate whose rim rises gently."""
    r, h = draw.about(0.108, 0.18), draw.about(0.022, 0.2)
    shape = superellipse(draw.between(0.55, 1.0), draw.between(4.0, 9.0), 40)
    inner = draw.between(0.62, 0.85)
    side = [(inner * r, 0.0), (inner * r + 0.004, 0.003), (0.97 * r, 0.8 * h), (r, h)]
    return _dished(side, draw.about(0.005, 0.2), shape)


def oval_platter(draw: Draw) -> Manifold:
    """Return an oval platter with a rim."""
    r, h = draw.about(0.140), draw.about(0.024, 0.2)
    shape = superellipse(draw.between(0.6, 0.8), draw.between(2.0, 2.8), 40)
    inner = draw.between(0.58, 0.75)
    side = [(inner * r, 0.0), (inner * r + 0.010, 0.45 * h), (0.985 * r, 0.9 * h), (r, h)]
    return _dished(side, draw.about(0.0045, 0.2), shape)


def scalloped_plate(draw: Draw) -> Manifold:
    """Return a plate whose rim is scalloped or has corners."""
    r, h = draw.about(0.120), draw.about(0.024, 0.2)
    shape = draw.pick(fluted(12, 0.05), polygon(8), fluted(8, 0.06, 5), polygon(12))
    inner = draw.between(0.55, 0.72)
    side = [(inner * r, 0.0), (inner * r + 0.008, 0.4 * h), (0.98 * r, 0.9 * h), (r, h)]
    return _dished(side, draw.about(0.005, 0.2), shape)


def flat_board(draw: Draw) -> Manifold:
    """Return a thick flat plate of wood or slate, with a shallow well or none."""
    r, thick = draw.about(0.120), draw.about(0.013, 0.25)
    shape = draw.pick(None, superellipse(0.7, 8.0, 40), superellipse(1.0, 9.0, 40))
    side = [(r - 0.003, 0.0), (r, 0.003), (r, thick - 0.002), (r - 0.002, thick)]
    solid = body(side, shape, FINE)
    if draw.chance(0.6):
        k = draw.between(0.78, 0.92) * r
        solid -= body([(k - 0.01, 0.55 * thick), (k, thick + 0.001)], shape, FINE)
    return solid


def divided_plate(draw: Draw) -> Manifold:
    """Return a plate with compartments, as in canteens and for children."""
    r, h = draw.about(0.118), draw.about(0.025, 0.2)
    side = [(0.82 * r, 0.0), (0.85 * r, 0.003), (0.95 * r, 0.9 * h), (r, 0.92 * h), (r, h)]
    inside = filled([(0.80 * r, 0.004), (0.92 * r, h + 0.001)], FINE)
    high, t = draw.between(0.6, 0.9) * h, draw.about(0.007, 0.2)
    walls = box(2 * r, t, high)
    walls += box(r, t, high, at=(0.5 * r, 0.0, 0.0)).rotate((0.0, 0.0, draw.between(70, 110)))
    if draw.chance(0.4):
        walls = walls.rotate((0.0, 0.0, 90.0)) + box(2 * r, t, high)
    return filled(side, FINE) - (inside - walls)


def paper_plate(draw: Draw) -> Manifold:
    """Return a thin plate with a steep fluted wall and a rolled rim."""
    r, h = draw.about(0.112), draw.about(0.020, 0.2)
    inner = draw.between(0.72, 0.82)
    side = [(inner * r, 0.0), (0.91 * r, 0.8 * h), (0.98 * r, h - 0.001), (r, h - 0.002),
            (r + 0.001, h)]
    well = [(inner * r - 0.002, 0.0025), (0.91 * r - 0.002, 0.8 * h + 0.0015),
            (0.96 * r, h + 5e-4), (r, h + 0.005)]
    shape = draw.pick(fluted(20, 0.018, 3), None)
    return body(side, shape, FINE) - body(well, shape, FINE)


def saucer(draw: Draw) -> Manifold:
    """Return a small plate with a ring for a cup."""
    r, h = draw.about(0.074, 0.14), draw.about(0.019, 0.2)
    side = np.vstack([[(0.5 * r, 0.0), (0.52 * r, 0.003)], curve([
        (0.55 * r, 0.004), (0.82 * r, 0.5 * h), (r, h)], 6)])
    ring = cylinder(0.36 * r, 0.003, at=(0.0, 0.0, 0.003), segments=FINE)
    ring -= cylinder(0.31 * r, 0.01, at=(0.0, 0.0, 0.0045), segments=FINE)
    return vessel(side, draw.about(0.004, 0.2), 0.005) + ring


def sushi_plate(draw: Draw) -> Manifold:
    """Return a long rectangular plate, flat or on two feet, with a low edge."""
    length, width = draw.about(0.240), draw.about(0.125, 0.2)
    h, flare = draw.about(0.018, 0.2), draw.between(0.002, 0.02)
    solid = basin(length, width, h, 0.008, flare)
    solid -= basin(length - 0.008, width - 0.008, h, 0.006, flare).translate((0, 0, 0.006))
    if draw.chance(0.5):
        for x in (-0.3, 0.3):
            solid += box(0.012, 0.6 * width, 0.011, at=(x * length, 0.0, -0.010))
    return solid


STYLES = {'plate': (plate, coupe_plate, upright_plate, soup_plate, square_plate, oval_platter,
                    scalloped_plate, flat_board, divided_plate, sushi_plate, paper_plate, saucer)}
