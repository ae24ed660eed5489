# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of knives beside the common table knife; edges towards -y, tips towards x."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import bar, brick, mirrored, resized, smooth
from hooc_perception.objects.catalogue.shapes import box, curve, cylinder, outline
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def _blade(edge: npt.ArrayLike, spine: npt.ArrayLike, thickness: float) -> Manifold:
    """Return a blade between two lines of (x, y), x rising, about z = 0."""
    shape = outline(np.vstack([edge, np.asarray(spine)[::-1]]))
    return shape.extrude(thickness).translate((0.0, 0.0, -thickness / 2))


def chef_knife(draw: Draw) -> Manifold:
    """Return a chef's knife: a deep blade to a point, a bolster and a riveted handle."""
    length, depth = draw.about(0.200, 0.2), draw.about(0.046, 0.2)
    edge = curve([(0.0, -depth + 0.012), (0.5 * length, 0.95 * -depth + 0.014),
                  (0.85 * length, -0.4 * depth + 0.010), (length, 0.004)], 10)
    blade = _blade(edge, [(0.0, 0.012), (0.6 * length, 0.011), (length, 0.006)],
                   draw.about(0.0025, 0.3))
    grip, thick = draw.about(0.013), draw.about(0.010, 0.2)
    handle = bar([(-0.125, 0.8 * grip, 0.6 * thick, 0.0, -0.008),
                  (-0.118, 1.15 * grip, thick, 0.0, -0.007), (-0.06, 0.9 * grip, thick),
                  (-0.015, grip, 0.8 * thick), (0.004, 0.8 * grip, 0.35 * thick)], sides=14)
    bolster = box(0.012, 2 * grip, 1.4 * thick, at=(-0.003, 0.0, -0.7 * thick))
    return resized(blade + handle + bolster, draw)


def butter_knife(draw: Draw) -> Manifold:
    """Return a spreader: one flat piece with a broad, round blade."""
    wide, handle = draw.about(0.013, 0.25), draw.about(0.0075, 0.25)
    half = smooth([(-0.085, 0.6 * handle), (-0.080, handle), (-0.03, 0.7 * handle),
                   (0.0, 0.6 * handle), (0.022, wide), (0.055, wide), (0.070, 0.7 * wide),
                   (0.075, 0.25 * wide)], 14)
    return resized(mirrored(half).extrude(draw.about(0.0028, 0.3)), draw)


def bread_knife(draw: Draw) -> Manifold:
    """Return a bread knife: a long, parallel, toothed blade and a thick handle."""
    length, depth = draw.about(0.205), draw.about(0.017, 0.2)
    x = np.linspace(0.0, 0.97 * length, 25)
    teeth = np.column_stack([x, -depth + 0.0022 * (np.arange(25) % 2)])
    blade = _blade(teeth, [(0.0, depth), (0.85 * length, depth), (length, -0.2 * depth)],
                   draw.about(0.0022, 0.25))
    grip, thick = draw.about(0.0145), draw.about(0.0105, 0.2)
    handle = brick([(-0.125, 0.9 * grip, 0.8 * thick), (-0.118, grip, thick),
                    (-0.06, 0.85 * grip, thick), (-0.01, grip, thick), (0.004, 0.9 * grip,
                    0.7 * thick)])
    return resized(blade + handle, draw)


def paring_knife(draw: Draw) -> Manifold:
    """Return a short, pointed vegetable knife with a straight handle."""
    length, depth = draw.about(0.080, 0.2), draw.about(0.009, 0.2)
    edge = curve([(-0.01, -depth), (0.7 * length, -0.8 * depth), (length, 0.8 * depth)], 7)
    blade = _blade(edge, [(-0.01, depth), (length, depth)], draw.about(0.0018, 0.3))
    grip = draw.about(0.0095, 0.2)
    handle = bar([(-0.105, 0.7 * grip, 0.5 * grip), (-0.1, grip, 0.75 * grip),
                  (-0.05, 0.85 * grip, 0.7 * grip), (0.0, 0.9 * grip, 0.6 * grip)], 7, 10)
    return resized(blade + handle, draw)


def cleaver(draw: Draw) -> Manifold:
    """Return a cleaver: a rectangular blade, with a hole or without."""
    length, depth = draw.about(0.165, 0.2), draw.about(0.080, 0.2)
    thick = draw.about(0.003, 0.3)
    top = 0.016
    edge = [(0.0, top - depth), (0.5 * length, top - 1.04 * depth), (length, top - depth)]
    blade = _blade(edge, [(0.0, top), (length, top)], thick)
    if draw.chance(0.5):
        blade -= cylinder(0.006, 0.02, at=(0.9 * length, 0.0, -0.01), segments=12)
    grip = draw.about(0.0135)
    handle = bar([(-0.120, 0.8 * grip, 0.7 * grip), (-0.115, 1.05 * grip, 0.9 * grip),
                  (-0.03, grip, 0.85 * grip), (0.008, 0.8 * grip, 0.6 * grip)], 8)
    return resized(blade + handle, draw)


