# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fork, knife, spoon and spatula: flat outlines, bent."""

from collections.abc import Callable

from hooc_perception.core.arrays import Float64Array
from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.forks import FORKS
from hooc_perception.objects.catalogue.hafts import mirrored, resized
from hooc_perception.objects.catalogue.knives import KNIVES
from hooc_perception.objects.catalogue.shapes import (
    bent,
    curve,
    ellipse,
    outline,
    rounded_rectangle,
    sweep,
)
from hooc_perception.objects.catalogue.spatulas import SPATULAS
from hooc_perception.objects.catalogue.spoons import SPOONS
from manifold3d import Manifold
import numpy as np


def fork(draw: Draw) -> Manifold:
    """Return a table fork, its four tines curved upwards."""
    half = np.vstack([curve([(-0.100, 0.006), (-0.090, 0.0095), (-0.050, 0.006), (0.010, 0.004),
                             (0.030, 0.006), (0.045, 0.0125)], 22), [(0.096, 0.0125)]])
    shape = mirrored(half)
    for y in (-0.0066, 0.0, 0.0066):
        shape -= rounded_rectangle(0.052, 0.0032, 0.0015).translate((0.076, y))

    def height(x: Float64Array) -> Float64Array:
        return np.interp(x, [-0.10, -0.05, 0.02, 0.045, 0.07, 0.10],
                         [0.008, 0.014, 0.012, 0.003, 0.0, 0.008])
    return resized(bent(shape.extrude(draw.about(0.0025, 0.3)), height, 0.011), draw)


def knife(draw: Draw) -> Manifold:
    """Return a table knife with a thick handle."""
    blade = outline(np.vstack([
        [(-0.01, -0.0085), (0.075, -0.0095)],
        curve([(0.090, -0.0085), (0.106, -0.001), (0.112, 0.0075)], 7),
        [(0.105, 0.0085), (-0.01, 0.0075)]])).extrude(0.0018)
    girth = draw.about(1.0, 0.25)
    handle = sweep(np.column_stack([np.linspace(-0.112, 0.0, 10), np.zeros((10, 2))]),
                   [0.006, 0.0095, 0.0105, 0.0105, 0.010, 0.0095, 0.009, 0.0085, 0.008, 0.007],
                   [0.003, 0.0052, 0.006, 0.006, 0.006, 0.006, 0.0055, 0.005, 0.0045, 0.003], 12)
    handle = handle.scale((1.0, girth, girth))
    return resized(blade.translate((0.0, 0.0, -0.0009)) + handle, draw)


def spoon(draw: Draw) -> Manifold:
    """Return a table spoon."""
    ball = Manifold.sphere(1.0, 36)
    shell = ball.scale((0.034, 0.0215, 0.013)) - ball.scale((0.0325, 0.020, 0.0112))
    shell = shell.trim_by_plane((0.0, 0.0, -1.0), 0.001)
    half = curve([(-0.140, 0.004), (-0.132, 0.0085), (-0.100, 0.0065), (-0.055, 0.004),
                  (-0.030, 0.006)], 18)

    def height(x: Float64Array) -> Float64Array:
        return np.interp(x, [-0.14, -0.10, -0.06, -0.03], [-0.004, 0.006, 0.005, -0.0035])
    handle = bent(mirrored(half).extrude(draw.about(0.0025, 0.25)), height, 0.012)
    return resized(shell + (handle - ball.scale((0.0325, 0.020, 0.0112))), draw)


def spatula(draw: Draw) -> Manifold:
    """Return a kitchen turner: a slotted blade at an angle on a long handle."""
    blade = mirrored([(-0.045, 0.020), (-0.035, 0.030), (0.045, 0.040)])
    for y in (-0.018, -0.006, 0.006, 0.018):
        slot = rounded_rectangle(0.056, 0.0055, 0.0026).rotate(8.0 * y / 0.018)
        blade -= slot.translate((0.004, y * 1.05))
    blade = bent(blade.extrude(0.0025), lambda x: 0.15 * np.maximum(-x - 0.02, 0.0), 0.02)
    line = curve([(-0.036, 0.004), (-0.060, 0.018), (-0.100, 0.032), (-0.180, 0.046),
                  (-0.255, 0.054)], 18)
    path = np.column_stack([line[:, 0], np.zeros(18), line[:, 1]])
    along = np.linspace(0, 1, 18)
    girth = draw.about(1.0, 0.25)
    neck = sweep(path, girth * np.interp(along, [0, 0.1, 0.45, 0.5, 0.9, 1],
                                 [0.009, 0.005, 0.005, 0.010, 0.012, 0.007]),
                 girth * np.interp(along, [0, 0.1, 0.45, 0.5, 0.9, 1],
                                   [0.002, 0.003, 0.003, 0.007, 0.008, 0.005]), 10)
    eye = ellipse(0.007, 0.004, at=(-0.242, 0.0), segments=16).extrude(0.1)
    return resized(blade + (neck - eye), draw)


STYLES: dict[str, tuple[Callable[[Draw], Manifold], ...]] = {
    'fork': (fork, *FORKS), 'knife': (knife, *KNIVES), 'spoon': (spoon, *SPOONS),
    'spatula': (spatula, *SPATULAS)}
