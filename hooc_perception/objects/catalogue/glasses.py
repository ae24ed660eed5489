# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Glasses: tumblers, stemmed glasses, beer glasses and paper cups."""

from hooc_perception.core.arrays import Float64Array
from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import content, curve, filled
from hooc_perception.objects.catalogue.vessel_parts import (
    cavity,
    fluted,
    handled,
    level,
    loop,
    polygon,
    superellipse,
    vessel,
)
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def glass(draw: Draw) -> Manifold:
    """Return a tumbler that widens towards its rim."""
    across, up = draw.about(1.0), draw.about(1.0)
    side = [(0.028 * across, 0.0), (0.030 * across, 0.004 * up), (0.034 * across, 0.050 * up),
            (0.0375 * across, 0.115 * up)]
    wall, floor = 0.0025 * draw.about(1.0, 0.3), 0.010 * draw.about(1.0, 0.3)
    return filled(side) - content(side, wall, level(draw, floor, 0.115 * up))


def highball(draw: Draw) -> Manifold:
    """Return a straight, tall glass."""
    r, h = draw.about(0.031), draw.about(0.140, 0.14)
    side = [(r - 0.002, 0.0), (r, 0.002), (r * draw.between(0.98, 1.04), h)]
    return vessel(side, draw.about(0.0025, 0.25), level(draw, draw.about(0.010, 0.4), h))


def _stemmed(draw: Draw, foot: float, stem: float, bowl: npt.ArrayLike) -> Manifold:
    """Return a glass of a bowl's side line on a stem of a length and a foot of a radius."""
    thin = draw.about(0.0045, 0.2)
    bowl = np.asarray(bowl, float)
    side: Float64Array = np.vstack([
        [(foot, 0.0), (foot, 0.0025), (0.35 * foot, 0.006), (thin, 0.014), (thin, stem - 0.004)],
        bowl + (0.0, stem)])
    top = float(side[-1, 1])
    floor = stem + 0.006
    if draw.chance(0.15):
        floor += draw.between(0.5, 0.9) * (top - floor)
    return vessel(side, draw.about(0.0022, 0.2), floor)


def wine_glass(draw: Draw) -> Manifold:
    """Return a wine glass: an egg-shaped bowl on a stem."""
    r, h = draw.about(0.038), draw.about(0.090)
    bowl = curve([(0.006, 0.0), (0.72 * r, 0.18 * h), (r, 0.48 * h),
                  (r * draw.between(0.72, 0.95), h)], 9)
    return _stemmed(draw, draw.about(0.034), draw.about(0.075, 0.2), bowl)


def whisky_glass(draw: Draw) -> Manifold:
    """Return a low, broad glass of square or faceted outline with a thick floor."""
    r, h = draw.about(0.040, 0.12), draw.about(0.086)
    shape = draw.pick(polygon(8), superellipse(1.0, 5.0), polygon(6), polygon(10))
    side = [(r * draw.between(0.82, 1.0), 0.0), (r, 0.35 * h), (r * draw.between(0.98, 1.06), h)]
    return vessel(side, draw.about(0.004, 0.25), level(draw, draw.about(0.014, 0.3), h), shape)


def flute(draw: Draw) -> Manifold:
    """Return a champagne flute or another slender glass on a short or long stem."""
    r, h = draw.about(0.026), draw.about(0.130, 0.12)
    bowl = curve([(0.006, 0.0), (0.70 * r, 0.22 * h), (r, 0.62 * h),
                  (r * draw.between(0.86, 1.05), h)], 8)
    return _stemmed(draw, draw.about(0.030, 0.12), draw.between(0.022, 0.085), bowl)


def shot_glass(draw: Draw) -> Manifold:
    """Return a small glass with a thick floor, or the cup of a medicine bottle."""
    r, h = draw.about(0.025, 0.12), draw.about(0.062, 0.2)
    side = [(r * draw.between(0.68, 0.95), 0.0), (r, h)]
    return vessel(side, draw.about(0.003, 0.25), level(draw, 0.2 * h, h))


