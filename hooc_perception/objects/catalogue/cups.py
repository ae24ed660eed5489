# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Teacups: mugs, espresso cups, tea bowls and travel cups."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import content, curve, cylinder, filled
from hooc_perception.objects.catalogue.vessel_parts import (
    body,
    cavity,
    ear,
    handled,
    level,
    loop,
    superellipse,
    vessel,
)
from manifold3d import Manifold
import numpy as np


def teacup(draw: Draw) -> Manifold:
    """Return a wide cup on a foot, with a handle."""
    across, up, wall, grip = (draw.about(1.0), draw.about(1.0), draw.about(1.0, 0.25),
                              draw.about(1.0, 0.2))
    side = np.vstack([[(0.024, 0.0), (0.025, 0.005)],
                      curve([(0.025, 0.005), (0.036, 0.022), (0.042, 0.045), (0.046, 0.066)], 9)])
    side = side * (across, up)
    inside = content(side, 0.003 * wall, level(draw, 0.009 * up, 0.066 * up))
    line = np.array([(0.040, 0.055), (0.058, 0.060), (0.070, 0.046), (0.060, 0.028),
                     (0.034, 0.022)])
    line[:, 0] += (grip - 1.0) * np.maximum(line[:, 0] - 0.046, 0.0)
    handle = ear(line * (across, up), 0.0035 * draw.about(1.0, 0.2),
                 0.0055 * draw.about(1.0, 0.25))
    foot = cylinder(0.019 * across, 0.003, at=(0.0, 0.0, -0.001))
    return filled(side) - inside - foot + (handle - inside)


def mug(draw: Draw) -> Manifold:
    """Return a straight mug with a D handle."""
    r, h = draw.about(0.041, 0.12), draw.about(0.092, 0.14)
    side = [(r - 0.004, 0.0), (r, 0.004), (r, h)]
    inside = cavity(side, draw.about(0.004, 0.25), level(draw, 0.006, h))
    handle = loop(side, h * draw.between(0.78, 0.9), h * draw.between(0.14, 0.28),
                  draw.about(0.030, 0.2), draw.about(0.0045, 0.2), draw.about(0.007, 0.25),
                  draw.pick('round', 'ear', 'drop'))
    return handled(side, inside, handle)


def espresso_cup(draw: Draw) -> Manifold:
    """Return a small cup with a thick wall, a round bottom and a ring to hold."""
    r, h = draw.about(0.030), draw.about(0.055)
    side = np.vstack([[(0.6 * r, 0.0)], curve([(0.62 * r, 0.002), (0.85 * r, 0.2 * h),
                                               (0.98 * r, 0.6 * h), (r, h)], 7)])
    inside = cavity(side, draw.about(0.004, 0.2), level(draw, 0.007, h))
    middle, ring = h * draw.between(0.5, 0.62), h * draw.between(0.22, 0.3)
    handle = loop(side, middle + ring, middle - ring, draw.about(0.020, 0.2),
                  draw.about(0.003), draw.about(0.0045, 0.25), 'round')
    return handled(side, inside, handle)


def beaker(draw: Draw) -> Manifold:
    """Return a cup without a handle."""
    r, h = draw.about(0.037), draw.about(0.080)
    foot = draw.between(0.62, 0.95)
    side = np.vstack([[(foot * r - 0.004, 0.0)], curve([
        (foot * r, 0.004), (0.5 * (1 + foot) * r * draw.between(1.0, 1.06), 0.45 * h),
        (r, h)], 6)])
    return vessel(side, draw.about(0.0035, 0.3), level(draw, 0.006, h))


def conical_mug(draw: Draw) -> Manifold:
    """Return a mug that widens towards its rim, with an angular handle."""
    r, h, foot = draw.about(0.044, 0.12), draw.about(0.098), draw.between(0.55, 0.8)
    side = [(foot * r - 0.002, 0.0), (foot * r, 0.003), (r, h)]
    inside = cavity(side, draw.about(0.0035, 0.25), level(draw, 0.006, h))
    handle = loop(side, h * draw.between(0.8, 0.88), h * draw.between(0.25, 0.4),
                  draw.about(0.028, 0.2), draw.about(0.004, 0.2), draw.about(0.0065, 0.25),
                  draw.pick('square', 'ear'))
    return handled(side, inside, handle)


def barrel_mug(draw: Draw) -> Manifold:
    """Return a bellied mug with a large ear."""
    r, h = draw.about(0.039, 0.12), draw.about(0.088)
    belly = draw.between(1.08, 1.3)
    side = np.vstack([[(0.78 * r, 0.0)], curve([(0.82 * r, 0.003), (belly * r, 0.42 * h),
                                               (r, 0.85 * h), (r * draw.between(0.97, 1.06), h)],
                                              9)])
    inside = cavity(side, draw.about(0.004, 0.25), level(draw, 0.007, h))
    handle = loop(side, 0.84 * h, h * draw.between(0.18, 0.3), draw.about(0.026, 0.2),
                  draw.about(0.005, 0.2), draw.about(0.008, 0.25), draw.pick('ear', 'round'))
    return handled(side, inside, handle)


