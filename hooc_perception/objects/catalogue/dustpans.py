# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Dustpans: scoops of plastic and of sheet steel, with hoods, loops, sticks and brushes."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import (
    box,
    curve,
    cylinder,
    outline,
    rounded_box,
    rounded_rectangle,
    sweep,
)
from hooc_perception.objects.catalogue.vessel_parts import bow, rod
from manifold3d import Manifold
import numpy as np


def dustpan(draw: Draw) -> Manifold:
    """Return a dustpan: a scoop with a low front edge and a high back, on a handle."""
    long, broad, up = draw.about(1.0), draw.about(1.0), draw.about(1.0, 0.2)

    def scoop(inset: float, lift: float) -> Manifold:
        front = box(0.004, 0.220 * broad - 2 * inset, 0.003 + lift, at=(-0.105, 0.0, lift / 2))
        back = rounded_rectangle(0.080, 0.190 * broad - 2 * inset, 0.030).extrude(
            0.058 * up + lift)
        return (front + back.translate((0.055 - inset, 0.0, lift / 2))).hull()

    inside = scoop(0.004, 0.005) + box(0.02, 0.220 * broad - 0.008, 0.08,
                                       at=(-0.115, 0.0, 0.0025))
    shell = scoop(0.0, 0.0) - inside.translate((0.0, 0.0, 0.001))
    line = curve([(0.085, 0.040), (0.130, 0.050), (0.180, 0.056), (0.225, 0.054)], 12)
    path = np.column_stack([line[:, 0], np.zeros(12), line[:, 1] * up])
    stretch = draw.about(1.0, 0.2)
    path[:, 0] += (stretch - 1.0) * (path[:, 0] - 0.085)
    width = np.interp(np.linspace(0, 1, 12), [0, 0.3, 0.8, 1], [0.016, 0.012, 0.016, 0.010])
    eye = cylinder(0.006, 0.1, at=(0.211 + (stretch - 1.0) * 0.126, 0.0, 0.0), segments=16)
    solid = shell + (sweep(path, width * draw.about(1.0, 0.2), 0.009, sides=12) - inside - eye)
    return solid if long == 1.0 else solid.scale((long, long, long))


def _scoop(length: float, front: float, back: float, height: float, depth: float,
           radius: float, wall: float = 0.004) -> tuple[Manifold, Manifold]:
    """
    Return the shell and the inner volume of a scoop that opens towards -x, centred.

    :param front: its width at the front edge.
    :param back: its width at the back.
    :param depth: length of the part behind that has the full height.
    :param radius: of its corners behind.
    """
    def block(inset: float, lift: float) -> Manifold:
        corner = min(radius, 0.49 * depth, 0.4 * back) - inset
        edge = box(0.004, front - 2 * inset, 0.003 + lift, at=(-length / 2, 0.0, 0.0))
        rear = rounded_rectangle(depth - 2 * inset, back - 2 * inset, max(corner, 0.002))
        rear = rear.extrude(height + lift).translate((0.5 * (length - depth), 0.0, 0.0))
        return (edge + rear).hull()

    inside = block(wall, 0.02).translate((0.0, 0.0, 0.0025))
    inside += box(0.03, front - 2 * wall, height, at=(-length / 2 - 0.012, 0.0, 0.0025))
    return block(0.0, 0.0) - inside, inside


def flat_scoop(draw: Draw) -> Manifold:
    """Return a shallow scoop with parallel sides and a short, flat handle."""
    length, width, height = draw.about(0.210), draw.about(0.230), draw.about(0.036, 0.2)
    shell, inside = _scoop(length, width, width, height, 0.03, 0.012, draw.about(0.004, 0.25))
    x, reach = length / 2, draw.about(0.110, 0.2)
    handle = rod([(x - 0.008, 0.7 * height), (x + 0.5 * reach, 0.8 * height),
                  (x + reach, draw.between(0.7, 1.1) * height)],
                 [0.022, 0.017, 0.020, 0.014], draw.about(0.006, 0.2), 9)
    return shell + (handle - inside)


