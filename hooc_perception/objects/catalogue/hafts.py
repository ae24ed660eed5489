# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Building blocks that the implements and packages share: bars, strips and random sizes."""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float64Array
from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import bent, outline, sweep
from manifold3d import CrossSection, Manifold
import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

_Point = tuple[float, float, float]


def resized(solid: Manifold, draw: Draw, spread: float = 0.07) -> Manifold:
    """
    Return a solid in a random size, with its axes stretched independently.

    Only its largest part is kept, without closed voids, so that it is one solid for sure.
    """
    size = draw.about(1.0, spread)
    scale = (size * draw.about(1.0, spread), size * draw.about(1.0, spread),
             size * draw.about(1.0, spread))
    solid = solid.scale(scale)
    if scale == (1.0, 1.0, 1.0):
        # The nominal shapes are whole; looking at their parts would change the last bits.
        return solid
    return max(solid.simplify(1e-5).decompose(), key=Manifold.volume)


def smooth(points: npt.ArrayLike, count: int) -> Float64Array:
    """Return points (n, k), x rising, resampled by `count` more without any overshoot."""
    points = np.asarray(points, float)
    x = np.linspace(points[0, 0], points[-1, 0], count)
    x = np.unique(np.round(np.concatenate([x, points[:, 0]]), 5))
    x = np.clip(x[np.append(True, np.diff(x) > 1e-4)], points[0, 0], points[-1, 0])
    return np.asarray(np.column_stack([x, PchipInterpolator(points[:, 0], points[:, 1:])(x)]),
                      np.float64)


def bar(points: Sequence[Sequence[float]], count: int = 12, sides: int = 12) -> Manifold:
    """
    Return a rod of elliptic section along x.

    :param points: rows of (x, half width, half height[, z[, y]]), x rising.
    """
    rows = smooth([(*row, 0.0, 0.0)[:5] for row in points], count)
    return sweep(rows[:, [0, 4, 3]], rows[:, 1], rows[:, 2], sides)


def brick(points: Sequence[Sequence[float]], count: int = 8) -> Manifold:
    """Return such a rod of rectangular section."""
    return bar([(row[0], row[1] * 2 ** 0.5, row[2] * 2 ** 0.5, *row[3:]) for row in points],
               count, 4)


def mirrored(half: npt.ArrayLike) -> CrossSection:
    """Return the outline of a shape from its upper half line (n, 2) of (x, half width)."""
    half = np.asarray(half, float)
    return outline(np.vstack([half, half[::-1] * (1.0, -1.0)]))


def strip(shape: CrossSection, thickness: float, lift: npt.ArrayLike,
          edge: float = 0.012) -> Manifold:
    """Return a flat sheet bent upwards along x; `lift` has rows (x, z), x rising."""
    lift = np.asarray(lift, float)
    rise = PchipInterpolator(lift[:, 0], lift[:, 1])
    return bent(shape.extrude(thickness),
                lambda x: rise(np.clip(x, lift[0, 0], lift[-1, 0])), edge)


def rod(points: npt.ArrayLike, radius: npt.ArrayLike, sides: int = 10,
        up: _Point = (0.0, 0.0, 1.0)) -> Manifold:
    """Return a rod of round section along given points (n, 3)."""
    return sweep(points, radius, radius, sides, up)


def slab(profile: CrossSection, width: float, y: float = 0.0) -> Manifold:
    """Return a profile in (x, z) extruded to a width along y about `y`."""
    return profile.extrude(width).rotate((90.0, 0.0, 0.0)).translate((0.0, y + width / 2, 0.0))
