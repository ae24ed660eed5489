# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of drills beside the common cordless one; they stand upright, the bit towards +x."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import bar, resized, rod, slab
from hooc_perception.objects.catalogue.shapes import (
    box,
    curve,
    cylinder,
    outline,
    rounded_box,
    sweep,
    union,
)
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def _barrel(rows: npt.ArrayLike, z: float, tall: float = 1.0, sides: int = 24) -> Manifold:
    """Return a body turned about x at height z; rows of (x, radius); `tall` stretches it."""
    rows = np.asarray(rows, float)
    profile = np.vstack([(0.0, rows[0, 0]), rows[:, ::-1], (0.0, rows[-1, 0])])
    solid = outline(profile).revolve(sides).rotate((0.0, 90.0, 0.0))
    return solid.scale((1.0, 1.0, tall)).translate((0.0, 0.0, z))


def _front(draw: Draw, x: float, z: float, chuck: float, long: float, bit: float) -> Manifold:
    """
    Return a chuck from x on, with or without a bit.

    :param chuck: radius; `long` its length.
    :param bit: length of the bit; 0 = none.
    """
    chuck, long = draw.about(chuck, 0.12), draw.about(long, 0.2)
    front = _barrel([(x - 0.008, 0.9 * chuck), (x, chuck), (x + 0.4 * long, chuck),
                     (x + 0.42 * long, 0.88 * chuck), (x + 0.75 * long, 0.85 * chuck),
                     (x + long, 0.42 * chuck)], z)
    if bit:
        front += cylinder(draw.about(0.0035, 0.35), 0.006 + draw.about(bit, 0.4),
                          at=(x + long - 0.006, 0.0, z), axis='x', segments=10)
    return front


def _grip(top: float, foot: float, low: float, high: float, deep: float,
          wide: float) -> Manifold:
    """Return a pistol grip from (foot, low) up to (top, high); half axes deep (x), wide (y)."""
    path = curve([(foot, 0.0, low), (0.6 * foot + 0.4 * top, 0.0, 0.5 * (low + high)),
                  (top, 0.0, high)], 8)
    return sweep(path, wide, deep * np.array([1.1, 1.0, 0.93, 0.9, 0.95, 1.05, 1.2, 1.35]), 14,
                 up=(1.0, 0.0, 0.0))


def compact_drill(draw: Draw) -> Manifold:
    """Return a short cordless drill on a small foot, without a bit."""
    z, r = draw.about(0.150, 0.1), draw.about(0.028)
    body = _barrel([(-0.068, 0.75 * r), (-0.060, r), (0.0, 1.02 * r), (0.024, 0.75 * r)], z, 1.1)
    grip = _grip(-0.024, -0.036, 0.012, z, draw.about(0.019), draw.about(0.0165))
    foot = rounded_box(draw.about(0.080, 0.2), draw.about(0.052, 0.2), draw.about(0.036, 0.2),
                       0.012, at=(-0.028, 0.0, 0.0))
    trigger = box(0.038, 0.012, 0.026, at=(-0.012, 0.0, z - r - 0.022))
    return resized(union(body, grip, foot, trigger,
                         _front(draw, 0.026, z, 0.019, 0.036, draw.pick(0.0, 0.0, 0.03))), draw)