def pint(draw: Draw) -> Manifold:
    """Return a beer glass with a bulge below its rim, or waisted."""
    r, h, foot = draw.about(0.042, 0.12), draw.about(0.150, 0.12), draw.between(0.66, 0.8)
    if draw.chance(0.5):
        side = [(foot * r, 0.0), (0.90 * r, 0.68 * h), (1.03 * r, 0.76 * h), (1.03 * r, 0.81 * h),
                (0.96 * r, 0.88 * h), (r, h)]
    else:
        side = [(0.86 * r, 0.0), *curve([(0.86 * r, 0.004), (0.72 * r, 0.3 * h), (r, 0.72 * h),
                                         (0.98 * r, h)], 8)]
    return vessel(side, draw.about(0.003, 0.25), level(draw, 0.012, h))


def paper_cup(draw: Draw) -> Manifold:
    """Return a paper or plastic cup with a rolled rim and a recessed bottom."""
    r, h, foot = draw.about(0.042), draw.about(0.105, 0.2), draw.between(0.64, 0.8)
    side = [(foot * r, 0.0), (0.985 * r, h - 0.006), (r + 0.0025, h - 0.004), (r + 0.0025, h)]
    under = filled([(foot * r - 0.003, -0.001), (foot * r - 0.003, 0.005)], 32)
    return vessel(side, 0.0028, level(draw, 0.009, h)) - under


def beer_mug(draw: Draw) -> Manifold:
    """Return a heavy glass with a handle."""
    r, h = draw.about(0.042, 0.12), draw.about(0.130)
    side = [(r, 0.0), (r, 0.01), (r * draw.between(0.92, 1.0), 0.5 * h),
            (r * draw.between(0.90, 1.04), h)]
    inside = cavity(side, draw.about(0.005, 0.2), level(draw, 0.015, h))
    handle = loop(side, h * draw.between(0.78, 0.86), h * draw.between(0.16, 0.26),
                  draw.about(0.042, 0.12), draw.about(0.007), draw.about(0.009),
                  draw.pick('round', 'square', 'ear'))
    return handled(side, inside, handle)


def coupe(draw: Draw) -> Manifold:
    """Return a martini glass or a coupe: a wide, shallow bowl on a stem."""
    r, h = draw.about(0.050, 0.12), draw.about(0.048)
    bowl = draw.pick(np.array([(0.006, 0.0), (0.55 * r, 0.5 * h), (r, h)]),
                     curve([(0.006, 0.0), (0.75 * r, 0.22 * h), (r, 0.7 * h), (r, h)], 7))
    return _stemmed(draw, draw.about(0.034, 0.12), draw.about(0.085, 0.2), bowl)


def bulb(draw: Draw) -> Manifold:
    """Return a wine glass without a stem, or a tea light glass: round below, drawn in above."""
    r, h = draw.about(0.044, 0.12), draw.about(0.098)
    side = np.vstack([[(0.55 * r, 0.0)], curve([
        (0.6 * r, 0.003), (0.96 * r, 0.28 * h), (r, 0.45 * h),
        (r * draw.between(0.7, 0.92), h)], 9)])
    return vessel(side, draw.about(0.0025, 0.25), level(draw, 0.006, h))


def picardie(draw: Draw) -> Manifold:
    """Return a moulded tumbler: facets or flutes below a smooth, wider rim."""
    r, h, foot = draw.about(0.041), draw.about(0.090), draw.between(0.62, 0.8)
    side = [(foot * r, 0.0), (0.93 * r, 0.68 * h), (r, 0.74 * h), (r * 1.02, h)]
    shape = fluted(draw.pick(9, 8, 10), draw.between(0.03, 0.06), 5)
    inside = cavity(side, draw.about(0.0045, 0.2), level(draw, 0.009, h))
    return handled(side, inside, shape=shape)


def sundae_glass(draw: Draw) -> Manifold:
    """Return a footed glass with hardly any stem: for ice cream, cocktails or beer."""
    r, h = draw.about(0.039, 0.12), draw.about(0.140)
    side = np.vstack([[(0.8 * r, 0.0), (0.78 * r, 0.004), (0.32 * r, 0.012)], curve([
        (0.3 * r, 0.016), (0.62 * r, 0.32 * h), (0.74 * r, 0.6 * h), (r, h)], 8)])
    return vessel(side, draw.about(0.003, 0.2), level(draw, draw.about(0.028), h))


STYLES = {'glass': (glass, highball, wine_glass, flute, whisky_glass, picardie, paper_cup,
                    shot_glass, pint, beer_mug, coupe, bulb, sundae_glass)}
