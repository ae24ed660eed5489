# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Cans: for drinks, food, fish, meat, coffee, paint and sprays."""

from hooc_perception.core.arrays import Float64Array
from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import box, curve, cylinder, filled, lathe
from hooc_perception.objects.catalogue.vessel_parts import body, ear, superellipse
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def can(draw: Draw) -> Manifold:
    """Return a drinks can with a drawn-in neck, a rim and a dished bottom."""
    across, up = draw.about(1.0, 0.1), draw.about(1.0, 0.12)
    rise = 0.1155 * up - 0.1155
    side = np.array([(0.024, 0.0), (0.033, 0.010), (0.033, 0.100), (0.0275, 0.1115),
                     (0.0285, 0.113), (0.0285, 0.1155)]) * (across, 1.0)
    side[2:, 1] += rise
    lid = np.array([(0.0262, 0.111), (0.0268, 0.120)]) * (across, 1.0) + (0.0, rise)
    dish = np.array([(0.021, -0.001), (0.019, 0.004), (0.008, 0.0075)]) * (across, 1.0)
    tab = lathe([(0.005, 0.110), (0.011, 0.110), (0.011, 0.1135), (0.005, 0.1135)], 20)
    return filled(side) - filled(lid) - filled(dish) + tab.scale((1.2, 0.7, 1.0)).translate(
        (0.004, 0.0, rise))


def _rims(r: float, h: float, bead: float) -> Float64Array:
    """Return the side line of a tin: upright between two beaded rims."""
    return np.array([(r + bead, 0.0), (r + bead, 0.003), (r, 0.0045), (r, h - 0.0045),
                     (r + bead, h - 0.003), (r + bead, h)])


def _tin(side: npt.ArrayLike, recess: float, shape: npt.ArrayLike | None = None) -> Manifold:
    """Return a closed tin whose lid and bottom lie below its rims."""
    side = np.asarray(side, float)
    r, h = side[-1]
    top = [(r - 0.003, h - recess), (r - 0.0025, h + 0.01)]
    foot = [(side[0, 0] - 0.0025, -0.01), (side[0, 0] - 0.003, 0.5 * recess)]
    return body(side, shape) - body(top, shape) - body(foot, shape)


def food_tin(draw: Draw) -> Manifold:
    """Return a tin for soup or vegetables, plain or with ribs around it."""
    r, h = draw.about(0.036, 0.12), draw.about(0.105, 0.14)
    side = _rims(r, h, 0.0015)
    if draw.chance(0.6):
        z = np.linspace(0.25, 0.75, 13) * h
        ribs = np.column_stack([r - 0.0008 * (1 - np.cos(np.linspace(0, 12 * np.pi, 13) / 2)), z])
        ribs[1::2, 0] -= 0.0012
        side = np.vstack([side[:3], ribs, side[3:]])
    return _tin(side, draw.about(0.0035, 0.2))


def flat_tin(draw: Draw) -> Manifold:
    """Return a low tin for tuna, pet food, cream or sweets."""
    r, h = draw.about(0.042, 0.14), draw.about(0.035, 0.2)
    side = _rims(r, h, draw.between(0.0005, 0.002))
    side[0, 0] -= draw.between(0.001, 0.005)
    solid = _tin(side, draw.about(0.003, 0.25))
    if draw.chance(0.5):
        tab = lathe([(0.005, 0.0), (0.010, 0.0), (0.010, 0.003), (0.005, 0.003)], 16)
        solid += tab.scale((1.4, 0.8, 1.0)).translate((0.45 * r, 0.0, h - 0.0050))
    return solid


def slim_can(draw: Draw) -> Manifold:
    """Return a slim or tall can for energy drinks or beer, with a stepped or a round neck."""
    r, h = draw.about(0.028, 0.12), draw.about(0.145, 0.12)
    neck = r - draw.between(0.002, 0.005)
    side = np.vstack([[(0.78 * r, 0.0), (r, 0.008), (r, h - 0.016)], curve([
        (r, h - 0.015), (0.5 * (r + neck), h - 0.008), (neck, h - 0.004)], 4),
        [(neck + 0.001, h - 0.002), (neck + 0.001, h)]])
    lid = [(neck - 0.002, h - draw.about(0.004, 0.2)), (neck - 0.0015, h + 0.01)]
    dish = [(0.68 * r, -0.001), (0.62 * r, 0.004), (0.3 * r, 0.007)]
    return body(side) - body(lid) - body(dish)


def fish_tin(draw: Draw) -> Manifold:
    """Return a low, oblong tin for sardines."""
    r, h = draw.about(0.054, 0.14), draw.about(0.026, 0.2)
    shape = superellipse(draw.between(0.52, 0.75), draw.between(2.3, 5.0), 36)
    side = _rims(r, h, 0.0012)
    side[0:2, 0] -= 0.003
    return _tin(side, draw.about(0.0025, 0.2), shape)


def meat_tin(draw: Draw) -> Manifold:
    """Return an upright tin of rectangular or oval outline: for meat, tea, oil or mustard."""
    r, h = draw.about(0.049, 0.12), draw.about(0.090, 0.25)
    shape = superellipse(draw.between(0.5, 0.8), draw.between(3.0, 7.0), 36)
    side = _rims(r, h, 0.0012)
    if draw.chance(0.4):
        side[3:, 0] *= draw.between(0.88, 0.97)
    solid = _tin(side, draw.about(0.003, 0.2), shape)
    if draw.chance(0.3):
        solid += cylinder(draw.about(0.012, 0.2), 0.022, at=(0.0, 0.0, h - 0.006), segments=24)
    return solid


