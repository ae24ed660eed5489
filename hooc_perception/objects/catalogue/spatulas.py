# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of spatulas beside the slotted turner; the blade is at the origin."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import (
    bar,
    brick,
    mirrored,
    resized,
    rod,
    slab,
    smooth,
    strip,
)
from hooc_perception.objects.catalogue.shapes import (
    curve,
    cylinder,
    ellipse,
    outline,
    rounded_rectangle,
)
from manifold3d import CrossSection, Manifold
import numpy as np


def _turner(blade: CrossSection, thickness: float, start: float, rise: float, end: float,
            thick: float, fat: float, bend: float = 0.0) -> Manifold:
    """
    Return a blade with a rising handle.

    :param start: x where the neck leaves the blade.
    :param rise: height of the handle's end.
    :param end: its distance from the middle of the blade.
    :param thick: half width of the neck; `fat` that of the grip.
    :param bend: how far the back of the blade rises.
    """
    low = start - 0.02
    sheet = strip(blade, thickness, [(low, bend), (0.0, 0.0), (0.05, 0.0)], 0.022)
    grip = start - 0.35 * (end + start)
    neck = bar([(grip - 0.02, thick, 0.7 * thick, 0.72 * rise),
                (0.5 * (grip + start), thick, 0.7 * thick, 0.5 * rise),
                (start - 0.02, thick, 0.6 * thick, 0.16 * rise + bend),
                (start + 0.012, 1.6 * thick, 0.35 * thick, 0.7 * bend + 0.5 * thickness)], 10, 10)
    haft = bar([(-end, 0.6 * fat, 0.5 * fat, rise), (-end + 0.006, fat, 0.7 * fat, 0.99 * rise),
                (0.5 * (grip - end), 0.9 * fat, 0.65 * fat, 0.88 * rise),
                (grip, 0.7 * fat, 0.5 * fat, 0.68 * rise)], 8)
    return sheet + neck + haft


def solid_turner(draw: Draw) -> Manifold:
    """Return a turner with a broad, closed, square blade and a low handle."""
    width, length = draw.about(0.043, 0.2), draw.about(0.048, 0.2)
    blade = mirrored([(-length, 0.75 * width), (-0.8 * length, 0.95 * width), (length, width)])
    return resized(_turner(blade, draw.about(0.003, 0.3), -length, draw.about(0.035, 0.5),
                           draw.about(0.26), draw.about(0.006, 0.25), draw.about(0.012, 0.2)),
                   draw)


def scraper(draw: Draw) -> Manifold:
    """Return a rubber scraper: a thick paddle in line with a straight handle."""
    width, length = draw.about(0.027, 0.2), draw.about(0.048, 0.2)
    thick = draw.about(0.009, 0.25)
    edge = outline([(-length, -0.85 * width), (-0.9 * length, -width), (0.8 * length, -width),
                    (length, -0.6 * width), (length, width), (-0.9 * length, width),
                    (-length, 0.85 * width)])
    paddle = edge.extrude(thick).translate((0.0, 0.0, -thick / 2))
    wedge = outline([(-2 * length, -thick), (-2 * length, thick), (-0.5 * length, thick / 2),
                     (1.01 * length, 0.0012), (1.01 * length, -0.0012),
                     (-0.5 * length, -thick / 2)])
    rod_half, end = draw.about(0.0055, 0.25), draw.about(0.215)
    handle = bar([(-end, 0.7 * rod_half, 0.6 * rod_half), (-end + 0.004, 1.3 * rod_half, rod_half),
                  (-0.1, rod_half, 0.9 * rod_half), (-0.5 * length, rod_half, 0.45 * thick)], 7)
    return resized((paddle ^ slab(wedge, 0.2)) + handle, draw)


