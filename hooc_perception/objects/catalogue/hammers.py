# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of hammers beside the claw hammer; they lie on a side, the face towards -y."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import bar, brick, resized
from hooc_perception.objects.catalogue.shapes import (
    box,
    curve,
    cylinder,
    outline,
    rounded_rectangle,
    sweep,
    union,
)
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt

# Where the middle of the head is along the handle.
HEAD = 0.092


def _wooden(draw: Draw, end: float, girth: float) -> Manifold:
    """Return an oval wooden handle that swells towards its end."""
    end, girth = draw.about(end), draw.about(girth, 0.2)
    swell, flat = draw.between(1.05, 1.4), draw.about(0.75, 0.1)
    return bar([(-end, 0.7 * swell * girth, 0.6 * flat * girth),
                (-end + 0.008, swell * girth, swell * flat * girth),
                (-0.6 * end, 1.1 * girth, 1.1 * flat * girth), (-0.1 * end, 0.85 * girth,
                0.85 * flat * girth), (HEAD + 0.012, 0.95 * girth, 0.85 * flat * girth)], 10)


def _gripped(draw: Draw, end: float, stem: float, grip: float) -> Manifold:
    """Return a thin stem of steel or fibre with a thick rubber grip."""
    end, stem, grip = draw.about(end), draw.about(stem, 0.2), draw.about(grip, 0.2)
    shaft = brick([(-0.6 * end, stem, 0.7 * stem), (HEAD + 0.01, stem, 0.75 * stem)], 2)
    soft = bar([(-end, 0.8 * grip, 0.6 * grip), (-end + 0.006, 1.15 * grip, 0.9 * grip),
                (-0.7 * end, 0.95 * grip, 0.75 * grip), (-0.35 * end, 1.05 * grip, 0.8 * grip),
                (-0.3 * end, 0.75 * grip, 0.6 * grip)], 8)
    return shaft + soft


def _spindle(rows: npt.ArrayLike, segments: int = 24) -> Manifold:
    """Return a turned head along y; rows of (y, radius), y rising."""
    rows = np.asarray(rows, float)
    profile = np.vstack([(0.0, rows[0, 0]), rows[:, ::-1], (0.0, rows[-1, 0])])
    solid = outline(profile).revolve(segments)
    return solid.rotate((-90.0, 0.0, 0.0)).translate((HEAD, 0.0, 0.0))


def _claw(reach: float, drop: float, wide: float, thick: float) -> Manifold:
    """Return a slotted claw that bends towards the handle's end by `drop`."""
    line = curve([(HEAD, 0.008), (HEAD + 0.002, 0.4 * reach), (HEAD - 0.35 * drop, 0.75 * reach),
                  (HEAD - drop, reach)], 9)
    claw = sweep(np.column_stack([line, np.zeros(9)]), np.linspace(thick, 0.2 * thick, 9),
                 np.linspace(0.9 * wide, wide, 9), sides=10)
    slot = outline([(HEAD + 0.05, 0.5 * reach), (HEAD + 0.05, 1.4 * reach),
                    (HEAD - drop - 0.05, 1.4 * reach), (HEAD - drop - 0.05, 0.65 * reach)])
    wedge = slot.extrude(0.45 * wide).translate((0.0, 0.0, -0.225 * wide))
    return claw - wedge


def ball_peen(draw: Draw) -> Manifold:
    """Return a mechanic's hammer: a round face and a ball on an oval wooden handle."""
    r, reach = draw.about(0.015, 0.2), draw.about(0.048)
    angle = np.linspace(-0.35 * np.pi, 0.49 * np.pi, 8)
    ball = np.column_stack([reach - 0.9 * r + 0.9 * r * np.sin(angle), 0.9 * r * np.cos(angle)])
    head = _spindle(np.vstack([[(-reach, 0.92 * r), (-reach + 0.003, r), (-0.65 * reach, r),
                                (-0.5 * reach, 0.7 * r), (-0.012, 0.95 * r), (0.012, 0.95 * r),
                                (0.35 * reach, 0.6 * r)], ball[1:]]))
    return resized(head + _wooden(draw, 0.215, 0.0125), draw)


def sledge(draw: Draw) -> Manifold:
    """Return a club hammer: a heavy block on a thick handle."""
    a, reach = draw.about(0.021, 0.2), draw.about(0.050, 0.2)
    block = rounded_rectangle(2 * a, 2 * a, 0.35 * a, draw.pick(4, 4, 16)).extrude(
        1.7 * reach, 0).rotate((-90.0, 0.0, 0.0)).translate((HEAD, -0.85 * reach, 0.0))
    inner = rounded_rectangle(1.7 * a, 1.7 * a, 0.3 * a, 4).extrude(2 * reach).rotate(
        (-90.0, 0.0, 0.0)).translate((HEAD, -reach, 0.0))
    return resized(union(block, inner, _wooden(draw, 0.165, 0.0155)), draw)


def rubber_mallet(draw: Draw) -> Manifold:
    """Return a rubber mallet: a thick cylinder or barrel on a round handle."""
    r, reach = draw.about(0.030, 0.2), draw.about(0.050, 0.2)
    waist = draw.between(0.85, 1.12)
    head = _spindle([(-reach, 0.88 * r), (-0.88 * reach, r), (-0.2 * reach, waist * r),
                     (0.2 * reach, waist * r), (0.88 * reach, r), (reach, 0.88 * r)], 28)
    return resized(head + _wooden(draw, 0.215, 0.0135), draw)


