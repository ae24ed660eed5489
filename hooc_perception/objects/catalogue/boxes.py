# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of boxes beside the common carton; they stand on their bottom, the broad side to -y."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import resized, slab
from hooc_perception.objects.catalogue.shapes import (
    box,
    cylinder,
    ellipse,
    outline,
    rounded_box,
    union,
)
from manifold3d import Manifold


def _hollow(length: float, width: float, height: float, wall: float) -> Manifold:
    """Return a box that is open at its top."""
    return box(length, width, height) - box(length - 2 * wall, width - 2 * wall, height,
                                            at=(0.0, 0.0, wall))


def _flap(length: float, reach: float, wall: float, angle_deg: float) -> Manifold:
    """Return a flap along x that rises from the origin towards +y; 0 degrees = upright."""
    flap = box(length, wall, reach + 0.5 * wall, at=(0.0, 0.0, -0.5 * wall))
    return flap.rotate((-angle_deg, 0.0, 0.0))


def cracker_box(draw: Draw) -> Manifold:
    """Return a plain upright block, as of crackers or sugar."""
    thick = draw.about(0.050, 0.25)
    return resized(box(draw.about(0.125, 0.2), thick, draw.about(0.185, 0.2)), draw)


def tissue_cube(draw: Draw) -> Manifold:
    """Return a cube of tissues with an oval opening, a tissue in it or not."""
    side = draw.about(0.115)
    high = side * draw.about(1.1, 0.12)
    body = box(side, side, high)
    hole = ellipse(0.34 * side, 0.2 * side, segments=24).extrude(0.1)
    body -= hole.translate((0.0, 0.0, high - draw.about(0.020, 0.3)))
    if draw.chance(0.5):
        tissue = (box(0.5 * side, 0.008, 0.01, at=(0.0, 0.0, high - 0.040))
                  + box(0.25 * side, 0.02, 0.002, at=(0.01, 0.0, high + draw.about(0.025, 0.4))))
        body += tissue.hull()
    return resized(body, draw)


def flat_box(draw: Draw) -> Manifold:
    """Return a flat box, as of a game or a pizza, whose lid overlaps with a step."""
    length, width = draw.about(0.240), draw.about(0.180, 0.2)
    high, step = draw.about(0.040, 0.3), draw.about(0.002, 0.3)
    cover = high * draw.between(0.35, 1.0)
    body = box(length - 2 * step, width - 2 * step, high)
    return resized(body + box(length, width, cover, at=(0.0, 0.0, high - cover)), draw)


def open_carton(draw: Draw) -> Manifold:
    """Return an open, hollow carton with its four flaps spread."""
    length, width = draw.about(0.190), draw.about(0.140, 0.2)
    high, wall = draw.about(0.120, 0.2), draw.about(0.003, 0.3)
    parts = [_hollow(length, width, high, wall)]
    for side in (0, 1):
        for turn, (a, b) in ((0.0, (length, width)), (90.0, (width, length))):
            flap = _flap(a - 2.2 * wall, 0.45 * width, wall, draw.between(10.0, 140.0))
            parts.append(flap.translate((0.0, 0.5 * (b - wall), high - 0.3 * wall)).rotate(
                (0.0, 0.0, turn + 180.0 * side)))
    return resized(union(*parts), draw)


def shoe_box(draw: Draw) -> Manifold:
    """Return a shoe box: its lid a little larger than the body."""
    length, width = draw.about(0.290, 0.12), draw.about(0.170)
    high, step = draw.about(0.105), draw.about(0.003, 0.25)
    cover = draw.about(0.030, 0.3)
    lid = box(length + 2 * step, width + 2 * step, cover, at=(0.0, 0.0, high - cover + step))
    return resized(box(length, width, high) + lid, draw)


def small_box(draw: Draw) -> Manifold:
    """Return a small packet, as of pudding or medicine, its end flap open or closed."""
    length, width = draw.about(0.085, 0.2), draw.about(0.032, 0.25)
    high = draw.about(0.075, 0.25)
    body = box(length, width, high)
    if draw.chance(0.5):
        wall = 0.0012
        body -= box(length - 2 * wall, width - 2 * wall, 0.1, at=(0.0, 0.0, 0.6 * high))
        flap = _flap(length - 2 * wall, 0.8 * width, wall, draw.between(0.0, 70.0))
        body += flap.translate((0.0, 0.5 * (width - wall), high - 0.3 * wall))
    return resized(body, draw)


