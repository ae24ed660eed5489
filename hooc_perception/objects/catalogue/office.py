# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stapler, book, box and tube."""

from collections.abc import Callable

from hooc_perception.objects.catalogue.books import BOOKS
from hooc_perception.objects.catalogue.boxes import BOXES
from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import resized
from hooc_perception.objects.catalogue.shapes import (
    box,
    curve,
    cylinder,
    outline,
    rounded_box,
    union,
)
from hooc_perception.objects.catalogue.staplers import STAPLERS
from hooc_perception.objects.catalogue.tubes import TUBES
from manifold3d import Manifold
import numpy as np


def stapler(draw: Draw) -> Manifold:
    """Return a desk stapler, its arm raised a little over the base."""
    base = (rounded_box(0.150, 0.036, 0.008, 0.010)
            + rounded_box(0.040, 0.030, 0.026, 0.006, at=(-0.052, 0.0, 0.0)))
    profile = np.vstack([[(-0.074, 0.0), (0.072, 0.0), (0.074, 0.010)],
                         curve([(0.070, 0.020), (0.020, 0.027), (-0.040, 0.030), (-0.072, 0.018)],
                               9)])
    arm = outline(profile).extrude(0.032).rotate((90.0, 0.0, 0.0)).translate((0.0, 0.016, 0.0))
    magazine = box(0.136, 0.018, 0.014, at=(0.003, 0.0, -0.011))
    arm = (arm + magazine).rotate((0.0, -draw.between(2.0, 12.0), 0.0))
    arm = arm.translate((0.0, 0.0, 0.033))
    anvil = rounded_box(0.022, 0.016, 0.002, 0.004, at=(0.058, 0.0, 0.008))
    return resized(union(base, arm, anvil), draw)


def book(draw: Draw) -> Manifold:
    """Return a hardback that lies flat: two boards, a round spine, pages set back."""
    pages = box(0.140, 0.208, 0.028, at=(0.001, 0.0, 0.003))
    board = box(0.150, 0.220, 0.003)
    round_back = cylinder(0.017, 0.220, at=(0.0, -0.110, 0.0), axis='y', segments=24)
    spine = (round_back - round_back.scale((0.8, 1.1, 0.8))).scale((0.5, 1.0, 1.0))
    spine = spine.trim_by_plane((-1.0, 0.0, 0.0), 0.0).translate((-0.0745, 0.0, 0.017))
    solid = union(pages, board, board.translate((0.0, 0.0, 0.031)), spine)
    return resized(solid.scale((1.0, 1.0, draw.about(1.0, 0.25))), draw)


def carton(draw: Draw) -> Manifold:
    """Return a carton, such as of cereals, its lid tucked in."""
    body = box(0.150, 0.062, 0.210)
    seam = box(0.146, 0.002, 0.002, at=(0.0, 0.024, 0.2085))
    thumb = cylinder(0.010, 0.002, at=(0.0, 0.024, 0.2085), segments=24)
    return resized(body - (seam + thumb), draw, 0.12)


def tube(draw: Draw) -> Manifold:
    """Return a cardboard tube, open at both ends, lying down."""
    outer = cylinder(0.022, 0.240, at=(0.0, -0.120, 0.022), axis='y', segments=48)
    bore = 0.022 - 0.0025 * draw.about(1.0, 0.3)
    solid = outer - cylinder(bore, 0.250, at=(0.0, -0.125, 0.022), axis='y', segments=48)
    return resized(solid, draw, 0.12)


STYLES: dict[str, tuple[Callable[[Draw], Manifold], ...]] = {
    'stapler': (stapler, *STAPLERS), 'book': (book, *BOOKS), 'box': (carton, *BOXES),
    'tube': (tube, *TUBES)}