def hammer_drill(draw: Draw) -> Manifold:
    """Return a large drill on a wide battery, with a side handle and a long bit."""
    z, r = draw.about(0.185, 0.1), draw.about(0.034)
    body = _barrel([(-0.095, 0.7 * r), (-0.085, 0.98 * r), (-0.01, r), (0.03, 0.95 * r),
                    (0.045, 0.75 * r), (0.062, 0.72 * r)], z, 1.1)
    grip = _grip(-0.022, -0.040, 0.04, z, draw.about(0.022), 0.0175)
    foot = union(rounded_box(draw.about(0.125), draw.about(0.076), 0.042, 0.012,
                             at=(-0.030, 0.0, 0.0)),
                 rounded_box(0.095, 0.056, 0.018, 0.012, at=(-0.036, 0.0, 0.040)))
    reach, thick = draw.about(0.140, 0.2), draw.about(0.0145, 0.2)
    collar = _barrel([(0.048, 0.95 * r), (0.062, 0.95 * r)], z)
    side = bar([(0.0, 0.009, 0.009), (0.3 * reach, 0.009, 0.009), (0.33 * reach, 1.3 * thick,
               1.3 * thick), (0.38 * reach, thick, thick), (0.9 * reach, 1.05 * thick,
               1.05 * thick), (reach, 0.7 * thick, 0.7 * thick)], 4)
    side = side.rotate((0.0, 0.0, 90.0 * draw.pick(1, 1, -1))).rotate(
        (draw.between(-30.0, 20.0), 0.0, 0.0)).translate((0.055, 0.0, z))
    return resized(union(body, grip, foot, collar, side,
                         _front(draw, 0.064, z, 0.0225, 0.045, draw.pick(0.09, 0.0))), draw)


def corded_drill(draw: Draw) -> Manifold:
    """Return a mains drill: a grip at its rear end, a geared chuck and a stub of cable."""
    z, r = draw.about(0.140), draw.about(0.032)
    body = _barrel([(-0.095, 0.8 * r), (-0.090, 0.95 * r), (-0.02, r), (0.04, 0.98 * r),
                    (0.055, 0.7 * r), (0.075, 0.6 * r)], z, 1.15)
    deep = draw.about(0.021)
    grip = _grip(-0.066, -0.085, 0.0, z, deep, draw.about(0.0165))
    trigger = box(0.024, 0.012, 0.032, at=(-0.050 + deep - 0.018, 0.0, z - r - 0.034))
    cable = rod(curve([(-0.075, 0.0, 0.016), (-0.100, 0.0, 0.009), (-0.130, 0.0, 0.007)], 6),
                0.0055, 10)
    return resized(union(body, grip, trigger, cable, _front(
        draw, 0.076, z, 0.0195, 0.045, draw.pick(0.0, 0.05))), draw)


def stick_battery_drill(draw: Draw) -> Manifold:
    """Return an older cordless drill: a long battery inside a straight, thick grip."""
    z, r = draw.about(0.165), draw.about(0.031)
    body = _barrel([(-0.088, 0.6 * r), (-0.075, 0.95 * r), (0.0, r), (0.045, 0.85 * r)], z,
                   draw.about(1.15, 0.1))
    grip = _grip(-0.018, -0.030, 0.01, z, draw.about(0.0235), draw.about(0.0195))
    foot = rounded_box(draw.about(0.068), draw.about(0.048), draw.about(0.026, 0.25), 0.013,
                       at=(-0.032, 0.0, 0.0))
    trigger = box(0.046, 0.014, 0.03, at=(-0.002, 0.0, z - r - 0.03))
    return resized(union(body, grip, foot, trigger, _front(
        draw, 0.047, z, 0.0215, 0.048, draw.pick(0.0, 0.04))), draw)


def impact_driver(draw: Draw) -> Manifold:
    """Return an impact driver: a stubby cone as nose, a thin socket, a hexagonal bit."""
    z, r = draw.about(0.160, 0.1), draw.about(0.031)
    body = _barrel([(-0.068, 0.85 * r), (-0.062, r), (0.0, r), (0.012, 0.95 * r),
                    (0.050, 0.5 * r), (0.055, 0.3 * r), (0.068, 0.28 * r)], z, 1.05)
    bit = cylinder(0.0036, draw.about(0.045, 0.35), at=(0.066, 0.0, z), axis='x', segments=6)
    grip = _grip(-0.026, -0.042, 0.02, z, draw.about(0.021), draw.about(0.0175))
    foot = rounded_box(draw.about(0.115), draw.about(0.070), draw.about(0.050, 0.2), 0.008,
                       at=(-0.024, 0.0, 0.0))
    trigger = box(0.038, 0.012, 0.028, at=(-0.012, 0.0, z - r - 0.024))
    parts = [body, grip, foot, trigger] + ([bit] if draw.chance(0.7) else [])
    return resized(union(*parts), draw)


