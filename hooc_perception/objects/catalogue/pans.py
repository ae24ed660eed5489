# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Frying pans: skillets, saute pans, woks, saucepans, crepe and grill pans."""

from hooc_perception.core.arrays import Float64Array
from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import (
    box,
    content,
    curve,
    cylinder,
    ellipse,
    filled,
    sweep,
)
from hooc_perception.objects.catalogue.vessel_parts import (
    body,
    bow,
    cavity,
    level,
    lip,
    radius_at,
    rod,
    superellipse,
)
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def frying_pan(draw: Draw) -> Manifold:
    """Return a pan with a long, rising handle that ends in an eye."""
    across, up, long = draw.about(1.0), draw.about(1.0, 0.2), draw.about(1.0)
    wall, broad, lift = draw.about(1.0, 0.3), draw.about(1.0, 0.2), draw.about(1.0, 0.3)
    side = np.vstack([[(0.092, 0.0)], curve([(0.096, 0.002), (0.110, 0.024), (0.120, 0.046)], 5)])
    side = side * (across, up)
    inside = content(side, 0.004 * wall, 0.004 * wall, 56)
    line = curve([(0.105, 0.030), (0.150, 0.045), (0.220, 0.062), (0.300, 0.066)], 12)
    path = np.column_stack([line[:, 0], np.zeros(12), line[:, 1]])
    path[:, 2] = path[:, 2] * up + (lift - 1.0) * (path[:, 2] - 0.030)
    stretch = (across - 1.0) * 0.105 + (long - 1.0) * (path[:, 0] - 0.105)
    path[:, 0] += stretch
    width = np.interp(np.linspace(0, 1, 12), [0, 0.2, 0.8, 0.95, 1],
                      [0.008, 0.009, 0.014, 0.013, 0.008])
    handle = sweep(path, width * broad, 0.0075, sides=12)
    at = 0.284 + (across - 1.0) * 0.105 + (long - 1.0) * 0.179
    eye = ellipse(0.008, 0.005, at=(at, 0.0)).extrude(0.2)
    return (filled(side, 56) - inside) + (handle - inside - eye)


def _handle(draw: Draw, at: tuple[float, float], length: float, lift: float, bow: float,
            broad: npt.ArrayLike, thick: npt.ArrayLike, eye: bool = True) -> Manifold:
    """
    Return a handle that starts inside the wall of a pan.

    :param at: (x, z) of its start.
    :param lift: rise of its end over its start.
    :param bow: height of its middle over the straight line.
    :param broad: half widths along it.
    :param thick: half heights along it.
    """
    x, z = at
    points = [(x + t * length, z + t * lift + 4 * t * (1 - t) * bow) for t in (0, 0.33, 0.67, 1)]
    solid = rod(points, broad, thick, 12, 10)
    hole = 0.35 * float(np.ravel(broad)[-1])
    if eye and hole > 0.0025:
        place = (x + length - 2.4 * hole, 0.0, z - 0.3)
        solid -= cylinder(hole, 1.0, at=place, segments=12).scale((1.0, 1.0, 1.0))
    return solid


def _side(r: float, h: float, foot: float, belly: float = 0.0) -> Float64Array:
    """Return the side line of a pan: of a foot, a rim radius, and a bellied or straight wall."""
    middle = (0.5 * (foot + r) + belly * r, 0.42 * h)
    return np.vstack([[(foot - 0.004, 0.0)], curve([(foot, 0.003), middle, (r, h)], 5)])


def _grip(side: npt.ArrayLike, z: float, half: float, reach: float) -> Manifold:
    """Return a short grip at -x of a pan: half as wide as `half`, it stands out by `reach`."""
    radius = radius_at(side, z)
    edge = float(np.sqrt(radius ** 2 - half ** 2))
    grip = bow(half, reach + 0.6 * (radius - edge), 0.0055, 0.005)
    return grip.translate((edge - 0.002, 0.0, z)).rotate((0.0, 0.0, 180.0))


def _pan(side: npt.ArrayLike, wall: float, floor: float, handles: Manifold,
         shape: npt.ArrayLike | None = None) -> Manifold:
    """Return a pan of a side line with handles."""
    inside = cavity(side, wall, floor, shape, 32)
    return body(side, shape, 32) - inside + (handles - inside)