def tissue_box(draw: Draw) -> Manifold:
    """Return a flat box of tissues with a long slot in its top."""
    length, width = draw.about(0.230), draw.about(0.118)
    high = draw.about(0.070, 0.25)
    slot = ellipse(0.32 * length, 0.16 * width, segments=28).extrude(0.2)
    return resized(box(length, width, high) - slot.translate(
        (0.0, 0.0, high - draw.about(0.015, 0.4))), draw)


def cube_box(draw: Draw) -> Manifold:
    """Return a gift box, nearly a cube, with a lid or a bow."""
    side = draw.about(0.105, 0.2)
    width, high = side * draw.about(1.0, 0.08), side * draw.about(0.85, 0.2)
    step, cover = draw.about(0.0025, 0.3), draw.between(0.2, 0.45) * high
    body = box(side - 2 * step, width - 2 * step, high)
    body += box(side, width, cover, at=(0.0, 0.0, high - cover))
    if draw.chance(0.3):
        knob = cylinder(0.11 * side, 0.1 * side, at=(0.0, 0.0, high - 0.001),
                        top=0.15 * side, segments=16)
        body += knob
    return resized(body, draw)


def tin_box(draw: Draw) -> Manifold:
    """Return a box with rounded edges, such as of metal or plastic, with a rim around."""
    length, width = draw.about(0.165, 0.2), draw.about(0.110, 0.2)
    high, round_by = draw.about(0.065, 0.3), draw.about(0.020, 0.3)
    low = rounded_box(length, width, 0.6 * high, round_by)
    rim = rounded_box(length + 0.005, width + 0.005, 0.006, round_by, at=(0.0, 0.0, 0.6 * high))
    lid = rounded_box(length, width, 0.9 * high, round_by)
    top = rounded_box(length - 0.012, width - 0.012, high, 0.8 * round_by)
    return resized(union(low, rim, (lid + top).hull()), draw)


def storage_box(draw: Draw) -> Manifold:
    """Return an open box without a lid, its sides straight, maybe with grips cut out."""
    length, width = draw.about(0.200, 0.2), draw.about(0.145, 0.2)
    high, wall = draw.about(0.095, 0.25), draw.about(0.0035, 0.3)
    shell = _hollow(length, width, high, wall)
    if draw.chance(0.5):
        shell -= rounded_box(1.2 * length, 0.35 * width, 0.016, 0.004, at=(0.0, 0.0, 0.72 * high))
    return resized(shell, draw)


def gable_box(draw: Draw) -> Manifold:
    """Return a milk or juice carton: a square foot, a roof with a ridge, maybe a cap."""
    side = draw.about(0.075)
    high, roof = draw.about(0.165, 0.2), draw.about(0.035, 0.2)
    profile = outline([(-side / 2, 0.0), (side / 2, 0.0), (side / 2, high), (0.002, high + roof),
                       (0.002, high + roof + 0.012), (-0.002, high + roof + 0.012),
                       (-0.002, high + roof), (-side / 2, high)])
    body = slab(profile, draw.about(side, 0.1)).rotate((0.0, 0.0, 90.0))
    if draw.chance(0.6):
        cap = cylinder(0.012, 0.03, segments=16).rotate((55.0, 0.0, 0.0))
        body += cap.translate((0.0, -0.25 * side, high + 0.35 * roof))
    return resized(body, draw)


def display_box(draw: Draw) -> Manifold:
    """Return an upright carton whose lid stands open at its back."""
    length, width = draw.about(0.120, 0.2), draw.about(0.060, 0.25)
    high, wall = draw.about(0.150, 0.25), draw.about(0.0018, 0.25)
    shell = _hollow(length, width, high, wall)
    lid = _flap(length - 2.2 * wall, width, wall, draw.between(-35.0, 25.0))
    ears = [_flap(width - 2.2 * wall, 0.5 * width, wall, draw.between(10.0, 100.0)).translate(
        (0.0, 0.5 * (length - wall), high - 0.3 * wall)).rotate((0.0, 0.0, turn))
        for turn in (90.0, -90.0)]
    return resized(union(shell, lid.translate((0.0, 0.5 * (width - wall), high - 0.3 * wall)),
                         *ears), draw)


BOXES = (tissue_cube, cracker_box, flat_box, open_carton, storage_box, small_box, shoe_box,
         tissue_box, tin_box, cube_box, gable_box, display_box)
