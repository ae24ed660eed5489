# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bottles: for drinks, sauces, detergents, shampoo, pills and sprays."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import box, curve, cylinder, filled
from hooc_perception.objects.catalogue.vessel_parts import body, fluted, rod, superellipse
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def bottle(draw: Draw) -> Manifold:
    """Return a closed bottle with shoulders, a neck and a cap."""
    across, up, neck = draw.about(1.0), draw.about(1.0, 0.12), draw.about(1.0)
    side = np.vstack([[(0.033, 0.0), (0.036, 0.004), (0.036, 0.140)],
                      curve([(0.036, 0.145), (0.032, 0.172), (0.018, 0.198), (0.0135, 0.225)], 9),
                      [(0.0135, 0.232)]])
    side = side * (across, up)
    side[-6:, 0] *= neck
    return filled(side) + cylinder(0.0165 * across * neck, 0.022, at=(0.0, 0.0, 0.230 * up))


def _capped(side: npt.ArrayLike, cap: float, height: float,
            shape: npt.ArrayLike | None = None) -> Manifold:
    """Return a closed bottle of a side line with a cap of a radius and a height."""
    top = float(np.asarray(side, float)[-1, 1])
    return body(side, shape) + cylinder(cap, height, at=(0.0, 0.0, top - 0.002), segments=24)


def wine_bottle(draw: Draw) -> Manifold:
    """Return a tall bottle with a long neck: for wine, beer, oil or spirits."""
    r, h = draw.about(0.036, 0.12), draw.about(0.290, 0.12)
    shoulder, neck = draw.between(0.5, 0.68), draw.between(0.32, 0.42) * r
    side = np.vstack([[(r - 0.003, 0.0), (r, 0.004), (r, shoulder * h)], curve([
        (r, (shoulder + 0.01) * h), (0.86 * r, (shoulder + 0.07) * h),
        (1.15 * neck, (shoulder + draw.between(0.13, 0.2)) * h), (neck, 0.94 * h)], 8),
        [(neck + 0.002, 0.945 * h), (neck + 0.002, h)]])
    side[4:, 0] = np.maximum(side[4:, 0], neck)
    return body(side)


def squeeze_bottle(draw: Draw) -> Manifold:
    """Return an oval bottle with round shoulders and a pointed cap: mustard, glue, washing up."""
    r, h = draw.about(0.046, 0.14), draw.about(0.150)
    shape = superellipse(draw.between(0.5, 0.8), draw.between(2.0, 2.8))
    waist = draw.between(0.85, 1.0)
    side = np.vstack([[(0.9 * r, 0.0)], curve([
        (0.96 * r, 0.005), (waist * r, 0.45 * h), (0.95 * r, 0.78 * h), (0.62 * r, 0.95 * h),
        (0.4 * r, h)], 9)])
    cap = draw.about(0.015)
    tip = cylinder(cap, draw.about(0.030, 0.3), at=(0.0, 0.0, h - 0.002), segments=20,
                   top=cap * draw.between(0.25, 0.9))
    return body(side, shape) + tip


def flask(draw: Draw) -> Manifold:
    """Return a straight drinking bottle with a cap as wide as its body, or nearly."""
    r, h = draw.about(0.036, 0.14), draw.about(0.200)
    side = [(r - 0.004, 0.0), (r, 0.004), (r, 0.86 * h), (0.85 * r, 0.95 * h), (0.7 * r, 0.96 * h),
            (0.7 * r, h)]
    cap = r * draw.between(0.72, 0.98)
    solid = _capped(side, cap, draw.about(0.035, 0.25))
    if draw.chance(0.4):
        solid += cylinder(0.4 * cap, 0.04, at=(0.0, 0.0, h + 0.01), segments=16)
    return solid


def shampoo_bottle(draw: Draw) -> Manifold:
    """Return a flat upright bottle with sharp shoulders and a disc cap."""
    r, h = draw.about(0.038, 0.14), draw.about(0.180)
    shape = superellipse(draw.between(0.4, 0.65), draw.between(3.0, 6.0))
    side = [(0.92 * r, 0.0), (r, 0.006), (r * draw.between(0.9, 1.0), 0.88 * h),
            (0.8 * r, 0.96 * h), (0.42 * r, h)]
    return _capped(side, r * draw.between(0.34, 0.42), draw.about(0.022, 0.3), shape)


def soda_bottle(draw: Draw) -> Manifold:
    """Return a plastic bottle for drinks: a waist or rings, a dome and a small cap."""
    r, h = draw.about(0.034, 0.14), draw.about(0.230, 0.14)
    waist = draw.between(0.82, 0.98)
    side = np.vstack([[(0.72 * r, 0.0), (0.95 * r, 0.012)], curve([
        (r, 0.03), (r, 0.22 * h), (waist * r, 0.36 * h), (r, 0.52 * h), (0.96 * r, 0.66 * h),
        (0.6 * r, 0.82 * h), (0.36 * r, 0.93 * h)], 12)])
    ring = cylinder(0.46 * r, 0.003, at=(0.0, 0.0, 0.93 * h - 0.001), segments=24)
    return _capped(side, 0.42 * r, 0.018) + ring


