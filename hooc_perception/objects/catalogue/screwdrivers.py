# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of screwdrivers beside the fluted one; they lie along x, the tip towards +x."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import bar, resized, smooth
from hooc_perception.objects.catalogue.shapes import box, cylinder, outline, union
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def _turned(rows: npt.ArrayLike, sides: int = 20) -> Manifold:
    """Return a solid turned about x; rows of (x, radius), x rising."""
    rows = np.asarray(rows, float)
    profile = np.vstack([(0.0, rows[0, 0]), rows[:, ::-1], (0.0, rows[-1, 0])])
    return outline(profile).revolve(sides).rotate((0.0, 90.0, 0.0))


def _lobed(rows: npt.ArrayLike, lobes: int, depth: float) -> Manifold:
    """Return such a solid with lengthwise flutes of a depth relative to the radius."""
    def fluted(points: npt.ArrayLike) -> npt.NDArray[np.float64]:
        out = np.array(points)
        angle = np.arctan2(out[:, 2], out[:, 1])
        out[:, 1:] *= (1.0 + depth * np.cos(lobes * angle))[:, None]
        return out
    return _turned(rows, 5 * lobes).warp_batch(fluted)


def _shaft(draw: Draw, start: float, length: float, radius: float, flat: bool | None = None,
           sides: int = 12) -> Manifold:
    """Return a shaft from x = start with a flat or a cross tip."""
    radius = draw.about(radius, 0.2)
    flat = draw.chance(0.5) if flat is None else flat
    end = start + length
    shaft = cylinder(radius, length, at=(start, 0.0, 0.0), axis='x', segments=sides)
    if not flat:
        return shaft + cylinder(radius, 2.2 * radius, at=(end - 1e-4, 0.0, 0.0), axis='x',
                                top=0.3 * radius, segments=8)
    low, high = 1.5 * radius, draw.about(1.25 * radius, 0.2)
    return shaft + (box(0.001, 1.5 * radius, 1.9 * radius, at=(end - 0.002, 0.0, -0.95 * radius))
                    + box(0.001, 2 * high, 0.35 * radius, at=(end + 3 * low, 0.0,
                                                              -0.175 * radius))).hull()


def stubby_screwdriver(draw: Draw) -> Manifold:
    """Return a stubby screwdriver: a ball-like handle and a very short shaft."""
    r, length = draw.about(0.0165, 0.12), draw.about(0.052, 0.2)
    grip = _lobed([(-length, 0.5 * r), (-0.93 * length, 0.85 * r), (-0.6 * length, r),
                   (-0.3 * length, 0.9 * r), (-0.15 * length, 0.65 * r), (0.0, 0.72 * r)],
                  draw.pick(6, 3, 4), draw.between(0.02, 0.09))
    return resized(grip + _shaft(draw, -0.005, draw.about(0.032, 0.25), 0.0032), draw)


def long_screwdriver(draw: Draw) -> Manifold:
    """Return a long, thin screwdriver with a slim handle."""
    r, length = draw.about(0.0095, 0.2), draw.about(0.085)
    grip = _lobed([(-length, 0.7 * r), (-0.97 * length, 0.95 * r), (-0.5 * length, 0.95 * r),
                   (-0.15 * length, 0.9 * r), (-0.1 * length, 0.65 * r), (-0.03 * length, 0.85
                   * r), (0.0, 0.45 * r)], draw.pick(6, 4), 0.06)
    return resized(grip + _shaft(draw, -0.005, draw.about(0.165, 0.2), 0.0020), draw)


def t_handle_screwdriver(draw: Draw) -> Manifold:
    """Return a screwdriver or hexagon key with a cross handle."""
    r, half = draw.about(0.0095, 0.2), draw.about(0.046, 0.2)
    grip = bar([(-half, 0.7 * r, 0.7 * r), (-half + 0.006, r, r), (0.0, 1.25 * r, 1.0 * r),
                (half - 0.006, r, r), (half, 0.7 * r, 0.7 * r)], 8).rotate((0.0, 0.0, 90.0))
    boss = cylinder(1.05 * r, 2.2 * r, axis='x', top=0.6 * r, segments=16)
    shaft = _shaft(draw, 0.0, draw.about(0.135, 0.25), 0.003, False, draw.pick(12, 6))
    return resized(union(grip, boss, shaft).translate((-0.05, 0.0, 0.0)), draw)


def thick_screwdriver(draw: Draw) -> Manifold:
    """Return a screwdriver with a thick, three-sided soft grip and a guard at its front."""
    r, length = draw.about(0.0185, 0.15), draw.about(0.110)
    grip = _lobed(smooth([(-length, 0.55 * r), (-0.96 * length, 0.85 * r), (-0.6 * length, r),
                          (-0.3 * length, 0.72 * r), (-0.12 * length, 0.95 * r), (0.0, 0.6 * r)],
                         9), 3, draw.between(0.04, 0.11))
    return resized(grip + _shaft(draw, -0.005, draw.about(0.120, 0.25), 0.0038), draw)


