# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The building blocks of the catalogue's solids (metres, z up)."""

from collections.abc import Callable

from hooc_perception.core.arrays import Float64Array
from manifold3d import CrossSection, FillRule, JoinType, Manifold, Mesh64
import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

SEGMENTS = 40
_Point = tuple[float, float, float]


def curve(points: npt.ArrayLike, count: int) -> Float64Array:
    """Return (count, k) points of a smooth curve through (n, k) points, even in chord length."""
    points = np.asarray(points, float)
    chord = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return CubicSpline(chord, points)(np.linspace(0.0, chord[-1], count))


def outline(points: npt.ArrayLike) -> CrossSection:
    """Return the area inside a polygon (n, 2), in either orientation."""
    return CrossSection([np.asarray(points, float)], FillRule.NonZero)


def ellipse(rx: float, ry: float, at: tuple[float, float] = (0.0, 0.0),
            segments: int = 32) -> CrossSection:
    """Return an ellipse of half axes rx, ry."""
    return CrossSection.circle(1.0, segments).scale((rx, ry)).translate(at)


def rounded_rectangle(length: float, width: float, radius: float,
                      segments: int = 16) -> CrossSection:
    """Return a centred rectangle with round corners."""
    inner = CrossSection.square((length - 2 * radius, width - 2 * radius), True)
    return inner.offset(radius, JoinType.Round, circular_segments=segments)


def box(length: float, width: float, height: float, at: _Point = (0.0, 0.0, 0.0)) -> Manifold:
    """Return a box with the centre of its bottom at `at`."""
    return Manifold.cube((length, width, height), True).translate(
        np.add(at, (0.0, 0.0, height / 2)))


def rounded_box(length: float, width: float, height: float, radius: float,
                at: _Point = (0.0, 0.0, 0.0)) -> Manifold:
    """Return such a box whose upright edges are round."""
    return rounded_rectangle(length, width, radius).extrude(height).translate(at)


def cylinder(radius: float, length: float, at: _Point = (0.0, 0.0, 0.0), axis: str = 'z',
             top: float | None = None, segments: int = SEGMENTS) -> Manifold:
    """Return a cylinder, or a cone towards radius `top`, from `at` along a positive axis."""
    solid = Manifold.cylinder(length, radius, radius if top is None else top, segments)
    turn = {'x': (0.0, 90.0, 0.0), 'y': (-90.0, 0.0, 0.0), 'z': (0.0, 0.0, 0.0)}[axis]
    return solid.rotate(turn).translate(at)


def lathe(profile: npt.ArrayLike, segments: int = SEGMENTS) -> Manifold:
    """Return the solid of a closed profile (n, 2) of (radius, height) revolved about z."""
    return outline(profile).revolve(segments)


def filled(side: npt.ArrayLike, segments: int = SEGMENTS) -> Manifold:
    """Return the full solid under a side line (n, 2) of (radius, height), bottom to top."""
    side = np.asarray(side, float)
    return lathe(np.vstack([(0.0, side[0, 1]), side, (0.0, side[-1, 1])]), segments)


def content(side: npt.ArrayLike, wall: float, floor: float,
            segments: int = SEGMENTS) -> Manifold:
    """Return the inner volume of a vessel of that side line, wall and floor, open at the top."""
    side = np.asarray(side, float)
    inner = np.column_stack([np.maximum(side[:, 0] - wall, 1e-4), side[:, 1]])
    low = side[0, 1] + floor
    foot = np.interp(low, inner[:, 1], inner[:, 0])
    inner = np.vstack([(foot, low), inner[inner[:, 1] > low + 1e-6]])
    return filled(np.vstack([inner, inner[-1] + (0.0, 0.01)]), segments)


def sweep(path: npt.ArrayLike, half_width: npt.ArrayLike, half_height: npt.ArrayLike,
          sides: int = 10, up: _Point = (0.0, 0.0, 1.0)) -> Manifold:
    """
    Return a rod of elliptic section along a path.

    :param path: (n, 3) points.
    :param half_width: scalar or (n,) half axis across the path and across `up`.
    :param half_height: scalar or (n,) half axis across the path, nearest to `up`.
    :param up: a direction that the path never has.
    """
    path = np.asarray(path, float)
    n = len(path)
    tangent = np.gradient(path, axis=0)
    across = np.cross(up, tangent)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    above = np.cross(tangent, across)
    above /= np.linalg.norm(above, axis=1, keepdims=True)
    angle = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    width, height = (np.broadcast_to(a, n)[:, None, None] for a in (half_width, half_height))
    rings = (path[:, None] + across[:, None] * width * np.cos(angle)[None, :, None]
             + above[:, None] * height * np.sin(angle)[None, :, None])
    vertices = np.vstack([rings.reshape(-1, 3), path[:1], path[-1:]])
    i, j = np.meshgrid(np.arange(n - 1), np.arange(sides), indexing='ij')
    a, b = (i * sides + j).ravel(), (i * sides + (j + 1) % sides).ravel()
    faces = [np.column_stack([a, b, b + sides]), np.column_stack([a, b + sides, a + sides])]
    k, k1 = np.arange(sides), (np.arange(sides) + 1) % sides
    last = (n - 1) * sides
    faces += [np.column_stack([k1, k, np.full(sides, n * sides)]),
              np.column_stack([last + k, last + k1, np.full(sides, n * sides + 1)])]
    solid = Manifold(Mesh64(vertices, np.vstack(faces).astype(np.uint64)))
    return solid if solid.volume() > 0 else Manifold(
        Mesh64(vertices, np.vstack(faces)[:, ::-1].astype(np.uint64).copy()))


def bent(solid: Manifold, height_at: Callable[[Float64Array], Float64Array],
         edge: float) -> Manifold:
    """Return a solid whose points are lifted by height_at(x), edges first split to `edge`."""
    def lift(points: npt.ArrayLike) -> Float64Array:
        points = np.array(points)
        points[:, 2] += height_at(points[:, 0])
        return points
    return solid.refine_to_length(edge).warp_batch(lift)


def union(*solids: Manifold) -> Manifold:
    """Return the union of solids."""
    total = solids[0]
    for solid in solids[1:]:
        total += solid
    return total
