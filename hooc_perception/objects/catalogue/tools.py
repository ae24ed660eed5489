# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Hammer, screwdriver, drill and scissors."""

from collections.abc import Callable

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.drills import DRILLS
from hooc_perception.objects.catalogue.hafts import resized
from hooc_perception.objects.catalogue.hammers import HAMMERS
from hooc_perception.objects.catalogue.screwdrivers import SCREWDRIVERS
from hooc_perception.objects.catalogue.shapes import (
    box,
    curve,
    cylinder,
    ellipse,
    outline,
    rounded_box,
    sweep,
    union,
)
from hooc_perception.objects.catalogue.shears import SHEARS
from manifold3d import Manifold
import numpy as np


def hammer(draw: Draw) -> Manifold:
    """Return a claw hammer that lies on its side."""
    path = np.column_stack([np.linspace(-0.190, 0.105, 14), np.zeros((14, 2))])
    width = np.interp(path[:, 0], [-0.19, -0.18, -0.10, -0.05, 0.06, 0.105],
                      [0.010, 0.0165, 0.017, 0.0125, 0.0115, 0.0115])
    handle = sweep(path, width * draw.about(1.0, 0.2), width * (0.72 * draw.about(1.0, 0.2)),
                   sides=12)
    neck = cylinder(0.010, 0.045, at=(0.092, -0.060, 0.0), axis='y', segments=24)
    face = cylinder(0.0145, 0.022, at=(0.092, -0.072, 0.0), axis='y', segments=24)
    eye = box(0.030, 0.034, 0.028, at=(0.092, 0.0, -0.014))
    line = curve([(0.094, 0.010), (0.095, 0.030), (0.086, 0.052), (0.066, 0.068)], 9)
    claw = sweep(np.column_stack([line, np.zeros(9)]), np.linspace(0.011, 0.0025, 9),
                 np.linspace(0.013, 0.0145, 9), sides=12)
    slot = outline([(0.110, 0.034), (0.082, 0.090), (0.050, 0.090), (0.066, 0.034)])
    wedge = slot.extrude(0.006).translate((0.0, 0.0, -0.003))
    return resized(union(handle, neck, face, eye, claw - wedge), draw)


def screwdriver(draw: Draw) -> Manifold:
    """Return a screwdriver with a fluted handle and a flat tip, lying down."""
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    radius = 0.0145 + 0.0013 * np.cos(6 * angle)
    flutes = outline(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))
    thick, long = draw.about(1.0, 0.12), draw.about(1.0, 0.25)
    grip = flutes.extrude(0.070).rotate((0.0, 90.0, 0.0)).translate((-0.095, 0.0, 0.0))
    end = cylinder(0.009, 0.008, at=(-0.103, 0.0, 0.0), axis='x', top=0.014, segments=24)
    collar = cylinder(0.0135, 0.016, at=(-0.025, 0.0, 0.0), axis='x', top=0.008, segments=24)
    shaft = cylinder(0.0032, 0.115 * long, at=(-0.012, 0.0, 0.0), axis='x', segments=16)
    tip = (box(0.001, 0.005, 0.0064, at=(0.100, 0.0, -0.0032))
           + box(0.001, 0.0085, 0.0012, at=(0.120, 0.0, -0.0006))).hull()
    handle = [part.scale((1.0, thick, thick)) for part in (grip, end, collar)]
    tip = tip.translate((0.115 * (long - 1.0), 0.0, 0.0))
    return resized(union(*handle, shaft, tip), draw)


def drill(draw: Draw) -> Manifold:
    """Return a cordless drill that stands on its battery."""
    body = cylinder(0.029, 0.110, at=(-0.075, 0.0, 0.160), axis='x', segments=28)
    back = cylinder(0.022, 0.011, at=(-0.085, 0.0, 0.160), axis='x', top=0.029, segments=28)
    chuck = (cylinder(0.024, 0.016, at=(0.035, 0.0, 0.160), axis='x', segments=28)
             + cylinder(0.021, 0.034, at=(0.051, 0.0, 0.160), axis='x', top=0.011, segments=28))
    bit = cylinder(0.0035, 0.045, at=(0.080, 0.0, 0.160), axis='x', segments=12)
    grip = sweep(curve([(-0.040, 0.0, 0.030), (-0.036, 0.0, 0.090), (-0.022, 0.0, 0.150)], 8),
                 0.017, [0.024, 0.022, 0.020, 0.020, 0.021, 0.023, 0.026, 0.028], 14,
                 up=(1.0, 0.0, 0.0))
    trigger = box(0.026, 0.013, 0.030, at=(-0.008, 0.0, 0.105))
    battery = (rounded_box(0.110, 0.066, 0.034, 0.010, at=(-0.022, 0.0, 0.0))
               + rounded_box(0.080, 0.050, 0.012, 0.010, at=(-0.030, 0.0, 0.034)))
    parts = [body, back, chuck, bit, grip, trigger, battery]
    return resized(union(*(parts if draw.chance(0.6) else parts[:3] + parts[4:])), draw)


def scissors(draw: Draw) -> Manifold:
    """Return a pair of scissors, a little open, lying flat."""
    angle = draw.between(3.0, 15.0)

    def half(side: float) -> Manifold:
        ring = ellipse(0.027, 0.0185, segments=28) - ellipse(0.019, 0.0115, segments=28)
        ring = ring.rotate(-12.0).translate((-0.072, -0.020))
        arm = outline([(-0.056, -0.017), (-0.046, -0.003), (0.004, 0.008), (0.008, -0.005),
                       (-0.030, -0.012), (-0.050, -0.026)])
        blade = outline([(-0.012, -0.006), (-0.012, 0.007), (0.030, 0.0085), (0.100, 0.001),
                         (0.030, -0.0055)])
        shape = (ring + (arm ^ outline([(-0.1, -0.1), (-0.012, -0.1), (-0.012, 0.1),
                                        (-0.1, 0.1)]))).extrude(0.009)
        both = shape.translate((0.0, 0.0, -0.0045)) + blade.extrude(0.0024)
        if side < 0:
            both = both.mirror((0.0, 1.0, 0.0)).mirror((0.0, 0.0, 1.0))
        return both.rotate((0.0, 0.0, angle * side))

    screw = cylinder(0.005, 0.007, at=(0.0, 0.0, -0.0035), segments=20)
    return resized(union(half(1), half(-1), screw), draw)


STYLES: dict[str, tuple[Callable[[Draw], Manifold], ...]] = {
    'hammer': (hammer, *HAMMERS), 'screwdriver': (screwdriver, *SCREWDRIVERS),
    'drill': (drill, *DRILLS), 'scissors': (scissors, *SHEARS)}
