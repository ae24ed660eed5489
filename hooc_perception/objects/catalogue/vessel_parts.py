# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Building blocks of vessels of round or other outline, with handles, rods and spouts."""

from hooc_perception.core.arrays import Float64Array
from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import (
    content,
    curve,
    cylinder,
    filled,
    rounded_rectangle,
    sweep,
)
from manifold3d import Manifold, Mesh64
import numpy as np
import numpy.typing as npt

ROUND = 32


def superellipse(aspect: float = 1.0, power: float = 2.0, count: int = ROUND) -> Float64Array:
    """Return the outline of half axes 1 and `aspect`; power 2 = ellipse, 8 = nearly a square."""
    angle = 2 * np.pi * (np.arange(count) + 0.5) / count
    x, y = np.cos(angle), np.sin(angle)
    return np.column_stack([np.sign(x) * np.abs(x) ** (2 / power),
                            aspect * np.sign(y) * np.abs(y) ** (2 / power)])


def fluted(waves: int, depth: float, per_wave: int = 4) -> Float64Array:
    """Return a circle of mean radius 1 with waves of a relative depth."""
    angle = 2 * np.pi * np.arange(waves * per_wave) / (waves * per_wave)
    radius = 1.0 + 0.5 * depth * np.cos(waves * angle)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def polygon(sides: int) -> Float64Array:
    """Return a regular polygon of circumradius 1, a flat side facing x."""
    angle = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    return np.column_stack([np.cos(angle), np.sin(angle)])


def loft(side: npt.ArrayLike, shape: npt.ArrayLike) -> Manifold:
    """Return the full solid of a side line (n, 2) whose levels have an outline of unit radius."""
    side, shape = np.asarray(side, float), np.asarray(shape, float)
    n, m = len(side), len(shape)
    rings = np.concatenate([side[:, :1, None] * shape[None], np.broadcast_to(
        side[:, 1:, None], (n, m, 1))], axis=2)
    ends = np.column_stack([np.zeros((2, 2)), side[[0, -1], 1]])
    vertices = np.vstack([rings.reshape(-1, 3), ends])
    k, k1 = np.arange(m), (np.arange(m) + 1) % m
    faces = [np.column_stack([k1, k, np.full(m, n * m)]),
             np.column_stack([k, k1, np.full(m, n * m + 1)]) + [[(n - 1) * m, (n - 1) * m, 0]]]
    for i in range(0, (n - 1) * m, m):
        faces += [np.column_stack([i + k, i + k1, i + m + k1]),
                  np.column_stack([i + k, i + m + k1, i + m + k])]
    return Manifold(Mesh64(vertices, np.vstack(faces).astype(np.uint64)))


def body(side: npt.ArrayLike, shape: npt.ArrayLike | None = None,
         segments: int = ROUND) -> Manifold:
    """Return the full solid of a side line: round, or of the given outline."""
    return filled(side, segments) if shape is None else loft(side, shape)


def cavity(side: npt.ArrayLike, wall: float, floor: float,
           shape: npt.ArrayLike | None = None, segments: int = ROUND) -> Manifold:
    """Return the inner volume of such a vessel, open at the top."""
    if shape is None:
        return content(side, wall, floor, segments)
    side = np.asarray(side, float)
    inner = np.column_stack([np.maximum(side[:, 0] - wall, 1e-3), side[:, 1]])
    low = side[0, 1] + floor
    inner = np.vstack([(np.interp(low, inner[:, 1], inner[:, 0]), low),
                       inner[inner[:, 1] > low + 1e-6]])
    return loft(np.vstack([inner, inner[-1] + (0.0, 0.01)]), shape)


def level(draw: Draw, floor: float, height: float) -> float:
    """Return the height of the inner floor: in a tenth of all members the vessel is full."""
    return height * draw.between(0.75, 0.97) if draw.chance(0.1) else floor


def vessel(side: npt.ArrayLike, wall: float, floor: float,
           shape: npt.ArrayLike | None = None) -> Manifold:
    """Return a vessel of a side line, wall and floor, open at the top."""
    return body(side, shape) - cavity(side, wall, floor, shape)


def handled(side: npt.ArrayLike, inside: Manifold, *handles: Manifold,
            shape: npt.ArrayLike | None = None) -> Manifold:
    """Return a vessel with handles that end in its wall."""
    solid = body(side, shape) - inside
    for handle in handles:
        solid += handle - inside
    return solid


def radius_at(side: npt.ArrayLike, height: float) -> float:
    """Return the outer radius of a side line at a height."""
    side = np.asarray(side, float)
    return float(np.interp(height, side[:, 1], side[:, 0]))