def steel_pan(draw: Draw) -> Manifold:
    """Return a dustpan of sheet steel: upright sides, half a cover, a tube for a handle."""
    length, width, height = draw.about(0.230), draw.about(0.250), draw.about(0.058, 0.2)
    wall, cover = draw.about(0.003, 0.2), draw.between(0.25, 0.55) * length
    x = length / 2
    front = draw.between(0.004, 0.02)
    side = outline([(-x, 0.0), (x, 0.0), (x, height), (x - cover, height), (-x, front)])
    side = side.extrude(width).rotate((90.0, 0.0, 0.0)).translate((0.0, 0.5 * width, 0.0))
    inside = box(length, width - 2 * wall, height - 2 * wall, at=(-wall, 0.0, wall))
    inside += box(length - cover, width - 2 * wall, 2 * height, at=(-0.5 * cover - wall, 0, wall))
    reach, rise = draw.about(0.150, 0.25), draw.between(0.0, 0.07)
    r = draw.about(0.011, 0.2)
    handle = rod([(x - 0.006, 0.65 * height), (x + 0.4 * reach, 0.7 * height + 0.4 * rise),
                  (x + reach, 0.7 * height + rise)], [0.8 * r, r, r], [0.8 * r, r, r], 9)
    return (side - inside) + (handle - inside)


def hooded_pan(draw: Draw) -> Manifold:
    """Return a scoop whose back half is covered by a hood that leads to a thick handle."""
    length, width, height = draw.about(0.230), draw.about(0.210), draw.about(0.060, 0.2)
    back, cover = width * draw.between(0.55, 0.9), draw.between(0.25, 0.45) * length
    shell, inside = _scoop(length, width, back, height, cover, 0.03)
    x = length / 2
    hood = rounded_box(cover, back, 0.005, min(0.03, 0.4 * cover),
                       at=(0.5 * (length - cover), 0.0, height - 0.005))
    reach = draw.about(0.150, 0.2)
    handle = rod([(x - 0.02, 0.6 * height), (x + 0.3 * reach, 0.75 * height),
                  (x + reach, draw.between(0.5, 1.0) * height)],
                 [0.030, 0.017, 0.015, 0.016], [0.018, 0.013, 0.012, 0.011], 10)
    return shell + hood + (handle - inside)


def crumb_scoop(draw: Draw) -> Manifold:
    """Return a small scoop for crumbs with a tapering body."""
    length, width, height = draw.about(0.130), draw.about(0.145), draw.about(0.030, 0.2)
    shell, inside = _scoop(length, width, width * draw.between(0.35, 0.7), height, 0.03, 0.014,
                           0.003)
    x, reach = length / 2, draw.about(0.085, 0.2)
    handle = rod([(x - 0.006, 0.6 * height), (x + 0.5 * reach, height), (x + reach, height)],
                 [0.012, 0.009, 0.012, 0.009], draw.about(0.006, 0.2), 8)
    return shell + (handle - inside)


def lobby_pan(draw: Draw) -> Manifold:
    """Return a deep pan with a high back and a stick that leans back or stands up."""
    length, width, height = draw.about(0.200), draw.about(0.230), draw.about(0.110, 0.2)
    shell, inside = _scoop(length, width, width * draw.between(0.8, 1.0), height,
                           draw.between(0.03, 0.09), 0.02)
    x, reach = length / 2 - 0.003, draw.about(0.230, 0.2)
    a = np.radians(draw.between(25.0, 75.0))
    r = draw.about(0.0105, 0.2)
    stick = rod([(x - 0.01 * np.cos(a), 0.8 * height - 0.01 * np.sin(a)),
                 (x + 0.5 * reach * np.cos(a), 0.8 * height + 0.5 * reach * np.sin(a)),
                 (x + reach * np.cos(a), 0.8 * height + reach * np.sin(a))],
                [r, r, 1.3 * r], [r, r, 1.3 * r], 7)
    socket = box(0.016, 0.05, 0.5 * height, at=(x, 0.0, 0.45 * height))
    return shell + (socket + stick - inside)


def loop_pan(draw: Draw) -> Manifold:
    """Return a wide pan with a loop to hold it by."""
    length, width, height = draw.about(0.190), draw.about(0.270), draw.about(0.052, 0.2)
    shell, inside = _scoop(length, width, width * draw.between(0.75, 1.0), height, 0.05, 0.022)
    half = draw.about(0.045, 0.2)
    grip = bow(half, draw.about(0.085, 0.2), draw.about(0.009, 0.2), draw.about(0.008, 0.2), 0.006)
    grip = grip.rotate((0.0, -draw.between(0.0, 35.0), 0.0))
    return shell + (grip.translate((length / 2 - 0.001, 0.0, 0.6 * height)) - inside)


