# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Trays: for serving, baking, canteens and drawers; rectangular, oval and round."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import box, rounded_rectangle
from hooc_perception.objects.catalogue.vessel_parts import (
    basin,
    body,
    bow,
    cavity,
    handled,
    radius_at,
    superellipse,
)
from manifold3d import Manifold
import numpy as np

FINE = 40


def tray(draw: Draw) -> Manifold:
    """Return a serving tray with leaning sides and a grip at each end."""
    length, width, height = draw.about(0.380), draw.about(0.270), draw.about(0.042, 0.2)
    wall, flare = draw.about(0.004, 0.2), draw.about(0.014, 0.3)
    inside = basin(length - 2 * wall, width - 2 * wall, height + 0.004, 0.028, flare)
    shell = basin(length, width, height, 0.030, flare) - inside.translate((0.0, 0.0, wall))
    grip = rounded_rectangle(0.085, 0.016, 0.0079).extrude(0.06).rotate((90.0, 0.0, 90.0))
    rise = height - 0.042
    for x in (-0.21, 0.15):
        shift = (0.5 if x > 0 else -0.5) * (length - 0.380)
        shell -= grip.translate((x + shift, 0.0, 0.027 + rise))
    return shell


def _trough(length: float, width: float, height: float, radius: float, flare: float,
            wall: float, floor: float) -> Manifold:
    """Return an open basin of a wall and a floor thickness."""
    inside = basin(length - 2 * wall, width - 2 * wall, height + 0.01,
                   max(radius - wall, 0.002), flare * (height + 0.01) / height)
    grown = flare * 0.01 / height
    scale = ((length - 2 * wall + 2 * grown) / (length - 2 * wall),
             (width - 2 * wall + 2 * grown) / (width - 2 * wall), 1.0)
    return basin(length, width, height, radius, flare) - inside.scale(scale).translate(
        (0.0, 0.0, floor))


def _flange(length: float, width: float, radius: float, rim: float, thick: float,
            top: float) -> Manifold:
    """Return a flat frame around an opening of length x width, its upper side at `top`."""
    outer = rounded_rectangle(length + 2 * rim, width + 2 * rim, radius + rim)
    inner = rounded_rectangle(length - 0.004, width - 0.004, radius)
    return (outer - inner).extrude(thick).translate((0.0, 0.0, top - thick))


def straight_tray(draw: Draw) -> Manifold:
    """Return a rectangular tray with upright walls and sharp corners."""
    length, width, height = draw.about(0.330), draw.about(0.230), draw.about(0.040, 0.3)
    return _trough(length, width, height, draw.between(0.003, 0.020), 0.0,
                   draw.about(0.005, 0.4), draw.about(0.005, 0.3))


def baking_sheet(draw: Draw) -> Manifold:
    """Return a baking tray: low leaning walls and a flat or rolled rim."""
    length, width, height = draw.about(0.360), draw.about(0.260), draw.about(0.024, 0.3)
    radius, rim = draw.between(0.012, 0.03), draw.about(0.009, 0.3)
    solid = _trough(length, width, height, radius, draw.about(0.007, 0.4), 0.0035, 0.003)
    return solid + _flange(length, width, radius, rim, 0.0035, height)


def round_tray(draw: Draw) -> Manifold:
    """Return a waiter's round tray with a low rim."""
    r, h = draw.about(0.165, 0.14), draw.about(0.026, 0.3)
    side = [(r * draw.between(0.88, 0.99), 0.0), (0.99 * r, 0.7 * h), (r, h)]
    return body(side, None, FINE) - cavity(side, draw.about(0.004, 0.3), draw.about(0.004, 0.2),
                                           None, FINE)


def oval_tray(draw: Draw) -> Manifold:
    """Return an oval tray with grips that stand out from its rim, or holes in it."""
    r, h = draw.about(0.185), draw.about(0.032, 0.3)
    shape = superellipse(draw.between(0.6, 0.75), draw.between(2.0, 3.2), FINE)
    side = [(r * draw.between(0.82, 0.95), 0.0), (0.985 * r, 0.8 * h), (r, h)]
    inside = cavity(side, draw.about(0.005, 0.3), draw.about(0.004, 0.2), shape)
    half = draw.about(0.055, 0.2)
    across = np.abs(shape[:, 1]) < half / r
    edge = float(np.abs(shape[across, 0]).min()) * radius_at(side, h - 0.006)
    grip = bow(half, draw.about(0.034, 0.2) + 0.5 * (r - edge), draw.about(0.006, 0.2), 0.0045)
    grip = grip.translate((edge - 0.002, 0.0, h - 0.006))
    return handled(side, inside, grip, grip.rotate((0.0, 0.0, 180.0)), shape=shape)