def coffee_tin(draw: Draw) -> Manifold:
    """Return a large tin with a plastic lid over its rim, for coffee, nuts or milk powder."""
    r, h = draw.about(0.050, 0.12), draw.about(0.138, 0.14)
    side = _rims(r, h, 0.0012)
    lid = draw.about(0.010, 0.25)
    side = np.vstack([side[:4], [(r, h - lid), (r + 0.0028, h - lid + 0.001),
                                 (r + 0.0028, h + 0.001), (r - 0.002, h + 0.002)]])
    top = [(r - 0.005, h - 0.001), (r - 0.004, h + 0.01)]
    return body(side) - body(top) - body([(r - 0.001, -0.01), (r - 0.002, 0.002)])


def crisp_tube(draw: Draw) -> Manifold:
    """Return a tall tube can with a lid: for crisps or tennis balls."""
    r, h = draw.about(0.037, 0.1), draw.about(0.205, 0.18)
    side = [(r + 0.001, 0.0), (r + 0.001, 0.003), (r, 0.004), (r, h - 0.012),
            (r + 0.002, h - 0.011), (r + 0.002, h)]
    return body(side) - body([(0.88 * r, h - 0.0025), (0.9 * r, h + 0.01)])


def open_tin(draw: Draw) -> Manifold:
    """Return a tin that is open at the top, its lid off or bent up on a hinge."""
    r, h = draw.about(0.037), draw.about(0.095, 0.25)
    wall = draw.about(0.0022, 0.15)
    side = _rims(r, h, 0.0012)
    inside = cylinder(r - wall, h, at=(0.0, 0.0, 0.004), segments=32)
    if draw.chance(0.2):
        inside = inside.translate((0.0, 0.0, 0.6 * h))
    solid = body(side) - inside
    if draw.chance(0.4):
        lid = cylinder(0.94 * r, 0.002, at=(0.94 * r, 0.0, -0.001), segments=24)
        lid += box(0.016, 0.014, 0.002, at=(-0.004, 0.0, -0.001))
        lid = lid.rotate((0.0, -draw.between(50.0, 110.0), 0.0))
        solid += lid.translate((-r + 0.001, 0.0, h - 0.0005)) - inside
    return solid


def spray_can(draw: Draw) -> Manifold:
    """Return an aerosol can: a dome with a nozzle, or a cap over it."""
    r, h = draw.about(0.029, 0.12), draw.about(0.150, 0.18)
    side = np.vstack([[(r + 0.001, 0.0), (r + 0.001, 0.003), (r, 0.004), (r, h - 0.003),
                       (r + 0.001, h)], curve([(0.95 * r, h + 0.001), (0.75 * r, h + 0.009),
                                               (0.42 * r, h + 0.014)], 5)])
    if draw.chance(0.5):
        cap = draw.about(0.034, 0.25)
        return body(side) + cylinder(0.9 * r, cap, at=(0, 0, h - 0.001), segments=32,
                                     top=r * draw.between(0.72, 0.9))
    nozzle = cylinder(0.007, 0.016, at=(0.0, 0.0, h + 0.010), segments=14)
    return body(side) + cylinder(0.42 * r, 0.004, at=(0, 0, h + 0.012), segments=24) + nozzle


def paint_tin(draw: Draw) -> Manifold:
    """Return a paint tin with a pressed lid and, perhaps, a wire to carry it by."""
    r, h = draw.about(0.054, 0.18), draw.about(0.115, 0.18)
    solid = body(_rims(r, h, 0.002))
    groove = lathe([(0.80 * r, h - 0.004), (0.86 * r, h - 0.004), (0.86 * r, h + 0.01),
                    (0.80 * r, h + 0.01)], 32)
    solid -= groove + cylinder(0.74 * r, 0.01, at=(0.0, 0.0, h - 0.003), segments=32)
    if draw.chance(0.5):
        tall = draw.between(0.25, 1.0) * r
        # Bent around the lid: its ends lie in the wall, left and right.
        wire = ear([(r - 0.001, 0.82 * h), (0.99 * r, h + 0.12 * tall), (0.6 * r, h + 0.8 * tall),
                    (0.0, h + tall), (-0.6 * r, h + 0.8 * tall), (-0.99 * r, h + 0.12 * tall),
                    (-r + 0.001, 0.82 * h)], 0.0025, 0.0025, 18, 6)
        solid += wire.rotate((0.0, 0.0, 90.0))
    return solid


def conical_tin(draw: Draw) -> Manifold:
    """Return a stacking tin that tapers, or a dented one."""
    r, h = draw.about(0.038), draw.about(0.078, 0.2)
    side = _rims(r, h, 0.0015)
    side[:3, 0] *= draw.between(0.82, 0.95)
    solid = _tin(side, draw.about(0.0035, 0.2))
    if draw.chance(0.5):
        ball = Manifold.sphere(draw.about(0.030, 0.2), 24)
        at = (1.0 * r + 0.022 * draw.between(0.8, 1.3), 0.0, h * draw.between(0.35, 0.65))
        solid -= ball.translate(at)
    return solid


STYLES = {'can': (can, food_tin, flat_tin, slim_can, meat_tin, fish_tin, coffee_tin, spray_can,
                  crisp_tube, open_tin, conical_tin, paint_tin)}