def wooden_mallet(draw: Draw) -> Manifold:
    """Return a carpenter's mallet: a big wooden block with slanted ends."""
    reach, thick = draw.about(0.065), draw.about(0.032, 0.2)
    low, high, slant = 0.055, draw.about(0.050), draw.between(0.0, 0.014)
    shape = outline([(HEAD - low, -reach + slant), (HEAD - low, reach - slant),
                     (HEAD + high, reach), (HEAD + high, -reach)])
    head = shape.extrude(2 * thick).translate((0.0, 0.0, -thick))
    grip = draw.about(0.014, 0.2)
    handle = brick([(-0.185, grip, 0.75 * grip), (0.0, 0.9 * grip, 0.7 * grip),
                    (HEAD + high + 0.006, 1.2 * grip, 0.8 * grip)], 3)
    return resized(head + handle, draw)


def cross_peen(draw: Draw) -> Manifold:
    """Return a locksmith's hammer: a square face and a wedge on a wooden handle."""
    a, reach = draw.about(0.012, 0.25), draw.about(0.052)
    profile = [(-a, -reach), (a, -reach), (a, 0.2 * reach), (0.25 * a, reach), (-0.1 * a, reach),
               (-a, 0.25 * reach)]
    head = outline(np.add(profile, (HEAD, 0.0))).extrude(2 * a).translate((0.0, 0.0, -a))
    return resized(head + _wooden(draw, 0.20, 0.0115), draw)


def framing_hammer(draw: Draw) -> Manifold:
    """Return a long hammer of steel: a straight claw and a rubber grip."""
    r, reach = draw.about(0.0145, 0.2), draw.about(0.060)
    head = union(_spindle([(-0.062, r), (-0.045, r), (-0.038, 0.75 * r), (0.0, 0.75 * r)], 20),
                 box(0.026, 0.036, 0.022, at=(HEAD, 0.0, -0.011)),
                 _claw(1.35 * reach, draw.between(0.006, 0.02), 0.0135, 0.010))
    return resized(head + _gripped(draw, 0.235, 0.009, 0.0165), draw)


def tack_hammer(draw: Draw) -> Manifold:
    """Return a light hammer: a slim head, square or round, on a thin stick."""
    r, reach = draw.about(0.0075, 0.25), draw.about(0.044, 0.2)
    head = _spindle([(-reach, r), (-0.7 * reach, r), (-0.5 * reach, 0.65 * r), (-0.01, 1.1 * r),
                     (0.01, 1.1 * r), (0.85 * reach, 0.4 * r), (reach, 0.35 * r)],
                    draw.pick(16, 4, 8))
    thin = draw.about(0.0068, 0.2)
    handle = bar([(-0.165, 0.9 * thin, 0.9 * thin), (-0.158, 1.3 * thin, 1.2 * thin),
                  (-0.08, thin, 0.95 * thin), (HEAD + 0.009, 0.8 * thin, 0.75 * thin)], 7)
    return resized(head + handle, draw)


def soft_faced_hammer(draw: Draw) -> Manifold:
    """Return a hammer with two plastic caps screwed to a narrower body."""
    r, reach = draw.about(0.018, 0.2), draw.about(0.052)
    waist = draw.between(0.6, 0.8)
    head = _spindle([(-reach, 0.9 * r), (-0.95 * reach, r), (-0.5 * reach, r),
                     (-0.49 * reach, waist * r), (-0.2 * reach, waist * r), (-0.18 * reach, 0.9
                     * r), (0.18 * reach, 0.9 * r), (0.2 * reach, waist * r),
                     (0.49 * reach, waist * r), (0.5 * reach, r), (0.95 * reach, r),
                     (reach, 0.9 * r)])
    return resized(head + _gripped(draw, 0.19, 0.009, 0.0155), draw)


def stubby_hammer(draw: Draw) -> Manifold:
    """Return a short claw hammer with a fat grip and a curved claw."""
    r, reach = draw.about(0.0145), draw.about(0.055)
    head = union(_spindle([(-0.055, r), (-0.036, r), (-0.030, 0.8 * r), (0.0, 0.8 * r)], 20),
                 cylinder(0.017, 0.028, at=(HEAD, 0.0, -0.014), segments=20),
                 _claw(reach, draw.between(0.018, 0.034), 0.014, 0.011))
    fat = draw.about(0.0175, 0.2)
    handle = bar([(-0.085, 0.8 * fat, 0.6 * fat), (-0.078, 1.1 * fat, 0.85 * fat),
                  (-0.02, 0.9 * fat, 0.75 * fat), (0.02, fat, 0.8 * fat), (0.035, 0.65 * fat,
                  0.55 * fat), (HEAD + 0.01, 0.6 * fat, 0.55 * fat)], 9)
    return resized(head + handle, draw)


def meat_hammer(draw: Draw) -> Manifold:
    """Return a meat tenderiser: a square block with toothed faces on a slim handle."""
    a, reach = draw.about(0.024, 0.2), draw.about(0.032, 0.2)
    head = box(2 * a, 2 * reach, 2 * a, at=(HEAD, 0.0, -a))
    for i in range(4):
        x = HEAD + a * (-0.75 + 0.5 * i)
        notch = outline([(x - 0.1 * a, -1.1 * reach), (x, -0.85 * reach),
                         (x + 0.1 * a, -1.1 * reach)])
        head -= notch.extrude(0.2).translate((0.0, 0.0, -0.1))
    grip = draw.about(0.011, 0.2)
    handle = bar([(-0.15, 0.7 * grip, 0.7 * grip), (-0.142, 1.1 * grip, 1.1 * grip),
                  (-0.07, 1.2 * grip, 1.2 * grip), (0.02, 0.7 * grip, 0.7 * grip),
                  (HEAD, 0.75 * grip, 0.75 * grip)], 8, 14)
    return resized(head + handle, draw)


HAMMERS = (ball_peen, sledge, rubber_mallet, framing_hammer, wooden_mallet, tack_hammer,
           soft_faced_hammer, cross_peen, stubby_hammer, meat_hammer)
