# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bowls: hemispheres, mixing bowls, dishes, ramekins, square, oval and footed ones."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import content, curve, cylinder, filled
from hooc_perception.objects.catalogue.vessel_parts import (
    cavity,
    fluted,
    handled,
    level,
    loop,
    superellipse,
    vessel,
)
from manifold3d import Manifold
import numpy as np


def bowl(draw: Draw) -> Manifold:
    """Return a round bowl on a foot ring."""
    across, up = draw.about(1.0), draw.about(1.0)
    side = np.vstack([[(0.034, 0.0), (0.035, 0.006)],
                      curve([(0.036, 0.006), (0.062, 0.022), (0.076, 0.045), (0.081, 0.068)], 9)])
    side = side * (across, up)
    foot = cylinder(0.029 * across, 0.005 * up, at=(0.0, 0.0, -0.001))
    floor = level(draw, 0.010 * up, 0.068 * up)
    return filled(side) - content(side, 0.0035 * draw.about(1.0, 0.3), floor) - foot


def hemisphere(draw: Draw) -> Manifold:
    """Return a half ball with a small flat bottom: a mixing or a steel bowl."""
    r, h = draw.about(0.090, 0.2), draw.about(0.95, 0.1)
    angle = np.radians(np.linspace(draw.between(15, 35), draw.between(80, 90), 9))
    side = np.column_stack([r * np.sin(angle), h * r * (np.cos(angle[0]) - np.cos(angle))])
    top = side[-1]
    if draw.chance(0.5):
        side = np.vstack([side, top + (0.005, 0.0005), top + (0.005, 0.004)])
    return vessel(side, draw.about(0.003, 0.3), level(draw, 0.004, float(top[1])))


def straight_bowl(draw: Draw) -> Manifold:
    """Return a bowl with a flat bottom and an upright or leaning wall."""
    r, h, foot = draw.about(0.072), draw.about(0.060), draw.between(0.72, 1.0)
    side = [(foot * r - 0.006, 0.0), (foot * r, 0.006), (r, h)]
    return vessel(side, draw.about(0.004, 0.3), level(draw, 0.006, h))


def rimmed_bowl(draw: Draw) -> Manifold:
    """Return a cereal or soup bowl with a broad rim."""
    r, h, rim = draw.about(0.075), draw.about(0.048), draw.between(0.010, 0.030)
    side = np.vstack([[(0.5 * r, 0.0), (0.52 * r, 0.004)], curve([
        (0.55 * r, 0.005), (0.86 * r, 0.35 * h), (r, 0.9 * h)], 6),
        [(r + rim, h - 0.001), (r + rim, h + 0.003)]])
    well = np.vstack([[(0.5 * r, 0.008)], curve([
        (0.56 * r, 0.010), (0.82 * r, 0.42 * h), (0.95 * r, 0.95 * h)], 6),
        [(r + rim - 0.001, h + 0.0032), (r + rim + 0.01, h + 0.008)]])
    return filled(side, 32) - filled(well, 32)


def conical_bowl(draw: Draw) -> Manifold:
    """Return a noodle or rice bowl: nearly a cone on a high foot."""
    r, h, foot = draw.about(0.080, 0.2), draw.about(0.072), draw.between(0.36, 0.48)
    side = np.vstack([[(foot * r, 0.0), (foot * r - 0.001, 0.010)], curve([
        (foot * r, 0.011), (r * draw.between(0.7, 0.82), 0.5 * h), (r, h)], 6)])
    under = cylinder(foot * r - 0.005, 0.007, at=(0.0, 0.0, -0.001), segments=24)
    return vessel(side, draw.about(0.004, 0.25), level(draw, 0.014, h)) - under


def square_bowl(draw: Draw) -> Manifold:
    """Return a square or rectangular bowl with round corners."""
    r, h, foot = draw.about(0.070), draw.about(0.055), draw.between(0.5, 0.9)
    shape = superellipse(draw.between(0.6, 1.0), draw.between(3.5, 7.0), 36)
    side = [(foot * r, 0.0), (foot * r + 0.004, 0.004),
            (r * draw.between(0.9, 0.97), 0.45 * h), (r, h)]
    return vessel(side, draw.about(0.004, 0.25), level(draw, 0.006, h), shape)


def salad_bowl(draw: Draw) -> Manifold:
    """Return a wide, shallow bowl with a thick wall, as of wood."""
    r, h = draw.about(0.110), draw.about(0.060, 0.2)
    side = np.vstack([[(0.45 * r, 0.0)], curve([
        (0.5 * r, 0.002), (0.8 * r, 0.32 * h), (0.95 * r, 0.68 * h), (r, h)], 7)])
    return vessel(side, draw.about(0.008, 0.3), level(draw, draw.about(0.009, 0.2), h))


