# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of scissors beside the common pair; they lie flat, blades towards x."""

from dataclasses import dataclass

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import resized
from hooc_perception.objects.catalogue.shapes import cylinder, ellipse, outline, sweep, union
from manifold3d import CrossSection, Manifold
import numpy as np


@dataclass(frozen=True)
class _Half:
    """
    One half of a pair of scissors, its pivot at the origin.

    :ivar blade: length of the blade from the pivot; `wide` its greatest half width.
    :ivar tip: half width of the tip.
    :ivar steel: thickness of the blade.
    :ivar bow: half axes of the finger ring; `at` its middle, `turn` its direction in degrees.
    :ivar band: width of the ring's band; at least the half axes = no hole.
    :ivar body: thickness of ring and arm.
    :ivar neck: half width of the arm at the pivot.
    """

    blade: float
    wide: float
    tip: float
    steel: float
    bow: tuple[float, float]
    at: tuple[float, float]
    turn: float
    band: float
    body: float
    neck: float

    def solid(self, angle_deg: float, side: int) -> Manifold:
        """Return the half, opened by an angle; `side` = 1 or, mirrored, -1."""
        blade = outline([(-0.012, -0.8 * self.wide), (-0.012, 0.8 * self.wide),
                         (0.3 * self.blade, self.wide), (self.blade, self.tip),
                         (self.blade + 0.6 * self.tip, -0.2 * self.tip),
                         (0.95 * self.blade, -self.tip), (0.3 * self.blade, -0.8 * self.wide)])
        rx, ry = self.bow
        ring = ellipse(rx, ry, segments=26)
        if self.band < 0.9 * min(rx, ry):
            ring -= ellipse(rx - self.band, ry - self.band, segments=26)
        ring = ring.rotate(self.turn).translate(self.at)
        low = self._arm()
        grip = (ring + low).extrude(self.body).translate((0.0, 0.0, -self.body / 2))
        both = grip + blade.extrude(self.steel)
        if side < 0:
            both = both.mirror((0.0, 1.0, 0.0)).mirror((0.0, 0.0, 1.0))
        return both.rotate((0.0, 0.0, side * angle_deg))

    def _arm(self) -> CrossSection:
        """Return the arm from behind the pivot to the near end of the ring."""
        turn = np.radians(self.turn)
        near = np.array(self.at) + (self.bow[0] - 0.5 * self.band) * np.array(
            [np.cos(turn), np.sin(turn)])
        start = np.array([-0.4 * abs(near[0]) - 0.002, 0.25 * near[1]])
        rows = [np.array([0.0, 0.0]), start, near]
        girth = [self.neck, 0.9 * self.neck, 0.75 * self.neck]
        shape = CrossSection()
        for a, b, wa, wb in zip(rows[:-1], rows[1:], girth[:-1], girth[1:], strict=True):
            ends = [CrossSection.circle(w, 12).translate(tuple(p)) for p, w in ((a, wa), (b, wb))]
            shape += CrossSection.batch_hull(ends)
        return shape


def _pair(draw: Draw, upper: _Half, lower: _Half, open_deg: float) -> Manifold:
    """Return two halves on a screw, opened by 2 x `open_deg`."""
    thick = max(upper.steel, lower.steel)
    high = max(thick + 0.001, 0.5 * upper.body)
    screw = cylinder(0.6 * upper.wide, 2 * high, at=(0.0, 0.0, -high), segments=14)
    return resized(union(upper.solid(open_deg, 1), lower.solid(open_deg, -1), screw), draw)


def _half(draw: Draw, blade: float, wide: float, bow: tuple[float, float],
          at: tuple[float, float], turn: float = -12.0, band: float = 0.007,
          body: float = 0.009, tip: float = 0.001, steel: float = 0.0024,
          neck: float = 0.006) -> _Half:
    """Return a half of random proportions; see _Half."""
    blade, wide, tip = draw.about(blade), draw.about(wide), draw.about(tip, 0.3)
    steel, body = draw.about(steel, 0.25), draw.about(body, 0.25)
    a, b = draw.about(bow[0]), draw.about(bow[1])
    # The rings stay apart: the middle moves with the half axis.
    y = -max(abs(at[1]) * b / bow[1], b * 0.9)
    return _Half(blade, wide, tip, steel, (a, b), (at[0] * draw.about(1.0, 0.1) - (a - bow[0]),
                 y), turn, draw.about(band, 0.2), body, neck)


def kitchen_shears(draw: Draw) -> Manifold:
    """Return kitchen shears: broad blades and two large, thick rings, almost closed."""
    half = _half(draw, 0.095, 0.013, (0.038, 0.021), (-0.075, -0.022), -10.0, 0.009, 0.013,
                 0.003, 0.003, 0.011)
    return _pair(draw, half, half, draw.between(1.0, 8.0))