def plastic_knife(draw: Draw) -> Manifold:
    """Return a throw-away knife: thin, with a ribbed handle as wide as the blade."""
    wide, thick = draw.about(0.0085, 0.2), draw.about(0.002, 0.3)
    edge = curve([(-0.015, -wide), (0.05, -1.1 * wide), (0.08, -0.6 * wide), (0.088, 0.5 * wide)],
                 8)
    blade = _blade(edge, [(-0.015, 0.7 * wide), (0.080, 1.0 * wide)], thick)
    shape = mirrored(smooth([(-0.09, 0.7 * wide), (-0.086, wide), (-0.01, 0.75 * wide)], 4))
    handle = shape.extrude(thick).translate((0.0, 0.0, -thick / 2))
    rib = mirrored([(-0.085, 0.8 * wide), (-0.012, 0.6 * wide)])
    rib -= mirrored([(-0.080, 0.6 * wide), (-0.016, 0.4 * wide)])
    return resized(blade + handle + rib.extrude(1.6 * thick + 0.001), draw)


def steak_knife(draw: Draw) -> Manifold:
    """Return a steak knife: a narrow, upswept blade on a curved wooden handle."""
    length, depth = draw.about(0.115), draw.about(0.0095, 0.2)
    edge = curve([(-0.01, -depth), (0.6 * length, -1.1 * depth), (length, 1.2 * depth)], 8)
    spine = curve([(-0.01, 0.8 * depth), (0.6 * length, 0.5 * depth), (length, 1.3 * depth)], 6)
    blade = _blade(edge, spine, draw.about(0.0018, 0.3))
    grip, thick = draw.about(0.0105, 0.2), draw.about(0.0075, 0.2)
    hook = draw.between(-0.010, -0.002)
    handle = bar([(-0.115, grip, 0.7 * thick, 0.0, hook), (-0.108, 1.15 * grip, thick, 0.0, hook),
                  (-0.06, 0.9 * grip, thick, 0.0, 0.003), (-0.012, grip, thick),
                  (0.0, 0.8 * grip, 0.6 * thick)], 9)
    return resized(blade + handle, draw)


def santoku(draw: Draw) -> Manifold:
    """Return a santoku: a broad blade whose spine drops to the edge, on a round handle."""
    length, depth = draw.about(0.165), draw.about(0.044, 0.15)
    top = 0.012
    spine = smooth([(0.0, top), (0.75 * length, top - 0.002), (0.93 * length, top - 0.3 * depth),
                   (length, top - 0.85 * depth)], 9)
    blade = _blade([(0.0, top - depth), (0.8 * length, top - 1.02 * depth), (0.97 * length,
                    top - 0.95 * depth)], spine, draw.about(0.0022, 0.3))
    grip = draw.about(0.0115)
    handle = bar([(-0.13, 0.9 * grip, 0.9 * grip), (-0.125, grip, grip), (0.006, 0.9 * grip,
                  0.85 * grip)], 3, draw.pick(16, 8))
    return resized(blade + handle, draw)


def carving_knife(draw: Draw) -> Manifold:
    """Return a long, slender filleting knife; its handle has a guard for the fingers."""
    length, depth = draw.about(0.215), draw.about(0.012, 0.2)
    edge = curve([(-0.01, -depth), (0.5 * length, -0.7 * depth), (0.85 * length, -0.2 * depth),
                  (length, 1.5 * depth)], 10)
    spine = curve([(-0.01, depth), (0.5 * length, 0.7 * depth), (length, 1.6 * depth)], 8)
    blade = _blade(edge, spine, draw.about(0.0018, 0.25))
    grip, thick = draw.about(0.0125), draw.about(0.0105, 0.2)
    handle = bar([(-0.135, 0.8 * grip, 0.7 * thick, 0.0, -0.008),
                  (-0.125, 1.25 * grip, thick, 0.0, -0.006), (-0.075, 0.9 * grip, thick),
                  (-0.035, 1.05 * grip, thick), (-0.02, 0.85 * grip, 0.9 * thick, 0.0, 0.001),
                  (-0.004, 1.5 * grip, 0.8 * thick, 0.0, -0.006), (0.002, 0.9 * grip,
                   0.5 * thick)], 12)
    return resized(blade + handle, draw)


def solid_table_knife(draw: Draw) -> Manifold:
    """Return a modern table knife of one thick piece of steel, its handle a slim slab."""
    wide, thick = draw.about(0.0075, 0.2), draw.about(0.006, 0.25)
    blade = _blade(curve([(0.0, -0.8 * wide), (0.05, -1.2 * wide), (0.09, -0.7 * wide),
                          (0.102, 0.9 * wide)], 9), [(0.0, 0.8 * wide), (0.095, wide)],
                   draw.about(0.002, 0.25))
    handle = brick([(-0.125, wide, thick / 2), (-0.01, 0.7 * wide, 0.8 * thick / 2),
                    (0.012, 0.8 * wide, 0.2 * thick)], 4)
    return resized(blade + handle, draw)


KNIVES = (chef_knife, butter_knife, bread_knife, paring_knife, cleaver, plastic_knife,
          carving_knife, santoku, solid_table_knife, steak_knife)
