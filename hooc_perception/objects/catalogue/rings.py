# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Cores of adhesive tape: bare rings, full and part-used rolls, spools and reels."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import box, cylinder, lathe
from manifold3d import Manifold
import numpy as np

FINE = 40


def sellotape_core(draw: Draw) -> Manifold:
    """Return the broad ring on which adhesive tape is wound."""
    r, width, wall = draw.about(1.0), draw.about(1.0, 0.25), draw.about(1.0, 0.3)
    inner = 0.046 * r - (0.046 - 0.0385) * wall if wall != 1.0 else 0.0385 * r
    outer = cylinder(0.046 * r, 0.024 * width, segments=48)
    return outer - cylinder(inner, 0.03 * width, at=(0.0, 0.0, -0.003 * width), segments=48)


def _ring(inner: float, outer: float, width: float, z: float = 0.0) -> Manifold:
    """Return a ring about z between two radii, its lower side at z."""
    return lathe([(inner, z), (outer, z), (outer, z + width), (inner, z + width)], FINE)


def full_roll(draw: Draw) -> Manifold:
    """Return a roll of tape: a thick winding on a core that stands out a little."""
    inner, width = draw.about(0.038, 0.1), draw.about(0.024, 0.2)
    proud = draw.between(0.0, 0.0015)
    core = _ring(inner, inner + 0.003, width + 2 * proud, -proud)
    return core + _ring(inner + 0.002, inner + draw.about(0.014, 0.35), width)


def packing_roll(draw: Draw) -> Manifold:
    """Return a broad roll of packing tape, or its bare core."""
    inner = draw.about(0.037, 0.1)
    return _ring(inner, inner + draw.between(0.003, 0.024), draw.about(0.049, 0.12))


def desk_roll(draw: Draw) -> Manifold:
    """Return a small roll for a desk dispenser."""
    inner, width = draw.about(0.0135, 0.15), draw.about(0.017, 0.18)
    core = _ring(inner, inner + 0.0025, width + 0.001, -0.0005)
    return core + _ring(inner + 0.002, inner + draw.between(0.006, 0.018), width)


def thin_core(draw: Draw) -> Manifold:
    """Return a bare cardboard core with a thin wall, narrow or broad."""
    r = draw.about(0.040, 0.2)
    return _ring(r - draw.about(0.0025, 0.2), r, draw.between(0.012, 0.055))


def spool(draw: Draw) -> Manifold:
    """Return a spool: a core between two flanges, with or without tape on it."""
    inner, width, flange = draw.about(0.026, 0.25), draw.about(0.022, 0.25), 0.0022
    rim = inner + draw.about(0.016, 0.25)
    level = inner + 0.003 + draw.between(0.0, 0.8) * (rim - inner - 0.003)
    solid = _ring(inner, max(level, inner + 0.003), width)
    for z in (0.0, width - flange):
        solid += _ring(inner, rim, flange, z)
    return solid


def telescoped_roll(draw: Draw) -> Manifold:
    """Return a roll whose windings have slipped: one side sticks out like a cone."""
    inner, width = draw.about(0.034, 0.15), draw.about(0.022, 0.25)
    outer, slip = inner + draw.about(0.013, 0.3), draw.between(0.003, 0.010)
    return lathe([(inner, slip), (outer, 0.0), (outer, width), (inner, width + slip)], FINE)


def reel(draw: Draw) -> Manifold:
    """Return a plastic reel: a rim on a web with holes and a hub."""
    outer, width = draw.about(0.044, 0.18), draw.about(0.022, 0.25)
    wall, hub = draw.about(0.006, 0.3), draw.between(0.2, 0.34) * outer
    rim = outer - wall
    solid = _ring(rim, outer, width) + _ring(0.55 * hub, hub, draw.between(0.5, 1.0) * width)
    count = draw.pick(3, 4, 6)
    if draw.chance(0.5):
        web = _ring(0.55 * hub, rim + 0.001, 0.003, draw.between(0.1, 0.45) * width)
        hole = cylinder(0.28 * (rim - hub), 1.0, at=(0.5 * (rim + hub), 0.0, -0.5), segments=16)
        for i in range(count):
            web -= hole.rotate((0.0, 0.0, 360.0 * i / count))
        return solid + web
    for i in range(count):
        spoke = box(rim - 0.8 * hub + 0.002, 0.004, 0.45 * width,
                    at=(0.5 * (rim + 0.8 * hub) + 0.001, 0.0, 0.0))
        solid += spoke.rotate((0.0, 0.0, 360.0 * i / count))
    return solid


def loose_roll(draw: Draw) -> Manifold:
    """Return a roll with a loose end of tape that stands away from it."""
    inner, width = draw.about(0.036, 0.12), draw.about(0.026, 0.3)
    outer = inner + draw.between(0.004, 0.016)
    tail, thick = draw.about(0.024, 0.35), 0.0015
    solid = _ring(inner, outer, width)
    end = box(tail + 0.006, thick, width, at=(0.5 * tail - 0.003, outer - 0.6 * thick, 0.0))
    pivot = (0.0, -outer, 0.0)
    lift = end.translate(pivot).rotate((0.0, 0.0, draw.between(-4.0, 12.0)))
    return solid + lift.translate((0.0, outer, 0.0))


def closed_roll(draw: Draw) -> Manifold:
    """Return a roll whose hole is closed by a film or by a coarse scan: a disc with hollows."""
    inner, width = draw.about(0.034, 0.2), draw.about(0.024, 0.3)
    solid = _ring(inner, inner + draw.about(0.012, 0.3), width)
    film = width * draw.between(0.1, 0.95)
    return solid + cylinder(inner + 0.001, film, at=(0.0, 0.0, 0.5 * (width - film)), segments=32)


def squeezed_core(draw: Draw) -> Manifold:
    """Return a cardboard core that has been pressed out of round."""
    r, squeeze = draw.about(0.042), draw.between(1.06, 1.3)
    ring = _ring(r - draw.about(0.004, 0.3), r, draw.about(0.026, 0.3))
    return ring.scale((squeeze, 1.0 / squeeze, 1.0))


def stepped_core(draw: Draw) -> Manifold:
    """Return a core much wider than the tape that is left on it, or two rolls side by side."""
    inner, width = draw.about(0.037, 0.12), draw.about(0.030, 0.2)
    solid = _ring(inner, inner + 0.004, width)
    tape, thick = draw.between(0.25, 0.42) * width, draw.about(0.010, 0.35)
    solid += _ring(inner + 0.003, inner + 0.004 + thick, tape, draw.between(0.02, 0.2) * width)
    if draw.chance(0.5):
        solid += _ring(inner + 0.003, inner + 0.004 + thick, tape * 0.8, 0.64 * width)
    return solid


def bevelled_ring(draw: Draw) -> Manifold:
    """Return a moulded ring of round or bevelled section, like a bangle or a coupling."""
    r, half, wall = draw.about(0.040, 0.18), draw.about(0.010, 0.3), draw.about(0.007, 0.25)
    angle = 2 * np.pi * (np.arange(10) + 0.5) / 10
    power = 2 / draw.between(2.0, 5.0)
    x = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** power
    z = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** power
    return lathe(np.column_stack([r + 0.5 * wall * x, half * z]), FINE)


STYLES = {'sellotape_core': (sellotape_core, full_roll, packing_roll, thin_core, desk_roll, spool,
                             loose_roll, telescoped_roll, reel, closed_roll, squeezed_core,
                             stepped_core, bevelled_ring)}
