# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Teacup, glass, jug, bottle and bowl: vessels made on a lathe, with handles."""

from hooc_perception.objects.catalogue.shapes import content, curve, cylinder, filled, sweep
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def _ear(points: npt.ArrayLike, half_width: npt.ArrayLike, half_height: npt.ArrayLike,
         count: int = 18) -> Manifold:
    """Return a handle whose middle line is a smooth curve through (x, z) points."""
    line = curve(points, count)
    path = np.column_stack([line[:, 0], np.zeros(count), line[:, 1]])
    return sweep(path, half_width, half_height, up=(0.0, 1.0, 0.0))


def teacup() -> Manifold:
    """Return a wide cup on a foot, with a handle."""
    side = np.vstack([[(0.024, 0.0), (0.025, 0.005)],
                      curve([(0.025, 0.005), (0.036, 0.022), (0.042, 0.045), (0.046, 0.066)], 9)])
    inside = content(side, 0.003, 0.009)
    ear = _ear([(0.040, 0.055), (0.058, 0.060), (0.070, 0.046), (0.060, 0.028), (0.034, 0.022)],
               0.0035, 0.0055)
    foot = cylinder(0.019, 0.003, at=(0.0, 0.0, -0.001))
    return filled(side) - inside - foot + (ear - inside)


def glass() -> Manifold:
    """Return a tumbler that widens towards its rim."""
    side = [(0.028, 0.0), (0.030, 0.004), (0.034, 0.050), (0.0375, 0.115)]
    return filled(side) - content(side, 0.0025, 0.010)


def jug() -> Manifold:
    """Return a bellied jug with a lip to pour from and a large handle."""
    side = np.vstack([[(0.046, 0.0)], curve([(0.050, 0.004), (0.062, 0.050), (0.060, 0.100),
                                             (0.047, 0.150), (0.050, 0.195)], 10)])
    lip = cylinder(0.010, 0.050, top=0.030).translate((-0.040, 0.0, 0.145))
    lip_inside = cylinder(0.0065, 0.060, top=0.032).translate((-0.040, 0.0, 0.147))
    inside = content(side, 0.0035, 0.006) + lip_inside
    handle = _ear([(0.046, 0.178), (0.080, 0.186), (0.108, 0.150), (0.100, 0.095), (0.056, 0.055)],
                  0.006, 0.009, 16)
    return (filled(side) + lip - inside) + (handle - inside)


def bottle() -> Manifold:
    """Return a closed bottle with shoulders, a neck and a cap."""
    side = np.vstack([[(0.033, 0.0), (0.036, 0.004), (0.036, 0.140)],
                      curve([(0.036, 0.145), (0.032, 0.172), (0.018, 0.198), (0.0135, 0.225)], 9),
                      [(0.0135, 0.232)]])
    return filled(side) + cylinder(0.0165, 0.022, at=(0.0, 0.0, 0.230))


def bowl() -> Manifold:
    """Return a round bowl on a foot ring."""
    side = np.vstack([[(0.034, 0.0), (0.035, 0.006)],
                      curve([(0.036, 0.006), (0.062, 0.022), (0.076, 0.045), (0.081, 0.068)], 9)])
    foot = cylinder(0.029, 0.005, at=(0.0, 0.0, -0.001))
    return filled(side) - content(side, 0.0035, 0.010) - foot


BUILDERS = {'teacup': teacup, 'glass': glass, 'jug': jug, 'bottle': bottle, 'bowl': bowl}