def pan_with_brush(draw: Draw) -> Manifold:
    """Return a pan in which its hand brush lies, the two handles one above the other."""
    length, width, height = draw.about(0.210), draw.about(0.220), draw.about(0.050, 0.2)
    shell, inside = _scoop(length, width, width * draw.between(0.7, 0.95), height, 0.06, 0.03)
    x, reach = length / 2, draw.about(0.130, 0.2)
    top = height + draw.between(0.0, 0.02)
    handle = rod([(x - 0.01, 0.5 * height), (x + 0.5 * reach, 0.6 * height),
                  (x + reach, 0.6 * height)], [0.018, 0.013, 0.016, 0.012], 0.008, 8)
    bristles = box(0.16 * length / 0.21, draw.about(0.055, 0.2), top, at=(0.0, 0.0, 0.001))
    back = rounded_box(0.85 * length, 0.045, 0.016, 0.02, at=(0.0, 0.0, top - 0.002))
    grip = rod([(0.3 * length, top + 0.006), (x + 0.3 * reach, top + 0.012),
                (x + 0.9 * reach, top + 0.008)], [0.016, 0.011, 0.014, 0.010], 0.007, 8)
    return shell + (handle - inside) + bristles + back + grip


def shell_scoop(draw: Draw) -> Manifold:
    """Return a scoop with a round back, like half a dish, and a stub for a handle."""
    length, width, height = draw.about(0.180), draw.about(0.200), draw.about(0.048, 0.25)
    flare = draw.between(0.0, 0.02)

    def block(inset: float, lift: float) -> Manifold:
        low, high = (Manifold.cylinder(0.001, 1.0, 1.0, 40).scale(
            (length - k - inset, 0.5 * width - k - inset, 1.0)) for k in (flare, 0.0))
        full = (low + high.translate((0.0, 0.0, height + lift - 0.001))).hull()
        front = box(0.004, width - 2 * inset, 0.003 + lift)
        back = full.trim_by_plane((1.0, 0.0, 0.0), 0.25 * length)
        return (back + front).hull()

    inside = block(draw.about(0.004, 0.2), 0.02).translate((0.0, 0.0, 0.0025))
    inside += box(0.03, width - 0.008, height, at=(-0.012, 0.0, 0.0025))
    reach = draw.about(0.120, 0.25)
    handle = rod([(length - 0.012, 0.6 * height), (length + 0.5 * reach, 0.8 * height),
                  (length + reach, 0.7 * height)], [0.016, 0.012, 0.015, 0.011],
                 draw.about(0.008, 0.2), 9)
    return (block(0.0, 0.0) - inside) + (handle - inside)


def ash_shovel(draw: Draw) -> Manifold:
    """Return a narrow, deep shovel on a long thin rod with a knob: for ashes or flour."""
    length, width, height = draw.about(0.170), draw.about(0.120), draw.about(0.048, 0.2)
    shell, inside = _scoop(length, width, width * draw.between(0.8, 1.0), height, 0.02, 0.012,
                           draw.about(0.0035, 0.2))
    x, reach, r = length / 2, draw.about(0.190, 0.2), draw.about(0.006, 0.2)
    rise = draw.between(0.0, 0.06)
    handle = rod([(x - 0.005, 0.6 * height), (x + 0.5 * reach, 0.6 * height + 0.6 * rise),
                  (x + reach, 0.6 * height + rise)], [r, r, r, 1.9 * r, 1.5 * r],
                 [r, r, r, 1.9 * r, 1.5 * r], 12)
    return shell + (handle - inside)


def ribbed_pan(draw: Draw) -> Manifold:
    """Return a wide, short pan with ribs on its floor and an upright-standing handle behind."""
    length, width, height = draw.about(0.165), draw.about(0.260), draw.about(0.060, 0.2)
    shell, inside = _scoop(length, width, 0.92 * width, height, 0.07, 0.02)
    for y in np.linspace(-0.35, 0.35, 7):
        shell += box(0.75 * length, 0.004, 0.006, at=(0.0, y * width, 0.001))
    x, rise = length / 2, draw.about(0.110, 0.2)
    lean = draw.between(0.01, 0.08)
    handle = rod([(x - 0.006, 0.7 * height), (x + 0.02 + 0.4 * lean, height + 0.35 * rise),
                  (x + 0.02 + lean, height + rise)], [0.024, 0.016, 0.019, 0.015],
                 draw.about(0.008, 0.2), 9)
    return shell + (handle - inside)


STYLES = {'dustpan': (dustpan, flat_scoop, steel_pan, hooded_pan, crumb_scoop, shell_scoop,
                      lobby_pan, ribbed_pan, pan_with_brush, loop_pan, ash_shovel)}