def pedestal_bowl(draw: Draw) -> Manifold:
    """Return a dish on a pedestal: for ice cream, fruit or sweets."""
    r, h, stem = draw.about(0.055, 0.2), draw.about(0.045), draw.between(0.018, 0.045)
    thin = r * draw.between(0.18, 0.3)
    side = np.vstack([[(0.6 * r, 0.0), (0.6 * r, 0.004), (thin, 0.4 * stem), (thin, stem)], curve([
        (1.3 * thin, stem + 0.003), (0.8 * r, stem + 0.3 * h), (r, stem + h)], 6)])
    return vessel(side, draw.about(0.0035, 0.25), stem + 0.010)


def oval_dish(draw: Draw) -> Manifold:
    """Return an oval baking or serving dish, with or without grips on its rim."""
    r, h = draw.about(0.105), draw.about(0.052)
    shape = superellipse(draw.between(0.6, 0.8), draw.between(2.0, 3.0), 36)
    side = [(0.78 * r, 0.0), (0.84 * r, 0.004), (0.96 * r, 0.7 * h), (r, h)]
    solid = vessel(side, draw.about(0.005, 0.25), level(draw, 0.006, h), shape)
    if draw.chance(0.5):
        grip = cylinder(draw.about(0.030), 0.006, segments=20)
        inside = cavity(side, 0.004, 0.006, shape)
        for x in (-r, r):
            solid += grip.scale((0.7, 1.0, 1.0)).translate((x, 0.0, h - 0.008)) - inside
    return solid


def lion_bowl(draw: Draw) -> Manifold:
    """Return a soup bowl with two handles or with one, as of a porringer."""
    r, h = draw.about(0.062), draw.about(0.062)
    side = np.vstack([[(0.55 * r, 0.0)], curve([
        (0.6 * r, 0.004), (0.92 * r, 0.35 * h), (r, 0.8 * h), (1.02 * r, h)], 7)])
    inside = cavity(side, draw.about(0.0045, 0.2), level(draw, 0.007, h))
    handle = loop(side, 0.86 * h, h * draw.between(0.42, 0.55), draw.about(0.024, 0.25),
                  draw.about(0.0045, 0.2), draw.about(0.008, 0.3), draw.pick('round', 'square'))
    both = draw.chance(0.7)
    return handled(side, inside, handle, *([handle.rotate((0.0, 0.0, 180.0))] if both else []))


def dog_bowl(draw: Draw) -> Manifold:
    """Return a feeding bowl: its foot wider than its rim, with a shallower well inside."""
    r, h = draw.about(0.085, 0.2), draw.about(0.055)
    top = r * draw.between(0.78, 0.95)
    side = [(r, 0.0), (r, 0.004), (top, h)]
    well = [(0.8 * top, h * draw.between(0.15, 0.4)), (0.92 * top, 0.75 * h),
            (top - 0.004, h + 0.0005), (top - 0.004, h + 0.01)]
    return filled(side, 32) - filled(well, 32)


def fluted_bowl(draw: Draw) -> Manifold:
    """Return a ramekin, a moulded or a scalloped bowl: waves around its wall."""
    r, h, foot = draw.about(0.055, 0.25), draw.about(0.048, 0.2), draw.between(0.6, 1.0)
    side = [(foot * r, 0.0), (0.5 * (1 + foot) * r, 0.4 * h), (r, h)]
    waves = draw.pick(12, 16, 8)
    shape = fluted(waves, draw.between(0.5, 0.9) / waves, 48 // waves + 2)
    wall, floor = draw.about(0.005, 0.2), level(draw, 0.006, h)
    return vessel(side, wall, floor, shape) if draw.chance(0.6) else handled(
        side, cavity(side, wall + 0.06 * r, floor), shape=shape)


def drawn_in_bowl(draw: Draw) -> Manifold:
    """Return a bowl whose wall leans in at the top, as a fish bowl or a sugar bowl."""
    r, h = draw.about(0.070, 0.2), draw.about(0.075, 0.2)
    side = np.vstack([[(0.5 * r, 0.0)], curve([
        (0.56 * r, 0.003), (0.96 * r, 0.33 * h), (0.98 * r, 0.62 * h),
        (r * draw.between(0.7, 0.88), h)], 9)])
    return vessel(side, draw.about(0.004, 0.3), level(draw, 0.006, h))


STYLES = {'bowl': (bowl, hemisphere, straight_bowl, conical_bowl, salad_bowl, rimmed_bowl,
                   square_bowl, oval_dish, lion_bowl, pedestal_bowl, dog_bowl, fluted_bowl,
                   drawn_in_bowl)}
