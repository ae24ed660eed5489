# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The few ways of making a solid from which the catalogue is put together (metres, z up)."""

from manifold3d import CrossSection, FillRule, JoinType, Manifold, Mesh64
import numpy as np
from scipy.interpolate import CubicSpline

SEGMENTS = 40


def curve(points, count):
    """Return (count, k) points of a smooth curve through (n, k) points, even in chord length."""
    points = np.asarray(points, float)
    chord = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return CubicSpline(chord, points)(np.linspace(0.0, chord[-1], count))


def outline(points):
    """Return the area inside a polygon (n, 2), whichever way round it runs."""
    return CrossSection([np.asarray(points, float)], FillRule.NonZero)


def ellipse(rx, ry, at=(0.0, 0.0), segments=32):
    """Return an ellipse of half axes rx, ry."""
    return CrossSection.circle(1.0, segments).scale((rx, ry)).translate(at)


def rounded_rectangle(length, width, radius, segments=16):
    """Return a centred rectangle with round corners."""
    inner = CrossSection.square((length - 2 * radius, width - 2 * radius), True)
    return inner.offset(radius, JoinType.Round, circular_segments=segments)


def box(length, width, height, at=(0.0, 0.0, 0.0)):
    """Return a box that stands with the centre of its bottom on `at`."""
    return Manifold.cube((length, width, height), True).translate(
        np.add(at, (0.0, 0.0, height / 2)))


def rounded_box(length, width, height, radius, at=(0.0, 0.0, 0.0)):
    """Return such a box whose upright edges are round."""
    return rounded_rectangle(length, width, radius).extrude(height).translate(at)


def cylinder(radius, length, at=(0.0, 0.0, 0.0), axis='z', top=None, segments=SEGMENTS):
    """Return a cylinder, or a cone towards radius `top`, from `at` along a positive axis."""
    solid = Manifold.cylinder(length, radius, radius if top is None else top, segments)
    turn = {'x': (0.0, 90.0, 0.0), 'y': (-90.0, 0.0, 0.0), 'z': (0.0, 0.0, 0.0)}[axis]
    return solid.rotate(turn).translate(at)


def lathe(profile, segments=SEGMENTS):
    """Return the solid of a closed profile (n, 2) of (radius, height) turned about z."""
    return outline(profile).revolve(segments)


def filled(side, segments=SEGMENTS):
    """Return the full solid under a side line (n, 2) of (radius, height), bottom to top."""
    side = np.asarray(side, float)
    return lathe(np.vstack([(0.0, side[0, 1]), side, (0.0, side[-1, 1])]), segments)


def content(side, wall, floor, segments=SEGMENTS):
    """Return what fits into a vessel of that side line, wall and floor, and the air above it."""
    side = np.asarray(side, float)
    inner = np.column_stack([np.maximum(side[:, 0] - wall, 1e-4), side[:, 1]])
    low = side[0, 1] + floor
    foot = np.interp(low, inner[:, 1], inner[:, 0])
    inner = np.vstack([(foot, low), inner[inner[:, 1] > low + 1e-6]])
    return filled(np.vstack([inner, inner[-1] + (0.0, 0.01)]), segments)


def sweep(path, half_width, half_height, sides=10, up=(0.0, 0.0, 1.0)):
    """
    Return a rod of elliptic section along a path.

    :param path: (n, 3) points.
    :param half_width: scalar or (n,) half axis across the path and across `up`.
    :param half_height: scalar or (n,) half axis across the path, nearest to `up`.
    :param up: direction that the path never takes.
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


def bent(solid, height_at, edge):
    """Return a solid whose points are lifted by height_at(x), its edges cut to `edge` first."""
    def lift(points):
        points = np.array(points)
        points[:, 2] += height_at(points[:, 0])
        return points
    return solid.refine_to_length(edge).warp_batch(lift)


def union(*solids):
    """Return the union of solids."""
    total = solids[0]
    for solid in solids[1:]:
        total += solid
    return total