def ear(points: npt.ArrayLike, half_width: npt.ArrayLike, half_height: npt.ArrayLike,
        count: int = 18, sides: int = 10) -> Manifold:
    """Return a handle whose middle line is a smooth curve through (x, z) points."""
    line = curve(points, count)
    path = np.column_stack([line[:, 0], np.zeros(count), line[:, 1]])
    return sweep(path, half_width, half_height, sides, up=(0.0, 1.0, 0.0))


def loop(side: npt.ArrayLike, top: float, low: float, reach: float, thick: float, broad: float,
         form: str = 'ear', sink: float = 0.003) -> Manifold:
    """
    Return a handle at +x between two heights of a vessel's side line.

    :param reach: of its outer edge from the wall.
    :param thick: half thickness in the plane of the handle.
    :param broad: half width across that plane.
    :param form: 'ear' (large above), 'round', 'square' (with corners) or 'drop' (large below).
    :param sink: depth of its ends in the wall.
    """
    a, b = radius_at(side, top), radius_at(side, low)
    rise, middle = top - low, radius_at(side, 0.5 * (top + low))
    out = max(a, b, middle) + reach - thick
    first, last = (a - sink, top), (b - sink, low)
    if form == 'square':
        line = np.array([first, (out - 0.2 * reach, top), (out, top - 0.15 * rise),
                         (out, low + 0.15 * rise), (out - 0.2 * reach, low), last])
        along = np.append(0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
        at = np.linspace(0, along[-1], 16)
        return ear(np.column_stack([np.interp(at, along, line[:, 0]),
                                    np.interp(at, along, line[:, 1])]), thick, broad, 16, 8)
    between = {
        'ear': [(a + 0.55 * (out - a), top + 0.08 * rise), (out, top - 0.3 * rise),
                (b + 0.7 * (out - b), low + 0.15 * rise)],
        'round': [(a + 0.65 * (out - a), top - 0.02 * rise), (out, 0.5 * (top + low)),
                  (b + 0.65 * (out - b), low + 0.02 * rise)],
        'drop': [(a + 0.7 * (out - a), top - 0.1 * rise), (out, low + 0.35 * rise),
                 (b + 0.55 * (out - b), low - 0.05 * rise)]}[form]
    return ear([first, *between, last], thick, broad, 14, 8)


def rod(points: npt.ArrayLike, half_width: npt.ArrayLike, half_height: npt.ArrayLike,
        count: int = 12, sides: int = 10) -> Manifold:
    """
    Return a stick along a smooth curve through (x, z) points.

    :param half_width: scalar, or values evenly spaced along the stick.
    :param half_height: likewise.
    """
    line = curve(points, count)
    path = np.column_stack([line[:, 0], np.zeros(count), line[:, 1]])
    at = np.linspace(0, 1, count)
    width, height = (np.interp(at, np.linspace(0, 1, np.size(a)), np.ravel(a))
                     for a in (half_width, half_height))
    return sweep(path, width, height, sides)


def bow(half: float, reach: float, thick: float, broad: float, sink: float = 0.004) -> Manifold:
    """Return a flat grip that stands out towards x from two ends at y = +- half, x = -sink."""
    arch = ear([(-sink, half), (0.75 * reach, 0.85 * half), (reach, 0.0),
                (0.75 * reach, -0.85 * half), (-sink, -half)], thick, broad, 12, 8)
    return arch.rotate((90.0, 0.0, 0.0))


def basin(length: float, width: float, height: float, radius: float, flare: float) -> Manifold:
    """Return a round-cornered block that is wider by 2 x flare at its top than at its foot."""
    radius = min(radius, 0.5 * (min(length, width) - 2 * flare) - 0.001)
    low = rounded_rectangle(length - 2 * flare, width - 2 * flare, radius).extrude(0.001)
    high = rounded_rectangle(length, width, radius).extrude(0.001)
    return (low + high.translate((0.0, 0.0, height - 0.001))).hull()


def lip(side: npt.ArrayLike, size: float, wall: float) -> tuple[Manifold, Manifold]:
    """Return the outside and the inside of a lip to pour from, at -x of a vessel's rim."""
    radius, height = np.asarray(side, float)[-1]
    at = (-(radius - 0.35 * size), 0.0, height - 1.5 * size)
    outer = cylinder(0.3 * size, 1.5 * size, top=0.9 * size, segments=20).translate(at)
    slope = 0.6 / 1.5
    inner = cylinder(0.3 * size - wall, 1.5 * size + 0.01,
                     top=0.9 * size - wall + slope * 0.01, segments=20)
    return outer, inner.translate((at[0], 0.0, at[2] + wall))