def wooden_screwdriver(draw: Draw) -> Manifold:
    """Return an old cabinet maker's screwdriver: a bulbous wooden handle and a broad tip."""
    r, length = draw.about(0.017), draw.about(0.105)
    grip = _turned(smooth([(-length, 0.55 * r), (-0.9 * length, 0.95 * r), (-0.7 * length, r),
                           (-0.2 * length, 0.6 * r), (0.0, 0.5 * r)], 9))
    grip = grip.scale((1.0, 1.0, draw.between(0.65, 1.0)))
    collar = cylinder(0.52 * r, 0.02, at=(-0.002, 0.0, 0.0), axis='x', top=0.3 * r, segments=16)
    shaft = _shaft(draw, 0.0, draw.about(0.125, 0.2), 0.0036, True)
    return resized(union(grip, collar, shaft), draw)


def bit_holder(draw: Draw) -> Manifold:
    """Return a ratchet screwdriver: a ring, a thick sleeve for bits and a short bit."""
    r, length = draw.about(0.0165), draw.about(0.100)
    grip = _lobed([(-length, 0.75 * r), (-0.95 * length, r), (-0.55 * length, r),
                   (-0.25 * length, 0.8 * r), (0.0, 0.95 * r)], 4, draw.between(0.03, 0.08))
    ring = cylinder(0.9 * r, 0.014, at=(-0.001, 0.0, 0.0), axis='x', segments=20)
    sleeve = cylinder(0.0058, draw.about(0.055, 0.3), at=(0.01, 0.0, 0.0), axis='x', segments=16)
    front = sleeve.bounding_box()[3] - 0.001
    return resized(union(grip, ring, sleeve, _shaft(draw, front, 0.014, 0.003, False, 6)), draw)


def precision_screwdriver(draw: Draw) -> Manifold:
    """Return a watchmaker's screwdriver: a thin knurled barrel with a turning cap."""
    r, length = draw.about(0.0052, 0.2), draw.about(0.075, 0.2)
    cap = draw.about(1.3, 0.15)
    grip = _turned([(-length, 0.8 * cap * r), (-0.985 * length, cap * r), (-0.92 * length, cap
                    * r), (-0.91 * length, 0.5 * r), (-0.87 * length, 0.5 * r), (-0.85 * length,
                    r), (-0.1 * length, r), (0.0, 0.5 * r)], 14)
    return resized(grip + _shaft(draw, -0.004, draw.about(0.045, 0.25), 0.0014, sides=8), draw)


def voltage_tester(draw: Draw) -> Manifold:
    """Return a screwdriver with a six-sided see-through handle and a clip."""
    r, length = draw.about(0.0085, 0.2), draw.about(0.078)
    grip = _turned([(-length, 0.8 * r), (-0.95 * length, r), (-0.3 * length, r), (-0.2 * length,
                    0.75 * r), (-0.1 * length, 0.75 * r), (0.0, 0.5 * r)], 6)
    shaft = _shaft(draw, -0.004, draw.about(0.070, 0.2), 0.0021, True)
    clip = box(0.45 * length, 0.4 * r, 0.0012, at=(-0.68 * length, 0.0, 1.25 * r))
    foot = box(0.006, 0.4 * r, 0.8 * r, at=(-0.88 * length, 0.0, 0.5 * r))
    return resized(union(grip, shaft, clip, foot), draw)


def heavy_screwdriver(draw: Draw) -> Manifold:
    """Return a heavy screwdriver to be struck: a steel cap, a hexagon and a square shank."""
    r, length = draw.about(0.0175), draw.about(0.115)
    grip = _lobed([(-0.95 * length, 0.9 * r), (-0.9 * length, r), (-0.35 * length, 0.9 * r),
                   (-0.25 * length, 0.7 * r), (-0.08 * length, 1.05 * r), (0.0, 0.8 * r)],
                  draw.pick(4, 6), 0.05)
    cap = cylinder(0.6 * r, 0.1 * length, at=(-length, 0.0, 0.0), axis='x', segments=16)
    hexagon = cylinder(0.55 * r, 0.012, at=(-0.002, 0.0, 0.0), axis='x', segments=6)
    shaft = _shaft(draw, 0.0, draw.about(0.175, 0.2), 0.0052, True, draw.pick(4, 12))
    return resized(union(grip, cap, hexagon, shaft), draw)


def round_handle_screwdriver(draw: Draw) -> Manifold:
    """Return a screwdriver with a smooth handle, round or eight-sided, of even thickness."""
    r, length = draw.about(0.0125, 0.15), draw.about(0.090)
    grip = _turned([(-length, 0.75 * r), (-0.95 * length, r), (-0.08 * length, r), (0.0, 0.7
                    * r)], draw.pick(20, 8))
    return resized(grip + _shaft(draw, -0.005, draw.about(0.095, 0.3), 0.0030), draw)


SCREWDRIVERS = (stubby_screwdriver, thick_screwdriver, long_screwdriver, wooden_screwdriver,
                t_handle_screwdriver, bit_holder, precision_screwdriver, voltage_tester,
                heavy_screwdriver, round_handle_screwdriver)