def power_screwdriver(draw: Draw) -> Manifold:
    """Return a small pistol-shaped electric screwdriver without a foot."""
    z, r = draw.about(0.115), draw.about(0.0205)
    body = _barrel([(-0.060, 0.7 * r), (-0.052, r), (0.02, 0.95 * r), (0.045, 0.65 * r),
                    (0.060, 0.42 * r), (0.070, 0.4 * r)], z, 1.1)
    grip = _grip(-0.030, -0.052, 0.0, z, draw.about(0.0175), draw.about(0.016))
    bit = cylinder(0.0032, draw.about(0.03, 0.4), at=(0.068, 0.0, z), axis='x', segments=6)
    trigger = box(0.032, 0.010, 0.022, at=(-0.024, 0.0, z - r - 0.018))
    return resized(union(body, grip, bit, trigger), draw)


def centre_grip_drill(draw: Draw) -> Manifold:
    """Return a long, T-shaped drill with its grip in the middle and a tall battery."""
    z, r = draw.about(0.190, 0.1), draw.about(0.0275)
    body = _barrel([(-0.100, 0.85 * r), (-0.095, r), (-0.03, 1.03 * r), (0.04, 0.95 * r),
                    (0.055, 0.8 * r)], z, draw.about(1.1, 0.08))
    grip = _grip(-0.012, -0.014, 0.04, z, draw.about(0.019), draw.about(0.0165))
    foot = rounded_box(draw.about(0.085), draw.about(0.075), draw.about(0.070), 0.010,
                       at=(-0.012, 0.0, 0.0))
    trigger = box(0.040, 0.012, 0.03, at=(0.002, 0.0, z - r - 0.03))
    return resized(union(body, grip, foot, trigger, _front(
        draw, 0.057, z, 0.021, 0.042, draw.pick(0.06, 0.0))), draw)


def d_handle_drill(draw: Draw) -> Manifold:
    """Return a mains drill whose closed D-shaped grip is behind the motor."""
    z, r = draw.about(0.105), draw.about(0.034)
    body = _barrel([(-0.050, 0.85 * r), (-0.045, r), (0.045, r), (0.06, 0.75 * r),
                    (0.085, 0.65 * r)], z, 1.2)
    far, low = draw.about(0.115, 0.12), draw.between(-0.005, 0.02)
    line = curve([(-0.030, 0.0, z + 0.3 * r), (-far + 0.01, 0.0, z + 0.2 * r),
                  (-far - 0.004, 0.0, z - 0.03), (-far + 0.012, 0.0, low + 0.015),
                  (-0.030, 0.0, z - 0.9 * r)], 18)
    loop = sweep(line, draw.about(0.0155, 0.2), draw.about(0.0135, 0.2), 12, up=(0.0, 1.0, 0.0))
    return resized(union(body, loop, _front(draw, 0.086, z, 0.0205, 0.048, draw.pick(
        0.0, 0.07))), draw)


def simple_drill(draw: Draw) -> Manifold:
    """Return a drill as a coarse scan shows it: flat sides, the trigger's gap filled."""
    z, r = draw.about(0.160), draw.about(0.031)
    shape = outline([(-0.085, z - 0.7 * r), (-0.085, z + 0.7 * r), (-0.07, z + r), (0.03, z + r),
                     (0.045, z + 0.6 * r), (0.045, z - 0.7 * r), (0.005, z - r), (-0.005, 0.05),
                     (0.028, 0.034), (0.028, 0.0), (-0.078, 0.0), (-0.078, 0.034),
                     (-0.058, 0.05), (-0.050, z - r)])
    body = slab(shape, 2 * draw.about(0.023, 0.2))
    foot = rounded_box(0.108, 0.066 * draw.about(1.0), 0.040, 0.008, at=(-0.025, 0.0, 0.0))
    return resized(union(body, foot, _front(draw, 0.046, z, 0.020, 0.040, draw.pick(
        0.045, 0.0))), draw)


DRILLS = (compact_drill, hammer_drill, corded_drill, stick_battery_drill, power_screwdriver,
          impact_driver, centre_grip_drill, d_handle_drill, simple_drill)
