# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Balls: smooth, with seams, panels, dimples, knobs, holes and ribs, oval and squashed ones."""

from collections.abc import Callable

from hooc_perception.core.arrays import Float64Array
from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.shapes import cylinder
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt

GOLDEN = (1.0 + np.sqrt(5.0)) / 2.0


def ball(draw: Draw) -> Manifold:
    """Return a smooth ball."""
    return Manifold.sphere(0.036 * draw.about(1.0, 0.25), 48)


def _relief(radius: float, height_at: Callable[[Float64Array], Float64Array],
            segments: int = 48) -> Manifold:
    """Return a ball with its points lifted by height_at(directions (n, 3)) of its radius."""
    def lift(points: npt.ArrayLike) -> Float64Array:
        points = np.array(points)
        unit = points / np.linalg.norm(points, axis=1, keepdims=True)
        return radius * unit * (1.0 + height_at(unit))[:, None]
    return Manifold.sphere(1.0, segments).warp_batch(lift)


def _even(count: int) -> Float64Array:
    """Return (count, 3) directions spread evenly over the sphere."""
    z = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    angle = 2 * np.pi * np.arange(count) / GOLDEN
    level = np.sqrt(1.0 - z ** 2)
    return np.column_stack([level * np.cos(angle), level * np.sin(angle), z])


def _nearest(unit: Float64Array, marks: Float64Array) -> Float64Array:
    """Return (n, 2): the angles from directions to their nearest and second nearest mark."""
    angle = np.arccos(np.clip(unit @ marks.T, -1.0, 1.0))
    nearest: Float64Array = np.sort(angle, axis=1)[:, :2]
    return nearest


def seamed_ball(draw: Draw) -> Manifold:
    """Return a tennis ball or a baseball: one closed seam, sunk or raised."""
    t = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    seam = np.column_stack([0.75 * np.cos(t) + 0.25 * np.cos(3 * t),
                            0.75 * np.sin(t) - 0.25 * np.sin(3 * t),
                            np.sqrt(0.75) * np.sin(2 * t)])
    height, width = draw.pick(-1, 1) * draw.about(0.03, 0.3), draw.about(0.09, 0.2)

    def height_at(unit: Float64Array) -> Float64Array:
        return np.asarray(height * np.exp(-(_nearest(unit, seam)[:, 0] / width) ** 2))
    return _relief(draw.about(0.035), height_at)


def panelled_ball(draw: Draw) -> Manifold:
    """Return a football: panels with grooves between them."""
    a, b = 1.0, GOLDEN
    corners = [(0, s * a, t * b) for s in (-1, 1) for t in (-1, 1)]
    icosahedron = np.array([np.roll(c, k) for c in corners for k in range(3)], float)
    a, b = 1.0 / GOLDEN, GOLDEN
    edges = [(0, s * a, t * b) for s in (-1, 1) for t in (-1, 1)]
    cube = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    dodecahedron = np.array([np.roll(e, -k) for e in edges for k in range(3)] + cube, float)
    marks = np.vstack([icosahedron, dodecahedron]) if draw.chance(0.6) else icosahedron
    marks = marks / np.linalg.norm(marks, axis=1, keepdims=True)
    depth = draw.about(0.035, 0.3)

    def height_at(unit: Float64Array) -> Float64Array:
        near = _nearest(unit, marks)
        return np.asarray(-depth * np.exp(-((near[:, 1] - near[:, 0]) / 0.13) ** 2))
    return _relief(draw.about(0.055, 0.2), height_at)


def channelled_ball(draw: Draw) -> Manifold:
    """Return a basketball or a beach ball: grooves along great circles."""
    depth, width = draw.about(0.03, 0.3), draw.about(0.07, 0.2)
    count = draw.pick(2, 3, 4)
    angle = np.pi * np.arange(count) / count
    normals = np.vstack([np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), (0, 0, 1)])
    normals = normals if draw.chance(0.6) else normals[:-1]

    def height_at(unit: Float64Array) -> Float64Array:
        off = np.abs(unit @ normals.T).min(axis=1)
        return np.asarray(-depth * np.exp(-(off / width) ** 2))
    return _relief(draw.about(0.054, 0.2), height_at)


def dimpled_ball(draw: Draw) -> Manifold:
    """Return a golf ball, roughly, or another small ball with dimples."""
    marks = _even(draw.pick(40, 26, 60))
    depth, width = draw.about(0.04, 0.3), 1.3 / np.sqrt(len(marks))

    def height_at(unit: Float64Array) -> Float64Array:
        return np.asarray(-depth * np.exp(-(_nearest(unit, marks)[:, 0] / width) ** 2))
    return _relief(draw.about(0.025, 0.2), height_at)