def wooden_tray(draw: Draw) -> Manifold:
    """Return a box tray of boards whose ends are higher and have holes to grip."""
    length, width, height = draw.about(0.380), draw.about(0.260), draw.about(0.045, 0.2)
    wall, end = draw.about(0.010, 0.25), draw.about(0.068, 0.12)
    solid = box(length, width, draw.about(0.007, 0.2))
    end = max(end, height)
    hole = rounded_rectangle(0.095, 0.022, 0.0109).extrude(1.0).rotate((90.0, 0.0, 90.0))
    for s in (-1.0, 1.0):
        solid += box(length, wall, height, at=(0.0, 0.5 * s * (width - wall), 0.0))
        solid += box(wall, width, end, at=(0.5 * s * (length - wall), 0.0, 0.0))
    return solid - hole.translate((-0.5, 0.0, end - 0.024))


def canteen_tray(draw: Draw) -> Manifold:
    """Return a flat plastic tray with a broad, gently raised rim."""
    length, width, height = draw.about(0.390, 0.12), draw.about(0.290), draw.about(0.020, 0.2)
    flare, radius = draw.about(0.028, 0.25), draw.between(0.03, 0.06)
    solid = _trough(length, width, height, radius, min(flare, 0.04), 0.004, 0.004)
    if draw.chance(0.5):
        solid += _flange(length, width, radius, draw.about(0.012, 0.3), 0.0035, height)
    return solid


def handled_tray(draw: Draw) -> Manifold:
    """Return a tray with a bow above each end, or lying flat outside of it."""
    length, width, height = draw.about(0.350), draw.about(0.240), draw.about(0.030, 0.3)
    flare = draw.between(0.0, 0.012)
    solid = _trough(length, width, height, 0.02, flare, draw.about(0.005, 0.2), 0.005)
    half, reach = draw.about(0.055, 0.2), draw.about(0.045, 0.2)
    grip = bow(half, reach, 0.005, 0.005)
    # 0 degrees: it lies flat; 90 degrees: it stands on the wall.
    lift = draw.pick(80.0, 0.0, 60.0)
    at = (0.5 * length - 0.003, 0.0, height - 0.005)
    for turn in (0.0, 180.0):
        solid += grip.rotate((0.0, -lift, 0.0)).translate(at).rotate((0.0, 0.0, turn))
    return solid


def deep_tray(draw: Draw) -> Manifold:
    """Return a deep tray or roasting tin with a rim."""
    length, width, height = draw.about(0.320), draw.about(0.220), draw.about(0.072, 0.2)
    radius = draw.between(0.02, 0.04)
    solid = _trough(length, width, height, radius, draw.between(0.003, 0.022), 0.004, 0.004)
    return solid + _flange(length, width, radius, draw.about(0.011, 0.4), 0.004, height)


def sorting_tray(draw: Draw) -> Manifold:
    """Return a drawer tray with compartments, for cutlery or tools."""
    length, width, height = draw.about(0.340), draw.about(0.250), draw.about(0.046, 0.2)
    solid = _trough(length, width, height, 0.014, draw.between(0.0, 0.006), 0.004, 0.004)
    rise = draw.between(0.7, 0.97) * height
    across = draw.between(0.2, 0.32) * length
    long = length - across - 0.02
    solid += box(0.004, width - 0.020, rise, at=(0.5 * length - across, 0.0, 0.0))
    count = draw.pick(3, 2, 4)
    for i in range(1, count):
        y = (i / count - 0.5) * (width - 0.02)
        solid += box(long, 0.004, rise, at=(0.5 * length - across - 0.5 * long, y, 0.0))
    return solid


def small_tray(draw: Draw) -> Manifold:
    """Return a small, thick tray for keys, pens or instruments."""
    length, width = draw.about(0.230), draw.about(0.120, 0.25)
    height, wall = draw.about(0.026, 0.25), draw.about(0.008, 0.25)
    radius = draw.between(0.2, 0.48) * width
    return _trough(length, width, height, radius, draw.between(0.0, 0.012), wall, 0.007)


def lipped_board(draw: Draw) -> Manifold:
    """Return a flat board with a low lip on two or three of its sides, or a lap tray on feet."""
    length, width, thick = draw.about(0.380), draw.about(0.260), draw.about(0.009, 0.25)
    solid = rounded_rectangle(length, width, draw.between(0.003, 0.03)).extrude(thick)
    lip, wall = draw.about(0.024, 0.3), draw.about(0.009, 0.2)
    for s in (-1.0, 1.0):
        solid += box(wall, 0.7 * width, thick + lip, at=(0.5 * s * (length - wall) * 0.99, 0, 0))
    if draw.chance(0.5):
        solid += box(0.96 * length, wall, thick + lip, at=(0.0, 0.49 * width - 0.5 * wall, 0.0))
    return solid


STYLES = {'tray': (tray, straight_tray, baking_sheet, round_tray, oval_tray, wooden_tray,
                   deep_tray, canteen_tray, sorting_tray, handled_tray, small_tray, lipped_board)}