def square_mug(draw: Draw) -> Manifold:
    """Return a mug of nearly square outline."""
    r, h = draw.about(0.037, 0.12), draw.about(0.088)
    shape = superellipse(1.0, draw.between(3.5, 7.0), 36)
    side = [(r * draw.between(0.8, 1.0), 0.0), (r, 0.25 * h), (r * draw.between(1.0, 1.08), h)]
    inside = cavity(side, draw.about(0.004, 0.2), level(draw, 0.007, h), shape)
    handle = loop(side, 0.82 * h, 0.24 * h, draw.about(0.028, 0.2), draw.about(0.0045, 0.2),
                  draw.about(0.0065, 0.25), draw.pick('square', 'round'))
    return handled(side, inside, handle, shape=shape)


def two_eared_cup(draw: Draw) -> Manifold:
    """Return a soup cup or child's cup with two handles."""
    r, h, foot = draw.about(0.048), draw.about(0.066), draw.between(0.6, 0.85)
    side = np.vstack([[(foot * r, 0.0)], curve([(foot * r + 0.001, 0.003), (0.93 * r, 0.4 * h),
                                                (r, h)], 7)])
    inside = cavity(side, draw.about(0.0035, 0.25), level(draw, 0.007, h))
    handle = loop(side, h * draw.between(0.78, 0.9), h * draw.between(0.25, 0.45),
                  draw.about(0.024, 0.25), draw.about(0.004, 0.2), draw.about(0.006, 0.25),
                  draw.pick('round', 'ear'))
    return handled(side, inside, handle, handle.rotate((0.0, 0.0, 180.0)))


def tea_bowl(draw: Draw) -> Manifold:
    """Return a small bowl of tea on a foot ring, without a handle."""
    r, h, neck = draw.about(0.046, 0.2), draw.about(0.056), draw.between(0.42, 0.55)
    side = np.vstack([[(neck * r, 0.0), (neck * r, 0.006)], curve([
        (neck * r + 0.002, 0.007), (0.86 * r, 0.42 * h), (r, h)], 7)])
    foot = cylinder(neck * r - 0.004, 0.004, at=(0.0, 0.0, -0.001), segments=24)
    return vessel(side, draw.about(0.003, 0.25), level(draw, 0.011, h)) - foot


def cappuccino_cup(draw: Draw) -> Manifold:
    """Return a wide, nearly hemispherical cup with a handle of a flat tab or a thick ring."""
    r, h = draw.about(0.050, 0.12), draw.about(0.060)
    side = np.vstack([[(0.45 * r, 0.0), (0.46 * r, 0.003)], curve([
        (0.5 * r, 0.004), (0.84 * r, 0.32 * h), (0.97 * r, 0.7 * h), (r, h)], 7)])
    inside = cavity(side, draw.about(0.0045, 0.2), level(draw, 0.009, h))
    thick = draw.about(0.0045, 0.2)
    handle = loop(side, 0.86 * h, 0.42 * h, draw.about(0.027, 0.2), thick,
                  draw.about(0.006, 0.25), draw.pick('round', 'ear', 'square'))
    if draw.chance(0.4):
        handle += cylinder(0.012, 0.004, at=(r + 0.012, 0.0, 0.86 * h), segments=20).scale(
            (1.0, 0.8, 1.0))
    return handled(side, inside, handle)


def enamel_mug(draw: Draw) -> Manifold:
    """Return a wide camping mug of sheet steel with a rolled rim and a strap handle."""
    r, h = draw.about(0.043), draw.about(0.078)
    side = [(r - 0.005, 0.0), (r, 0.006), (r, h - 0.005), (r + 0.0025, h - 0.003),
            (r + 0.002, h)]
    inside = cavity(side, 0.003, level(draw, 0.004, h))
    handle = loop(side, h * draw.between(0.82, 0.9), h * draw.between(0.2, 0.4),
                  draw.about(0.036, 0.2), 0.0025, draw.about(0.009, 0.2),
                  draw.pick('drop', 'ear', 'square'), sink=0.002)
    return handled(side, inside, handle)


def travel_mug(draw: Draw) -> Manifold:
    """Return a tall cup with a lid, with or without a handle."""
    r, h, foot = draw.about(0.042, 0.1), draw.about(0.135), draw.between(0.68, 0.92)
    side = [(foot * r - 0.002, 0.0), (foot * r, 0.003), (r, h)]
    lid = body([(r + 0.002, h - 0.008), (r + 0.002, h + 0.002), (0.9 * r, h + 0.003),
                (0.88 * r, h + 0.012)])
    lid -= cylinder(0.78 * r, 0.02, at=(0.0, 0.0, h + 0.006), segments=24)
    solid = body(side) + lid
    if draw.chance(0.5):
        solid += loop(side, 0.85 * h, h * draw.between(0.3, 0.45), draw.about(0.032, 0.2),
                      draw.about(0.005, 0.2), draw.about(0.008, 0.2),
                      draw.pick('square', 'ear', 'drop'))
    return solid


STYLES = {'teacup': (teacup, mug, espresso_cup, beaker, conical_mug, barrel_mug, square_mug,
                     two_eared_cup, tea_bowl, cappuccino_cup, enamel_mug, travel_mug)}