def saute_pan(draw: Draw) -> Manifold:
    """Return a deep pan with an upright wall."""
    r, h = draw.about(0.120), draw.about(0.068, 0.2)
    side = _side(r, h, r * draw.between(0.93, 0.99), 0.02)
    long = draw.about(0.195)
    handle = _handle(draw, (r - 0.005, 0.75 * h), long, draw.between(0.0, 0.06), 0.004,
                     [0.009, 0.010, 0.012, 0.010], [0.006, 0.005, 0.007, 0.006])
    return _pan(side, draw.about(0.004, 0.25), level(draw, 0.005, h), handle)


def crepe_pan(draw: Draw) -> Manifold:
    """Return a very shallow pan with a flat wide floor."""
    r, h = draw.about(0.122), draw.about(0.020, 0.2)
    side = _side(r, h, r * draw.between(0.84, 0.96))
    long = draw.about(0.180)
    handle = _handle(draw, (r - 0.008, 0.6 * h), long, draw.between(0.005, 0.05), 0.008,
                     [0.010, 0.008, 0.013, 0.011], [0.005, 0.006, 0.008, 0.006])
    return _pan(side, draw.about(0.004, 0.25), 0.004, handle)


def skillet(draw: Draw) -> Manifold:
    """Return a cast iron skillet: short flat handle, thick wall, two lips, a second grip."""
    r, h = draw.about(0.120, 0.2), draw.about(0.050, 0.2)
    side = _side(r, h, r * draw.between(0.82, 0.92))
    wall = draw.about(0.0055, 0.2)
    handle = _handle(draw, (r - 0.010, h - 0.012), draw.about(0.120, 0.2), draw.between(0, 0.02),
                     0.002, [0.012, 0.010, 0.016, 0.019, 0.015], [0.008, 0.006, 0.006, 0.005])
    if draw.chance(0.6):
        handle += _grip(side, h - 0.010, draw.about(0.036, 0.2), draw.about(0.024, 0.2))
    solid = _pan(side, wall, level(draw, 0.006, h), handle)
    if draw.chance(0.7):
        outer, inner = lip(side, 0.020, 0.003)
        inside = cavity(side, wall, 0.006, None, 32) + inner.rotate((0, 0, 90)) + inner.rotate(
            (0, 0, -90))
        solid = solid + outer.rotate((0, 0, 90)) + outer.rotate((0, 0, -90)) - inside
    return solid


def wok(draw: Draw) -> Manifold:
    """Return a wok: a deep round bowl with a handle."""
    r, h = draw.about(0.140, 0.14), draw.about(0.080)
    side = np.vstack([[(0.30 * r, 0.0)], curve([
        (0.34 * r, 0.002), (0.76 * r, 0.38 * h), (0.94 * r, 0.76 * h), (r, h)], 8)])
    lift = draw.between(0.02, 0.08)
    at = (radius_at(side, 0.8 * h) - 0.006, 0.8 * h)
    handle = _handle(draw, at, draw.about(0.180, 0.2), lift, 0.0,
                     [0.008, 0.009, 0.013, 0.012], [0.007, 0.008, 0.012, 0.010])
    if draw.chance(0.4):
        handle += _grip(side, h - 0.012, draw.about(0.045, 0.2), draw.about(0.028, 0.2))
    return _pan(side, draw.about(0.0035, 0.25), level(draw, 0.004, h), handle)


def saucepan(draw: Draw) -> Manifold:
    """Return a small, tall pan with a straight handle."""
    r, h = draw.about(0.085, 0.14), draw.about(0.090)
    side = [(r - 0.006, 0.0), (r, 0.006), (r * draw.between(0.98, 1.03), h)]
    long = draw.about(0.155)
    handle = _handle(draw, (r - 0.005, h * draw.between(0.7, 0.9)), long,
                     draw.between(-0.005, 0.04), 0.0, [0.007, 0.008, 0.011, 0.010],
                     [0.006, 0.006, 0.008, 0.007])
    return _pan(side, draw.about(0.003, 0.25), level(draw, 0.004, h), handle)


def steep_pan(draw: Draw) -> Manifold:
    """Return a pan with a flared wall and a steel strip that rises steeply, as of a French pan."""
    r, h = draw.about(0.125), draw.about(0.045, 0.2)
    side = _side(r, h, r * draw.between(0.68, 0.8))
    long = draw.about(0.215, 0.12)
    handle = _handle(draw, (radius_at(side, 0.6 * h) - 0.004, 0.6 * h), long,
                     draw.between(0.06, 0.12), draw.between(0.004, 0.018),
                     [0.014, 0.011, 0.012, 0.013, 0.010], 0.0035)
    return _pan(side, draw.about(0.0035, 0.2), level(draw, 0.004, h), handle)


