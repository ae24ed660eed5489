# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Jugs: bellied, straight, conical and square ones, with lips, spouts, lids and handles."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import box, content, curve, cylinder, filled
from hooc_perception.objects.catalogue.vessel_parts import (
    body,
    cavity,
    ear,
    handled,
    level,
    lip,
    loop,
    rod,
    superellipse,
)
from manifold3d import Manifold
import numpy as np


def jug(draw: Draw) -> Manifold:
    """Return a bellied jug with a lip to pour from and a large handle."""
    size, up, wall, grip = (draw.about(1.0), draw.about(1.0, 0.12), draw.about(1.0, 0.2),
                            draw.about(1.0, 0.15))
    side = np.vstack([[(0.046, 0.0)], curve([(0.050, 0.004), (0.062, 0.050), (0.060, 0.100),
                                             (0.047, 0.150), (0.050, 0.195)], 10)])
    side = side * (1.0, up)
    rise = 0.195 * up - 0.195
    spout = cylinder(0.010, 0.050, top=0.030).translate((-0.040, 0.0, 0.145 + rise))
    spout_inside = cylinder(0.0065, 0.060, top=0.032).translate((-0.040, 0.0, 0.147 + rise))
    inside = content(side, 0.0035 * wall, 0.006) + spout_inside
    line = np.array([(0.046, 0.178), (0.080, 0.186), (0.108, 0.150), (0.100, 0.095),
                     (0.056, 0.055)])
    line[:, 0] += (grip - 1.0) * np.maximum(line[:, 0] - 0.065, 0.0)
    handle = ear(line * (1.0, up), 0.006 * draw.about(1.0, 0.2), 0.009 * draw.about(1.0, 0.2), 16)
    solid = (filled(side) + spout - inside) + (handle - inside)
    return solid if size == 1.0 else solid.scale((size, size, size))


def pitcher(draw: Draw) -> Manifold:
    """Return a straight pitcher with a lip and a long D handle."""
    r, h = draw.about(0.052), draw.about(0.195)
    side = [(r - 0.003, 0.0), (r, 0.004), (r * draw.between(0.92, 1.06), h)]
    spout, open_spout = lip(side, draw.about(0.026), 0.003)
    inside = cavity(side, draw.about(0.0035, 0.2), level(draw, 0.006, h)) + open_spout
    handle = loop(side, h * draw.between(0.84, 0.92), h * draw.between(0.15, 0.35),
                  draw.about(0.045, 0.2), draw.about(0.006, 0.2), draw.about(0.010, 0.2),
                  draw.pick('round', 'ear', 'square'))
    return body(side) + spout - inside + (handle - inside)


def milk_pitcher(draw: Draw) -> Manifold:
    """Return a barista's milk jug: wide at the foot, a pointed spout and a strap handle."""
    r, h = draw.about(0.046), draw.about(0.110)
    side = np.vstack([[(r - 0.004, 0.0)], curve([(r, 0.004), (0.97 * r, 0.3 * h),
                                                 (0.74 * r, 0.72 * h), (0.80 * r, h)], 8)])
    spout, open_spout = lip(side, draw.about(0.024, 0.12), 0.003)
    inside = cavity(side, draw.about(0.003, 0.15), level(draw, 0.005, h)) + open_spout
    handle = loop(side, 0.86 * h, h * draw.between(0.16, 0.35), draw.about(0.034, 0.2),
                  draw.about(0.0035), draw.about(0.008, 0.2), draw.pick('ear', 'square'))
    return body(side) + spout - inside + (handle - inside)


def measuring_jug(draw: Draw) -> Manifold:
    """Return a measuring jug whose handle hangs from its rim, open or closed below."""
    r, h, foot = draw.about(0.062, 0.2), draw.about(0.135), draw.between(0.68, 0.92)
    side = [(foot * r - 0.003, 0.0), (foot * r, 0.004), (r, h)]
    spout, open_spout = lip(side, draw.about(0.030), 0.003)
    inside = cavity(side, draw.about(0.004, 0.2), level(draw, 0.006, h)) + open_spout
    reach, low = draw.about(0.042), h * draw.between(0.12, 0.3)
    thick, broad = draw.about(0.0055, 0.2), draw.about(0.009, 0.2)
    if draw.chance(0.5):
        handle = ear([(r - 0.005, 0.90 * h), (r + 0.7 * reach, 0.90 * h), (r + reach, 0.72 * h),
                      (r + 0.95 * reach, 0.45 * h), (r + 0.8 * reach, low)], thick, broad, 14, 8)
    else:
        handle = loop(side, 0.88 * h, low, reach, thick, broad, 'square')
    return body(side) + spout - inside + (handle - inside)