def knobbly_ball(draw: Draw) -> Manifold:
    """Return a ball with knobs or blunt spikes: for massage, dogs or the dryer."""
    marks = _even(draw.pick(32, 22, 14))
    height, width = draw.about(0.16, 0.4), 0.95 / np.sqrt(len(marks))

    def height_at(unit: Float64Array) -> Float64Array:
        return np.asarray(height * np.exp(-(_nearest(unit, marks)[:, 0] / width) ** 2))
    return _relief(draw.about(0.036, 0.2), height_at)


def oval_ball(draw: Draw) -> Manifold:
    """Return an egg-shaped or a rugby ball that lies along x."""
    r, long, point = draw.about(0.034, 0.2), draw.between(1.08, 1.6), draw.between(-0.1, 0.2)

    def stretch(points: npt.ArrayLike) -> Float64Array:
        points = np.array(points)
        x = points[:, 0].copy()
        points[:, 1:] *= (1.0 - point * x)[:, None]
        return r * points * (long, 1.0, 1.0)
    return Manifold.sphere(1.0, 40).warp_batch(stretch)


def faceted_ball(draw: Draw) -> Manifold:
    """Return a ball with few flat faces, as of a coarse model or a many-sided die."""
    return Manifold.sphere(draw.about(0.031, 0.25), draw.pick(12, 8, 16))


def squashed_ball(draw: Draw) -> Manifold:
    """Return a soft ball that has sagged under its weight, its bottom flat."""
    r, low, flat = draw.about(0.042, 0.25), draw.between(0.75, 0.95), draw.between(0.75, 0.95)
    solid = Manifold.sphere(r, 44).scale((1.0, 1.0 * draw.between(0.92, 1.08), low))
    return solid.trim_by_plane((0.0, 0.0, 1.0), -flat * low * r)


def holed_ball(draw: Draw) -> Manifold:
    """Return a ball with holes: of a bowling alley, or perforated."""
    r, depth = draw.about(0.038, 0.2), draw.between(0.25, 0.6)
    hole = r * draw.between(0.11, 0.2)
    marks = _even(draw.pick(12, 8, 3, 18))
    if len(marks) == 3:
        marks = np.array([(0.25, 0.15, 1.0), (-0.25, 0.15, 1.0), (0.0, -0.35, 1.0)])
    solid = Manifold.sphere(r, 28)
    for x, y, z in marks / np.linalg.norm(marks, axis=1, keepdims=True):
        drill = cylinder(hole, r, at=(0.0, 0.0, (1.0 - depth) * r), segments=12)
        tilt, turn = np.degrees(np.arccos(z)), np.degrees(np.arctan2(y, x))
        solid -= drill.rotate((0.0, tilt, 0.0)).rotate((0.0, 0.0, turn))
    return solid


def ribbed_ball(draw: Draw) -> Manifold:
    """Return a ball with ribs from pole to pole, as a wound or a sewn toy, or a pumpkin."""
    count, depth = draw.pick(8, 6, 10), draw.about(0.08, 0.35)
    low = draw.between(0.85, 1.0)

    def height_at(unit: Float64Array) -> Float64Array:
        angle = np.arctan2(unit[:, 1], unit[:, 0])
        level = np.sqrt(1.0 - np.minimum(unit[:, 2] ** 2, 1.0))
        return np.asarray(depth * level * (np.abs(np.cos(0.5 * count * angle)) - 1.0))
    return _relief(draw.about(0.040, 0.2), height_at).scale((1.0, 1.0, low))


def knotted_ball(draw: Draw) -> Manifold:
    """Return a ball with a cap, a valve or a knot: a bauble, a dog's toy, a bell."""
    r, cap = draw.about(0.038, 0.2), draw.between(0.16, 0.36)
    solid = Manifold.sphere(r, 40)
    neck = cylinder(cap * r, draw.between(0.12, 0.45) * r, at=(0.0, 0.0, 0.9 * r), segments=16,
                    top=cap * r * draw.between(0.6, 1.2))
    return solid + neck


STYLES = {'ball': (ball, seamed_ball, panelled_ball, channelled_ball, dimpled_ball, knobbly_ball,
                   oval_ball, squashed_ball, holed_ball, faceted_ball, ribbed_ball, knotted_ball)}