def square_pan(draw: Draw) -> Manifold:
    """Return a square grill pan with ribs, or an oblong omelette pan."""
    r, h = draw.about(0.120, 0.14), draw.about(0.038, 0.25)
    aspect = draw.between(0.65, 1.0)
    shape = superellipse(aspect, draw.between(4.5, 8.0), 36)
    side = _side(r, h, r * draw.between(0.88, 0.95))
    handle = _handle(draw, (r - 0.008, 0.75 * h), draw.about(0.170), draw.between(0.0, 0.05),
                     0.004, [0.012, 0.009, 0.012, 0.011], [0.006, 0.006, 0.008, 0.007])
    solid = _pan(side, draw.about(0.0045, 0.2), 0.005, handle, shape)
    if draw.chance(0.5):
        for i in range(-2, 3):
            solid += box(1.4 * r, 0.005, 0.006, at=(0.0, 0.28 * i * aspect * r, 0.002))
    return solid


def lidded_pan(draw: Draw) -> Manifold:
    """Return a pan that is closed: by its lid with a knob, or filled as by a coarse scan."""
    r, h = draw.about(0.115), draw.about(0.056, 0.2)
    side = _side(r, h, r * draw.between(0.82, 0.95), 0.02)
    handle = _handle(draw, (r - 0.010, 0.75 * h), draw.about(0.185), draw.between(0.0, 0.05),
                     0.004, [0.009, 0.009, 0.013, 0.011], 0.007)
    solid = body(side, None, 32) + handle
    if draw.chance(0.6):
        rise = draw.about(0.018, 0.3)
        solid += body([(r + 0.002, h - 0.003), (r + 0.002, h), (0.7 * r, h + 0.65 * rise),
                       (0.02, h + rise)], None, 32)
        solid += body([(0.008, h + rise - 0.002), (0.008, h + rise + 0.010),
                       (0.017, h + rise + 0.016), (0.014, h + rise + 0.026)], None, 16)
    return solid


def toy_pan(draw: Draw) -> Manifold:
    """Return a small egg pan or a toy: thick wall, a short round handle."""
    r, h = draw.about(0.072), draw.about(0.030, 0.25)
    side = _side(r, h, r * draw.between(0.8, 0.95))
    handle = _handle(draw, (r - 0.006, 0.65 * h), draw.about(0.120, 0.2), draw.between(0, 0.03),
                     0.0, [0.006, 0.007, 0.009, 0.009], [0.006, 0.007, 0.009, 0.008],
                     draw.chance(0.5))
    return _pan(side, draw.about(0.004, 0.3), level(draw, 0.004, h), handle)


def kinked_pan(draw: Draw) -> Manifold:
    """Return a pan whose bracket drops or rises before a thick grip: with a kink."""
    r, h = draw.about(0.118), draw.about(0.050, 0.2)
    side = _side(r, h, r * draw.between(0.74, 0.9), draw.between(0.0, 0.04))
    z, kink = 0.72 * h, draw.between(0.018, 0.04)
    x = radius_at(side, z) - 0.005
    neck = rod([(x, z), (x + 0.025, z + 0.2 * kink), (x + 0.055, z + kink)], [0.013, 0.009, 0.010],
               0.005, 6, 8)
    grip = rod([(x + 0.045, z + kink), (x + 0.10, z + kink + 0.012),
                (x + draw.about(0.185, 0.12), z + kink + draw.between(0.0, 0.03))],
               [0.011, 0.013, 0.015, 0.012], [0.009, 0.011, 0.012, 0.009], 9)
    return _pan(side, draw.about(0.004, 0.25), level(draw, 0.005, h), neck + grip)


def paella_pan(draw: Draw) -> Manifold:
    """Return a pan with two short grips, or one whose handle has been taken off."""
    r, h = draw.about(0.145, 0.2), draw.about(0.042, 0.25)
    side = _side(r, h, r * draw.between(0.78, 0.94))
    wall = draw.about(0.004, 0.25)
    inside = cavity(side, wall, level(draw, 0.004, h), None, 32)
    solid = body(side, None, 32) - inside
    if draw.chance(0.75):
        grip = _grip(side, h - 0.010, draw.about(0.045, 0.2), draw.about(0.032, 0.25)) - inside
        return solid + grip + grip.rotate((0.0, 0.0, 180.0))
    return solid + (box(0.03, 0.04, 0.022, at=(r, 0.0, 0.5 * h)) - inside)


STYLES = {'frying_pan': (frying_pan, saute_pan, skillet, crepe_pan, wok, kinked_pan, saucepan,
                         steep_pan, lidded_pan, square_pan, toy_pan, paella_pan)}
