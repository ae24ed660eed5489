# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fork, knife, spoon and spatula: flat outlines, bent."""

from hooc_perception.core.arrays import Float64Array
from hooc_perception.objects.catalogue.shapes import (
    bent,
    curve,
    ellipse,
    outline,
    rounded_rectangle,
    sweep,
)
from manifold3d import CrossSection, Manifold
import numpy as np
import numpy.typing as npt


def _mirrored(half: npt.ArrayLike) -> CrossSection:
    """Return the outline of a shape from its upper half line (n, 2) of (x, half width)."""
    half = np.asarray(half, float)
    return outline(np.vstack([half, half[::-1] * (1.0, -1.0)]))


def fork() -> Manifold:
    """Return a table fork, its four tines curved upwards."""
    half = np.vstack([curve([(-0.100, 0.006), (-0.090, 0.0095), (-0.050, 0.006), (0.010, 0.004),
                             (0.030, 0.006), (0.045, 0.0125)], 22), [(0.096, 0.0125)]])
    shape = _mirrored(half)
    for y in (-0.0066, 0.0, 0.0066):
        shape -= rounded_rectangle(0.052, 0.0032, 0.0015).translate((0.076, y))

    def height(x: Float64Array) -> Float64Array:
        return np.interp(x, [-0.10, -0.05, 0.02, 0.045, 0.07, 0.10],
                         [0.008, 0.014, 0.012, 0.003, 0.0, 0.008])
    return bent(shape.extrude(0.0025), height, 0.011)


def knife() -> Manifold:
    """Return a table knife with a thick handle."""
    blade = outline(np.vstack([
        [(-0.01, -0.0085), (0.075, -0.0095)],
        curve([(0.090, -0.0085), (0.106, -0.001), (0.112, 0.0075)], 7),
        [(0.105, 0.0085), (-0.01, 0.0075)]])).extrude(0.0018)
    handle = sweep(np.column_stack([np.linspace(-0.112, 0.0, 10), np.zeros((10, 2))]),
                   [0.006, 0.0095, 0.0105, 0.0105, 0.010, 0.0095, 0.009, 0.0085, 0.008, 0.007],
                   [0.003, 0.0052, 0.006, 0.006, 0.006, 0.006, 0.0055, 0.005, 0.0045, 0.003], 12)
    return blade.translate((0.0, 0.0, -0.0009)) + handle


def spoon() -> Manifold:
    """Return a table spoon."""
    ball = Manifold.sphere(1.0, 36)
    shell = ball.scale((0.034, 0.0215, 0.013)) - ball.scale((0.0325, 0.020, 0.0112))
    shell = shell.trim_by_plane((0.0, 0.0, -1.0), 0.001)
    half = curve([(-0.140, 0.004), (-0.132, 0.0085), (-0.100, 0.0065), (-0.055, 0.004),
                  (-0.030, 0.006)], 18)

    def height(x: Float64Array) -> Float64Array:
        return np.interp(x, [-0.14, -0.10, -0.06, -0.03], [-0.004, 0.006, 0.005, -0.0035])
    handle = bent(_mirrored(half).extrude(0.0025), height, 0.012)
    return shell + (handle - ball.scale((0.0325, 0.020, 0.0112)))


def spatula() -> Manifold:
    """Return a kitchen turner: a slotted blade at an angle on a long handle."""
    blade = _mirrored([(-0.045, 0.020), (-0.035, 0.030), (0.045, 0.040)])
    for y in (-0.018, -0.006, 0.006, 0.018):
        slot = rounded_rectangle(0.056, 0.0055, 0.0026).rotate(8.0 * y / 0.018)
        blade -= slot.translate((0.004, y * 1.05))
    blade = bent(blade.extrude(0.0025), lambda x: 0.15 * np.maximum(-x - 0.02, 0.0), 0.02)
    line = curve([(-0.036, 0.004), (-0.060, 0.018), (-0.100, 0.032), (-0.180, 0.046),
                  (-0.255, 0.054)], 18)
    path = np.column_stack([line[:, 0], np.zeros(18), line[:, 1]])
    along = np.linspace(0, 1, 18)
    neck = sweep(path, np.interp(along, [0, 0.1, 0.45, 0.5, 0.9, 1],
                                 [0.009, 0.005, 0.005, 0.010, 0.012, 0.007]),
                 np.interp(along, [0, 0.1, 0.45, 0.5, 0.9, 1],
                           [0.002, 0.003, 0.003, 0.007, 0.008, 0.005]), 10)
    eye = ellipse(0.007, 0.004, at=(-0.242, 0.0), segments=16).extrude(0.1)
    return blade + (neck - eye)


BUILDERS = {'fork': fork, 'knife': knife, 'spoon': spoon, 'spatula': spatula}