def pump_bottle(draw: Draw) -> Manifold:
    """Return a dispenser for soap or lotion with a pump on top."""
    r, h = draw.about(0.036, 0.12), draw.about(0.130)
    shape = draw.pick(superellipse(), superellipse(0.7, 4.0), superellipse(1.0, 5.0))
    side = [(r - 0.003, 0.0), (r, 0.004), (r, 0.82 * h), (0.8 * r, 0.94 * h), (0.4 * r, h)]
    rise = draw.about(0.038, 0.2)
    stem = cylinder(0.0055, rise, at=(0.0, 0.0, h + 0.014), segments=12)
    nozzle = rod([(-0.010, h + rise + 0.014), (0.018, h + rise + 0.014),
                  (draw.about(0.038, 0.2), h + rise + draw.between(0.002, 0.012))],
                 [0.011, 0.009, 0.006], [0.008, 0.006, 0.004], 7, 8)
    return _capped(side, 0.4 * r, 0.020, shape) + stem + nozzle


def pill_bottle(draw: Draw) -> Manifold:
    """Return a small squat bottle or jar with a wide cap: for pills, spice or jam."""
    r, h = draw.about(0.031, 0.2), draw.about(0.075, 0.2)
    side = [(r - 0.002, 0.0), (r, 0.003), (r, 0.8 * h), (0.78 * r, 0.94 * h), (0.78 * r, h)]
    return _capped(side, r * draw.between(0.8, 1.02), draw.about(0.020, 0.2))


def spray_bottle(draw: Draw) -> Manifold:
    """Return a spray bottle with a trigger head."""
    r, h = draw.about(0.042, 0.12), draw.about(0.170, 0.12)
    shape = superellipse(draw.between(0.55, 1.0), draw.between(2.0, 3.5))
    side = np.vstack([[(0.93 * r, 0.0)], curve([
        (r, 0.006), (r, 0.45 * h), (0.66 * r, 0.72 * h), (0.36 * r, 0.92 * h), (0.33 * r, h)],
        9)])
    k = draw.about(1.0, 0.12)
    head = rod([(-0.030 * k, h + 0.040 * k), (0.0, h + 0.046 * k), (0.050 * k, h + 0.042 * k)],
               [0.008 * k, 0.013 * k, 0.012 * k, 0.009 * k], 0.011 * k, 8, 8)
    neck = cylinder(0.014, 0.042 * k, at=(0.0, 0.0, h), top=0.009, segments=16)
    trigger = rod([(0.024 * k, h + 0.042 * k), (0.030 * k, h + 0.020 * k),
                   (0.044 * k, h - 0.004 * k)], 0.006 * k, 0.004 * k, 6, 8)
    return _capped(side, 0.016, 0.014, shape) + (neck + head + trigger)


def sauce_bottle(draw: Draw) -> Manifold:
    """Return a bottle that tapers from its foot, or stands on its wide cap: ketchup, syrup."""
    r, h = draw.about(0.033), draw.about(0.165, 0.2)
    if draw.chance(0.5):
        side = np.vstack([[(r - 0.002, 0.0), (r, 0.003)], curve([
            (r, 0.01), (0.92 * r, 0.4 * h), (0.52 * r, 0.75 * h), (0.36 * r, h)], 8)])
        return _capped(side, draw.between(0.4, 0.5) * r, draw.about(0.022, 0.2))
    shape = superellipse(draw.between(0.6, 0.9), 2.5)
    side = np.vstack([[(0.85 * r, 0.0), (0.85 * r, 0.028), (0.70 * r, 0.030)], curve([
        (0.75 * r, 0.032), (1.15 * r, 0.55 * h), (1.0 * r, 0.92 * h), (0.75 * r, h)], 7)])
    return body(side, shape)


def milk_bottle(draw: Draw) -> Manifold:
    """Return a square bottle for juice, milk or spirits with a wide neck."""
    r, h = draw.about(0.034, 0.14), draw.about(0.205, 0.14)
    shape = superellipse(draw.between(0.75, 1.0), draw.between(4.0, 8.0))
    side = np.vstack([[(r - 0.003, 0.0), (r, 0.004), (r, 0.60 * h)], curve([
        (r, 0.62 * h), (0.82 * r, 0.76 * h), (0.5 * r, 0.90 * h), (0.46 * r, h)], 6)])
    return _capped(side, r * draw.between(0.48, 0.6), draw.about(0.018), shape)


def canister(draw: Draw) -> Manifold:
    """Return a detergent bottle with a hole to grip it by."""
    r, h = draw.about(0.060, 0.12), draw.about(0.215, 0.12)
    shape = superellipse(draw.between(0.42, 0.6), draw.between(2.6, 4.5))
    side = [(0.94 * r, 0.0), (r, 0.006), (r, 0.6 * h), (0.92 * r, 0.8 * h), (0.5 * r, 0.96 * h),
            (0.3 * r, h)]
    hole = box(draw.between(0.26, 0.36) * r, 0.2, 0.28 * h, at=(0.56 * r, 0.0, 0.45 * h))
    return _capped(side, draw.between(0.3, 0.42) * r, draw.about(0.030, 0.2), shape) - hole


def ribbed_bottle(draw: Draw) -> Manifold:
    """Return a small bottle with ribs or flutes along it: drops, perfume, tonic, yoghurt."""
    r, h = draw.about(0.030, 0.2), draw.about(0.120, 0.2)
    shape = fluted(draw.pick(8, 6, 10), draw.between(0.05, 0.12))
    side = [(0.95 * r, 0.0), (r, 0.004), (r, 0.66 * h), (0.75 * r, 0.82 * h), (0.45 * r, 0.9 * h),
            (0.42 * r, h)]
    return _capped(side, draw.between(0.46, 0.7) * r, draw.about(0.024, 0.3),
                   None if draw.chance(0.25) else shape)


STYLES = {'bottle': (bottle, wine_bottle, squeeze_bottle, shampoo_bottle, pill_bottle, flask,
                     spray_bottle, pump_bottle, milk_bottle, soda_bottle, canister, sauce_bottle,
                     ribbed_bottle)}