def creamer(draw: Draw) -> Manifold:
    """Return a small round cream jug with a wide lip."""
    r, h = draw.about(0.038), draw.about(0.080)
    side = np.vstack([[(0.62 * r, 0.0)], curve([
        (0.65 * r, 0.003), (r, 0.38 * h), (r * draw.between(0.66, 0.85), 0.8 * h),
        (r * draw.between(0.78, 0.95), h)], 8)])
    spout, open_spout = lip(side, draw.about(0.020, 0.12), 0.003)
    inside = cavity(side, draw.about(0.0035, 0.15), level(draw, 0.006, h)) + open_spout
    handle = loop(side, 0.9 * h, 0.35 * h, draw.about(0.026, 0.2), draw.about(0.0035, 0.2),
                  draw.about(0.005, 0.2), draw.pick('ear', 'round'))
    return body(side) + spout - inside + (handle - inside)


def carafe(draw: Draw) -> Manifold:
    """Return a carafe without a handle: a wide body, a neck and a flared mouth."""
    r, h, neck = draw.about(0.055), draw.about(0.230, 0.12), draw.between(0.40, 0.6)
    side = np.vstack([[(0.8 * r, 0.0)], curve([
        (0.85 * r, 0.004), (r, 0.22 * h), (0.8 * r, 0.48 * h), (neck * r, 0.74 * h),
        (neck * r * draw.between(1.15, 1.5), h)], 9)])
    inside = cavity(side, draw.about(0.003, 0.2), level(draw, 0.007, h))
    if draw.chance(0.5):
        spout, open_spout = lip(side, 0.016, 0.003)
        return body(side) + spout - inside - open_spout
    return handled(side, inside)


def filter_jug(draw: Draw) -> Manifold:
    """Return a water filter jug: oval, with a lid, a beak and a bracket for a handle."""
    r, h = draw.about(0.085, 0.12), draw.about(0.220, 0.12)
    shape = superellipse(draw.between(0.5, 0.75), draw.between(2.2, 4.0))
    side = [(0.82 * r, 0.0), (0.85 * r, 0.005), (r, 0.9 * h), (r, 0.96 * h), (0.9 * r, h)]
    beak = cylinder(0.012, 0.055, top=0.030, segments=20).translate((-0.98 * r, 0, 0.9 * h - 0.05))
    handle = loop(side, 0.9 * h, h * draw.between(0.2, 0.4), draw.about(0.042),
                  draw.about(0.007), draw.about(0.011), draw.pick('square', 'ear'), sink=0.012)
    return body(side, shape) + beak + handle


def pitcher_with_lid(draw: Draw) -> Manifold:
    """Return a plastic pitcher that widens upwards, its lid on, with a long handle."""
    r, h, foot = draw.about(0.062, 0.12), draw.about(0.230, 0.12), draw.between(0.74, 0.92)
    side = [(foot * r, 0.0), (r, h), (r + 0.003, h + 0.001), (r + 0.003, h + 0.012),
            (0.6 * r, h + draw.between(0.013, 0.022))]
    beak = cylinder(0.010, 0.045, top=0.026, segments=20).translate((-r + 0.006, 0, h - 0.040))
    handle = loop(side, 0.92 * h, h * draw.between(0.18, 0.4), draw.about(0.045),
                  draw.about(0.008, 0.2), draw.about(0.012, 0.2), draw.pick('ear', 'square'))
    return body(side) + beak + handle