def fish_slice(draw: Draw) -> Manifold:
    """Return a fish slice of steel: a long blade with long slots and a cranked neck."""
    width, length = draw.about(0.036, 0.2), draw.about(0.065, 0.2)
    blade = mirrored(smooth([(-length, 0.35 * width), (-0.8 * length, 0.7 * width),
                             (-0.4 * length, 0.9 * width), (length, width)], 5))
    rows = draw.pick(5, 4, 7)
    for y in np.linspace(-0.72, 0.72, rows):
        slot = rounded_rectangle(1.2 * length, 0.9 * width / rows, 0.4 * width / rows, 8)
        blade -= slot.translate((0.12 * length, 0.9 * y * width))
    rise, end = draw.about(0.040, 0.3), length + draw.about(0.180)
    sheet = blade.extrude(draw.about(0.0018, 0.3))
    wide = draw.about(0.0085, 0.25)
    neck = brick([(-end + 0.01, wide, 0.0016, rise + 0.03), (-length - 0.03, wide, 0.0014, rise),
                  (-length - 0.004, 0.8 * wide, 0.0014, 0.006),
                  (-0.85 * length, 0.3 * width, 0.0013, 0.0013)], 10)
    haft = bar([(-end - 0.02, wide, 0.5 * wide, rise + 0.032),
                (-end - 0.01, 1.3 * wide, 0.7 * wide, rise + 0.031),
                (-length - 0.08, wide, 0.8 * wide, rise + 0.014)], 5)
    return resized(sheet + neck + haft, draw)


def palette_knife(draw: Draw) -> Manifold:
    """Return a cranked palette knife: a long, narrow blade with a round end."""
    width, length = draw.about(0.016, 0.2), draw.about(0.095, 0.2)
    tip = curve([(0.85 * length, width), (0.96 * length, 0.7 * width), (length, 0.05 * width)], 7)
    blade = mirrored(np.vstack([[(-length, 0.7 * width), (-0.9 * length, width)], tip]))
    step, thick = draw.about(0.018, 0.5), draw.about(0.0016, 0.2)
    sheet = blade.extrude(thick)
    neck = brick([(-length - 0.05, 0.4 * width, 0.0025, step),
                  (-length - 0.012, 0.6 * width, 0.0012, 0.9 * step),
                  (-length + 0.006, 0.75 * width, 0.001, 0.001)], 5)
    grip = draw.about(0.0115, 0.2)
    haft = bar([(-length - 0.145, 0.6 * grip, 0.5 * grip, step),
                (-length - 0.14, grip, 0.85 * grip, step),
                (-length - 0.08, 1.1 * grip, 0.9 * grip, step),
                (-length - 0.025, 0.7 * grip, 0.6 * grip, step)], 8)
    return resized(sheet + neck + haft, draw)


def wooden_spatula(draw: Draw) -> Manifold:
    """Return a spatula of one piece of wood: flat, its end straight or slanted."""
    width, grip = draw.about(0.029, 0.2), draw.about(0.010, 0.25)
    end, slant = draw.about(0.235), draw.between(-0.012, 0.012)
    half = smooth([(-end, 0.6 * grip), (-end + 0.006, grip), (-0.10, 0.8 * grip), (-0.045, 0.7
                   * width), (-0.02, 0.9 * width), (0.05, width)], 12)
    upper, lower = half.copy(), half[::-1] * (1.0, -1.0)
    upper[-1, 0] += slant
    lower[0, 0] -= slant
    shape = outline(np.vstack([upper, lower]))
    if draw.chance(0.4):
        shape -= rounded_rectangle(0.05, 0.008, 0.0039).translate((0.01, 0.0))
    thick = draw.about(0.006, 0.25)
    bow = draw.between(0.0, 0.02)
    lift = [(-end, 1.5 * bow), (-0.05, 0.5 * bow), (0.0, 0.0), (0.06, 0.5 * bow)]
    return resized(strip(shape, thick, lift, 0.02), draw)


def putty_knife(draw: Draw) -> Manifold:
    """Return a filling knife: a flat triangular blade on a short, thick handle."""
    width, length = draw.about(0.038, 0.3), draw.about(0.050, 0.2)
    blade = mirrored([(-length - 0.03, 0.008), (-length, 0.010), (0.5 * length, width),
                      (length, width)]).extrude(draw.about(0.0015, 0.3))
    grip = draw.about(0.013, 0.2)
    haft = bar([(-length - 0.12, 0.8 * grip, 0.6 * grip), (-length - 0.112, 1.2 * grip, grip),
                (-length - 0.06, grip, 0.85 * grip), (-length - 0.02, 1.1 * grip, 0.8 * grip),
                (-length, 0.8 * grip, 0.5 * grip)], 9, 14)
    return resized(blade + haft, draw)


