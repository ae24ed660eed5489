# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The surface that one view measures, thinned and with normals: what registration reads."""

from dataclasses import dataclass
from typing import NamedTuple

from hooc_perception.core.arrays import BoolArray, Float32Array, Float64Array
from hooc_perception.core.frame.kernels.field import normals_of_view
from hooc_perception.core.geometry import inverse, rays, transform
from hooc_perception.core.types import ObservedView
import numpy as np

# An image is thinned to about this many pixels; a normal is a plane fit over the neighbours.
PIXELS = 80_000
NORMAL_RADIUS_PX, NORMAL_GATE_M = 2, 0.03
# Points that slope say where things stand, level ones only how high; the table has far more of
# the latter, hence as many as this are drawn of each.
SLOPING_POINTS, LEVEL_POINTS = 3000, 1000
# Cosine between a normal and the vertical above which a point is level.
LEVEL_COSINE = 0.9
# Normals of two readings of one surface differ by less than this (cosine).
SAME_NORMAL = 0.7


@dataclass(frozen=True)
class Surface:
    """
    One view's surface in the camera's own frame, so that it holds for any pose of the camera.

    :ivar K: (3, 3) float64 intrinsics of the thinned image.
    :ivar points, normals: (h, w, 3) float32 metres and unit vectors towards the camera, camera
        frame; NaN = none.
    :ivar sloping, level: (n, 6) float64 drawn points and their normals, camera frame.
    """

    K: Float64Array
    points: Float32Array
    normals: Float32Array
    sloping: Float64Array
    level: Float64Array

    @property
    def drawn(self) -> Float64Array:
        """Return the sloping points followed by the level ones, (n, 6)."""
        return np.concatenate([self.sloping, self.level])


class Matches(NamedTuple):
    """
    Points of one view on the surface of another.

    :ivar points: (n, 3) float64 points, world, metres.
    :ivar normals: (n, 3) float64 normals of the surface that they lie on, world.
    :ivar distance_m: (n,) float64 signed distance of the points from that surface.
    :ivar sloping: (n,) bool, whether that surface slopes.
    :ivar comparable: number of points that the other view could see: with a reading there, not
        hidden behind it.
    """

    points: Float64Array
    normals: Float64Array
    distance_m: Float64Array
    sloping: BoolArray
    comparable: int


def surface_of(view: ObservedView) -> Surface:
    """
    Return the Surface of what stands on the table and of the table around it.

    :param view: its pose only decides which pixels count and which points are drawn.
    """
    height, width = view.depth.shape
    step = max(1, round(float(np.sqrt(height * width / PIXELS))))
    depth = np.where(view.foreground | view.table, view.depth, np.nan)[::step, ::step]
    K = view.camera.K.copy()
    K[:2] /= step
    points = rays(K, *depth.shape) * depth[..., None]
    normals = normals_of_view(points, np.isfinite(depth), np.zeros(3), NORMAL_RADIUS_PX,
                              NORMAL_GATE_M)
    known = np.isfinite(normals[..., 0])
    upright = np.abs(normals @ view.camera.T_world_camera[2, :3])
    rows = np.concatenate([points, normals], -1).astype(np.float64)
    return Surface(K, points.astype(np.float32), normals,
                   _drawn(rows[known & (upright < LEVEL_COSINE)
                               & view.foreground[::step, ::step]], SLOPING_POINTS),
                   _drawn(rows[known & (upright >= LEVEL_COSINE)], LEVEL_POINTS))


def matches(onto: Surface, T_world_onto: Float64Array, of: Surface, T_world_of: Float64Array,
            reach_m: float) -> Matches:
    """
    Return which drawn points of one Surface lie on another one, by projective association.

    A point is compared with the reading of the pixel that it falls on. One that lies farther
    behind it than `reach_m` is hidden, one with another normal belongs to another side of the
    object; both are left out.

    :param reach_m: largest distance between point and surface.
    """
    drawn = of.drawn
    points = transform(T_world_of, drawn[:, :3])
    normals_of = drawn[:, 3:] @ T_world_of[:3, :3].T
    in_onto = transform(inverse(T_world_onto), points)
    ahead = in_onto[:, 2] > 0.05
    z = np.where(ahead, in_onto[:, 2], 1.0)
    h, w = onto.points.shape[:2]
    u = np.rint(onto.K[0, 0] * in_onto[:, 0] / z + onto.K[0, 2])
    v = np.rint(onto.K[1, 1] * in_onto[:, 1] / z + onto.K[1, 2])
    seen = ahead & (u >= 0) & (u < w) & (v >= 0) & (v < h)
    rows, cols = v[seen].astype(int), u[seen].astype(int)
    at = onto.points[rows, cols].astype(np.float64)
    normals = onto.normals[rows, cols].astype(np.float64) @ T_world_onto[:3, :3].T
    away = points[seen] - transform(T_world_onto, at)
    distance = np.sum(normals * away, axis=1)
    in_front = in_onto[seen, 2] < at[:, 2] + reach_m
    alike = np.sum(normals * normals_of[seen], axis=1) > SAME_NORMAL
    with np.errstate(invalid='ignore'):
        keep = (alike & (np.abs(distance) < reach_m)
                & (np.linalg.norm(away, axis=1) < 3 * reach_m))
    return Matches(points[seen][keep], normals[keep], distance[keep],
                   np.abs(normals[keep, 2]) < LEVEL_COSINE, int(in_front.sum()))


def _drawn(rows: Float64Array, most: int) -> Float64Array:
    """Return at most so many of the rows, evenly spread over the image."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, most).astype(int)]