def ewer(draw: Draw) -> Manifold:
    """Return a jug with a narrow neck, a wide mouth and a handle that is higher than its rim."""
    r, h = draw.about(0.050), draw.about(0.215)
    side = np.vstack([[(0.66 * r, 0.0), (0.64 * r, 0.006)], curve([
        (0.62 * r, 0.008), (r, 0.36 * h), (0.78 * r, 0.58 * h),
        (r * draw.between(0.38, 0.5), 0.78 * h), (r * draw.between(0.55, 0.75), h)], 9)])
    spout, open_spout = lip(side, draw.about(0.022, 0.12), 0.003)
    inside = cavity(side, 0.0035, level(draw, 0.010, h)) + open_spout
    handle = loop(side, 0.93 * h, h * draw.between(0.4, 0.55), draw.about(0.032, 0.2),
                  draw.about(0.005, 0.2), draw.about(0.007, 0.2), 'ear')
    return body(side) + spout - inside + (handle - inside)


def thermos(draw: Draw) -> Manifold:
    """Return a closed insulated jug: shoulders, a lid with a beak and a bracket handle."""
    r, h = draw.about(0.058, 0.12), draw.about(0.235, 0.14)
    side = np.vstack([[(r - 0.003, 0.0), (r, 0.003), (r, 0.6 * h)], curve([
        (r, 0.62 * h), (0.9 * r, 0.76 * h), (0.58 * r, 0.87 * h), (0.56 * r, 0.95 * h)], 7),
        [(0.45 * r, h)]])
    beak = rod([(0.0, 0.93 * h), (-0.5 * r, 0.94 * h), (-0.9 * r, 0.96 * h)],
               [0.5 * r, 0.4 * r, 0.012], [0.02, 0.016, 0.008], 6)
    handle = loop(side, 0.9 * h, h * draw.between(0.2, 0.5), draw.about(0.034),
                  draw.about(0.007, 0.2), draw.about(0.011, 0.2), draw.pick('square', 'ear'))
    return body(side) + beak + handle


def milk_can(draw: Draw) -> Manifold:
    """Return a square plastic jug for milk or detergent: closed, its grip in a corner."""
    r, h = draw.about(0.066), draw.about(0.215, 0.12)
    shape = superellipse(draw.between(0.65, 1.0), draw.between(3.5, 6.0))
    side = [(0.92 * r, 0.0), (r, 0.008), (r, 0.55 * h), (0.93 * r, 0.68 * h), (0.34 * r, 0.88 * h),
            (0.30 * r, 0.90 * h), (0.30 * r, 0.94 * h), (0.36 * r, 0.945 * h), (0.36 * r, h)]
    hole = box(0.34 * r, 3 * r, 0.3 * h, at=(0.52 * r, 0.0, 0.43 * h))
    grip = rod([(0.15 * r, 0.82 * h), (0.66 * r, 0.80 * h), (0.84 * r, 0.70 * h)],
               0.2 * r, 0.14 * r, 8)
    back = box(0.26 * r, 0.4 * r, 0.36 * h, at=(0.80 * r, 0.0, 0.40 * h))
    return body(side, shape) - hole + (grip + back)


def watering_jug(draw: Draw) -> Manifold:
    """Return a closed pot with a tube for a spout: a teapot, a kettle or a watering can."""
    r, h = draw.about(0.058), draw.about(0.115, 0.2)
    side = np.vstack([[(0.75 * r, 0.0)], curve([
        (0.8 * r, 0.003), (r, 0.38 * h), (0.86 * r, 0.78 * h), (0.55 * r, h)], 8),
        [(0.2 * r, 1.06 * h)]])
    tip = r + draw.about(0.048, 0.2)
    spout = rod([(-0.7 * r, 0.28 * h), (-0.5 * (r + tip), 0.45 * h), (-tip, draw.between(
        0.85, 1.05) * h)], [0.018, 0.012, 0.008], [0.018, 0.012, 0.008], 8)
    handle = loop(side, 0.84 * h, 0.25 * h, draw.about(0.038, 0.2), draw.about(0.005, 0.2),
                  draw.about(0.007, 0.2), draw.pick('ear', 'round'), sink=0.006)
    knob = cylinder(0.009, 0.018, at=(0.0, 0.0, 1.05 * h), top=0.012, segments=16)
    return body(side) + spout + handle + knob


STYLES = {'jug': (jug, pitcher, milk_pitcher, measuring_jug, filter_jug, carafe, creamer, ewer,
                  pitcher_with_lid, thermos, milk_can, watering_jug)}