def round_turner(draw: Draw) -> Manifold:
    """Return a pancake turner: a round or oval blade with holes."""
    length, width = draw.about(0.055), draw.about(0.048)
    blade = ellipse(length, width, segments=36)
    if draw.chance(0.7):
        for k in range(draw.pick(6, 5, 8)):
            angle = 2 * np.pi * k / 8
            blade -= ellipse(0.006, 0.006, segments=10, at=(
                0.5 * length * np.cos(angle), 0.5 * width * np.sin(angle)))
    return resized(_turner(blade, draw.about(0.003, 0.3), -0.95 * length, draw.about(0.06, 0.4),
                           draw.about(0.25), draw.about(0.005, 0.25), draw.about(0.011, 0.2),
                           bend=0.006), draw)


def spoonula(draw: Draw) -> Manifold:
    """Return a spoon-shaped scraper: a thick, dished paddle on a round handle."""
    length, width = draw.about(0.048, 0.2), draw.about(0.028, 0.2)
    deep, end = draw.about(0.015, 0.25), draw.about(0.21)
    ball = Manifold.sphere(1.0, 28)
    body = ball.scale((length, width, deep)).trim_by_plane((0.0, 0.0, -1.0), -0.002)
    dent = ball.scale((0.93 * length, 0.9 * width, 0.7 * deep)).translate((0.0, 0.0, 0.0005))
    fat = draw.about(0.0075, 0.25)
    handle = bar([(-end, 0.6 * fat, 0.6 * fat, 0.004), (-end + 0.006, 1.1 * fat, fat, 0.004),
                  (-0.09, 0.8 * fat, 0.8 * fat, 0.002), (-0.75 * length, fat, 0.6 * fat, -0.004)],
                 8)
    return resized(body - dent + handle, draw)


def cake_server(draw: Draw) -> Manifold:
    """Return a cake or pizza server: a pointed triangular blade on a stepped handle."""
    width, length = draw.about(0.030, 0.2), draw.about(0.070, 0.2)
    blade = mirrored(smooth([(-length, 0.8 * width), (-0.9 * length, width), (0.4 * length, 0.5
                             * width), (length, 0.06 * width)], 6))
    step, end = draw.about(0.030, 0.3), draw.about(0.20)
    sheet = blade.extrude(draw.about(0.002, 0.25))
    neck = bar([(-length - 0.05, 0.006, 0.004, step), (-length - 0.02, 0.006, 0.003, 0.8 * step),
                (-0.9 * length, 0.3 * width, 0.0018, 0.001)], 7)
    wide = draw.about(0.011, 0.2)
    haft = bar([(-end, 0.6 * wide, 0.5 * wide, step + 0.012), (-end + 0.005, wide, 0.7 * wide,
                step + 0.012), (-length - 0.035, 0.7 * wide, 0.5 * wide, step)], 6)
    return resized(sheet + neck + haft, draw)


def barbecue_turner(draw: Draw) -> Manifold:
    """Return a grill turner: a slotted blade on two long wires and a wooden grip."""
    width, length = draw.about(0.045), draw.about(0.050)
    blade = mirrored([(-length, 0.6 * width), (-0.85 * length, 0.95 * width), (length, width)])
    for x in (-0.5, 0.0, 0.5):
        blade -= rounded_rectangle(0.010, 1.1 * width, 0.004, 8).translate((x * length, 0.0))
    sheet = blade.extrude(draw.about(0.002, 0.25))
    far, rise, apart = draw.about(0.19), draw.about(0.05, 0.3), draw.about(0.010, 0.25)
    wires = [rod(curve([(-0.85 * length, s * 0.4 * width, 0.0015),
                        (-length - 0.02, s * apart, 0.008), (-far, s * apart, rise)], 8), 0.0028,
                 8) for s in (1, -1)]
    grip = draw.about(0.014, 0.2)
    haft = bar([(-far - 0.13, 0.8 * grip, 0.6 * grip, 1.5 * rise),
                (-far - 0.12, grip, 0.8 * grip, 1.47 * rise),
                (-far + 0.012, apart + 0.006, 0.6 * grip, 0.96 * rise)], 5)
    eye = cylinder(0.004, 0.3, at=(-far - 0.118, 0.0, 0.0), segments=10)
    return resized(sheet + wires[0] + wires[1] + (haft - eye), draw)


SPATULAS = (solid_turner, scraper, fish_slice, palette_knife, wooden_spatula, putty_knife,
            round_turner, spoonula, cake_server, barbecue_turner)