def nail_scissors(draw: Draw) -> Manifold:
    """Return small scissors of steel: thin round rings, short narrow blades."""
    half = _half(draw, 0.032, 0.0038, (0.0135, 0.0125), (-0.052, -0.0145), -15.0, 0.0028, 0.0034,
                 0.0006, 0.0016, 0.0027)
    return _pair(draw, half, half, draw.between(2.0, 12.0))


def tailor_shears(draw: Draw) -> Manifold:
    """Return tailor's shears: long blades, one round ring for the thumb and one long ring."""
    lower = _half(draw, 0.135, 0.013, (0.042, 0.020), (-0.085, -0.022), -8.0, 0.009, 0.013,
                  0.0015, 0.0032, 0.010)
    upper = _half(draw, 0.135, 0.013, (0.023, 0.018), (-0.068, -0.021), -14.0, 0.008, 0.013,
                  0.0015, 0.0032, 0.010)
    return _pair(draw, upper, lower, draw.between(2.0, 10.0))


def child_scissors(draw: Draw) -> Manifold:
    """Return a child's scissors: short, blunt blades and thick rings."""
    half = _half(draw, 0.058, 0.008, (0.022, 0.0165), (-0.050, -0.018), -14.0, 0.006, 0.010, 0.005,
                 0.0025, 0.0065)
    return _pair(draw, half, half, draw.between(3.0, 20.0))


def closed_scissors(draw: Draw) -> Manifold:
    """Return closed office scissors; the holes of the rings are open or, as in scans, filled."""
    band = 0.03 if draw.chance(0.4) else 0.0065
    half = _half(draw, 0.100, 0.0085, (0.030, 0.017), (-0.072, -0.0175), -6.0, band, 0.010, 0.001,
                 0.0022, 0.008)
    return _pair(draw, half, half, draw.between(-1.0, 1.5))


def open_scissors(draw: Draw) -> Manifold:
    """Return scissors that lie wide open."""
    half = _half(draw, 0.090, 0.008, (0.027, 0.018), (-0.070, -0.020), -12.0, 0.0065, 0.009, 0.001,
                 0.0024, 0.006)
    return _pair(draw, half, half, draw.between(20.0, 38.0))


def barber_scissors(draw: Draw) -> Manifold:
    """Return a hairdresser's scissors: slim, long arms, thin rings, a rest for the finger."""
    half = _half(draw, 0.070, 0.0045, (0.015, 0.0125), (-0.082, -0.015), -8.0, 0.003, 0.004,
                 0.0006, 0.002, 0.0035)
    angle = draw.between(3.0, 16.0)
    pair = _pair(Draw(), half, half, angle)
    x, y = half.at[0] - 0.9 * half.bow[0], half.at[1]
    line = np.array([(x, y, 0.0), (x - 0.009, y - 0.004, 0.0), (x - 0.018, y - 0.010, 0.0)])
    rest = sweep(line, 0.0019, 0.0019, 8).rotate((0.0, 0.0, angle))
    return resized(pair + rest, draw)


def bandage_scissors(draw: Draw) -> Manifold:
    """Return angled scissors: the rings stand off to one side, a blade ends in a button."""
    upper = _half(draw, 0.055, 0.0065, (0.018, 0.0145), (-0.080, -0.040), -38.0, 0.005, 0.006,
                  0.001, 0.0022, 0.0045)
    lower = _half(draw, 0.055, 0.0065, (0.018, 0.0145), (-0.090, -0.004), 14.0, 0.005, 0.006,
                  0.004, 0.0022, 0.0045)
    angle = draw.between(4.0, 12.0)
    lower = _Half(lower.blade, lower.wide, lower.tip, lower.steel, lower.bow,
                  (-abs(lower.at[0]), 0.012), 10.0, lower.band, lower.body, lower.neck)
    return _pair(draw, upper, lower, angle)


def spring_snips(draw: Draw) -> Manifold:
    """Return thread snips: two short blades on a U-shaped spring, without rings."""
    width, length = draw.about(0.012, 0.2), draw.about(0.060)
    around = np.linspace(-np.pi / 2, np.pi / 2, 9)
    bend = np.column_stack([-length - width * np.cos(around), -width * np.sin(around)])
    line = np.vstack([(0.0, 0.8 * width), (-0.5 * length, 1.25 * width), bend,
                      (-0.5 * length, -1.25 * width), (0.0, -0.8 * width)])
    tall = draw.about(0.0055, 0.25)
    spring = sweep(np.column_stack([line, np.zeros(len(line))]), draw.about(0.0018, 0.25), tall, 8)
    blades = []
    reach = draw.about(0.038)
    for side, low in ((1, 0.0), (-1, -0.0016)):
        shape = outline([(-0.02, side * 0.75 * width), (-0.01, side * 1.15 * width),
                         (0.006, side * width), (reach, -side * 0.001), (0.008, -side * 0.001)])
        blades.append(shape.extrude(0.0017).translate((0.0, 0.0, low)))
    return resized(union(spring, *blades), draw)


SHEARS = (nail_scissors, kitchen_shears, open_scissors, child_scissors, tailor_shears,
          closed_scissors, spring_snips, barber_scissors, bandage_scissors)
