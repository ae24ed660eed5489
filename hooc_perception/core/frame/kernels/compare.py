# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Render hypotheses into all views and compare them with what was measured there.

A hypothesis is compared by itself, in the context of what is shown already: every pixel that it
covers is compared with the reading there (pixel_cost.py), and its statistics say by how much it
would change the sum of all pixels' costs (DELTA), and why.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array, Int64Array
from hooc_perception.core.frame.kernels.pixel_cost import (
    AGREES,
    pixel_cost,
    SEEN_THROUGH,
    shown_without,
    unlikeliness,
)
from hooc_perception.core.frame.kernels.records import (
    Context,
    Hypotheses,
    Meshes,
    PixelOutput,
    PixelWeights,
    Target,
    Views,
)
from hooc_perception.core.kernels import raster
from hooc_perception.core.kernels.gauss_newton import add_equation
from hooc_perception.core.kernels.pose import posed, rotation_of
import numba as nb
import numpy as np

# Columns of the statistics of one hypothesis.
SHOWN = 0           # pixels that it covers
AGREE = 1           # pixels whose reading agrees
GAIN = 2            # sum over the agreeing pixels of 1 - cost
VIOLATE = 3         # free-space violations; where the table was measured, their cost
BEHIND = 4          # pixels behind what is shown already or what was measured
MISSING = 5         # pixels without a reading
SHARE = 6           # mean share of the smooth patches that it agrees with
UNLIKELINESS = 7    # sum over the agreeing pixels of the unlikeliness of the category
COS = 8             # the same of the cosine between rendered and measured normal
RESIDUAL = 9        # the same of |z - d|, metres
DELTA = 10          # change of the sum of all pixels' costs
VIEWS = 11          # views in which any pixel agrees
STATS = 12
# Smooth patches of one hypothesis that are counted; further ones are left out of SHARE.
MAX_PATCHES = 64
# Least cosine for a Gauss-Newton equation: at steeper angles the normals are no longer those of
# the same surface.
MIN_COSINE = 0.3
# Residual, in tolerances, below which all equations weigh about the same.
SOFTENING = 0.2


class Subject(NamedTuple):
    """
    A hypothesis, ready to be rendered.

    :ivar h: (10,) float64, see core/kernels/pose.py; `R` (3, 3) its rotation.
    :ivar world: (V, 3) float64 vertices in the world; `faces` (F, 3) int32; `closed` bool.
    :ivar category: class id; `me` its number in the context, -1 = none.
    """

    h: Float64Array
    R: Float64Array
    world: Float64Array
    faces: Int32Array
    closed: bool
    category: int
    me: int


class Sums(NamedTuple):
    """
    What is summed over the pixels of one hypothesis.

    :ivar stats: (STATS,) float64.
    :ivar equations: (9, 10) float64, see core/kernels/gauss_newton.py; (0, 0) = not wanted.
    :ivar patch: (MAX_PATCHES,) int64 smooth patches that it agrees with, then -1; `hits`
        (MAX_PATCHES,) float64 pixels in each.
    """

    stats: Float64Array
    equations: Float64Array
    patch: Int64Array
    hits: Float64Array


@nb.njit(cache=True, inline='always')
def _cosine(subject: Subject, face: int, eye: Float64Array, normals: Float32Array,
            i: int) -> float:
    """Return the cosine between the normal of a face, towards the eye, and that of pixel i."""
    world, faces = subject.world, subject.faces
    a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
    e0, e1, e2 = (world[b, 0] - world[a, 0], world[b, 1] - world[a, 1],
                  world[b, 2] - world[a, 2])
    f0, f1, f2 = (world[c, 0] - world[a, 0], world[c, 1] - world[a, 1],
                  world[c, 2] - world[a, 2])
    n0, n1, n2 = e1 * f2 - e2 * f1, e2 * f0 - e0 * f2, e0 * f1 - e1 * f0
    norm = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2) + 1e-20
    # Both sides are drawn: the visible side is the one towards the camera.
    if (n0 * (eye[0] - world[a, 0]) + n1 * (eye[1] - world[a, 1])
            + n2 * (eye[2] - world[a, 2])) < 0:
        norm = -norm
    return (n0 * normals[i, 0] + n1 * normals[i, 1] + n2 * normals[i, 2]) / norm


@nb.njit(cache=True, inline='always')
def ray(views: Views, view: int, column: int, row: int) -> tuple[float, float, float]:
    """Return the direction of a pixel's ray in the world, one metre deep."""
    K, R = views.K, views.R
    x = (column - K[view, 0, 2]) / K[view, 0, 0]
    y = (row - K[view, 1, 2]) / K[view, 1, 1]
    return (R[view, 0, 0] * x + R[view, 1, 0] * y + R[view, 2, 0],
            R[view, 0, 1] * x + R[view, 1, 1] * y + R[view, 2, 1],
            R[view, 0, 2] * x + R[view, 1, 2] * y + R[view, 2, 2])


@nb.njit(cache=True, inline='always')
def _add_point_to_plane(subject: Subject, equations: Float64Array, eye: Float64Array,
                        ray: tuple[float, float, float], reading: tuple[float, float, float],
                        normal: tuple[float, float, float], tolerance: float) -> None:
    """
    Add the Gauss-Newton equation of one pixel: the distance to the tangent plane measured there.

    :param reading: rendered depth, measured depth and cosine.
    """
    z, d, cosine = reading
    off = z - d
    slope = ray[0] * normal[0] + ray[1] * normal[1] + ray[2] * normal[2]
    add_equation(equations, subject.h, subject.R,
                 (eye[0] + ray[0] * z, eye[1] + ray[1] * z, eye[2] + ray[2] * z), normal,
                 slope * off, cosine / (abs(off) / tolerance + SOFTENING))


@nb.njit(cache=True, inline='always')
def _count_patch(sums: Sums, patch: int) -> None:
    """Count one more pixel of a smooth patch."""
    for k in range(MAX_PATCHES):
        if sums.patch[k] == patch:
            sums.hits[k] += 1
            break
        if sums.patch[k] < 0:
            sums.patch[k] = patch
            sums.hits[k] = 1
            break


@nb.njit(cache=True, inline='always')
def _share(sums: Sums, patch_size: Int64Array) -> float:
    """Return the mean share of its patches that a hypothesis agrees with, weighted by pixels."""
    share, total = 0.0, 0.0
    for k in range(MAX_PATCHES):
        if sums.patch[k] < 0:
            break
        share += sums.hits[k] * min(1.0, sums.hits[k] / patch_size[sums.patch[k]])
        total += sums.hits[k]
    return share / total if total > 0 else 0.0


@nb.njit(cache=True, error_model='numpy')
def _render(subject: Subject, views: Views, view: int,
            ) -> tuple[int, int, Float32Array, Int32Array]:
    """
    Render a hypothesis into one view.

    :return: (column, row) of the first pixel of its window, and the window's images: depth
        (h, w) float32 metres, inf = not covered, and face (h, w) int32. Empty out of sight.
    """
    uvz, (u0, v0, u1, v1) = raster.in_view(subject.world, views.R[view], views.t[view],
                                           views.K[view], views.size[view])
    depth = np.full((v1 - v0, u1 - u0), np.inf, np.float32)
    face = np.zeros(depth.shape, np.int32)
    if depth.size:
        raster.draw(uvz, subject.faces, -1, u0, v0, depth, face, subject.closed)
    return u0, v0, depth, face


@nb.njit(cache=True, error_model='numpy')
def _compare_view(subject: Subject, target: Target, view: int, sums: Sums, at: int,
                  output: PixelOutput) -> int:
    """Compare a hypothesis with one view; see compare_one."""
    views, context, weights = target.views, target.context, target.weights
    stats, normals, me = sums.stats, views.normals, subject.me
    u0, v0, rendered, face = _render(subject, views, view)
    eye = -(views.R[view].T @ views.t[view])
    for y in range(rendered.shape[0]):
        for x in range(rendered.shape[1]):
            z = rendered[y, x]
            if z == np.inf:
                continue
            i: int = views.first[view] + (y + v0) * views.size[view, 0] + x + u0
            before, base = shown_without(context, i, me)
            stats[SHOWN] += 1
            if before < z:
                stats[BEHIND] += 1
                continue
            d = views.depth[i]
            if not d > 0:
                stats[MISSING] += 1
                continue
            has_normal = normals[i, 0] == normals[i, 0]
            cosine = 1.0
            if views.foreground[i] and has_normal:
                cosine = _cosine(subject, face[y, x], eye, normals, i)
            unlikely = unlikeliness(views, i, subject.category)
            cost, state = pixel_cost(z, d, views.foreground[i], cosine, unlikely, weights)
            stats[DELTA] += cost - base
            if at >= 0:
                output.pixel[at], output.depth[at], output.cost[at] = i, z, cost
                at += 1
            if state == AGREES:
                stats[AGREE] += 1
                stats[GAIN] += 1.0 - cost
                stats[COS] += cosine
                stats[RESIDUAL] += abs(z - d)
                stats[UNLIKELINESS] += unlikely
                if sums.equations.shape[0] and cosine > MIN_COSINE and has_normal:
                    normal = normals[i, 0], normals[i, 1], normals[i, 2]
                    _add_point_to_plane(subject, sums.equations, eye,
                                        ray(views, view, x + u0, y + v0), (z, d, cosine),
                                        normal, weights.tolerance_m)
                if len(views.patch_size) and views.patch[i] >= 0:
                    _count_patch(sums, views.patch[i])
            elif state == SEEN_THROUGH:
                stats[VIOLATE] += cost if not views.foreground[i] else 1.0
            else:
                stats[BEHIND] += 1
    return at


@nb.njit(cache=True, error_model='numpy')
def compare_one(hypotheses: Hypotheses, k: int, h: Float64Array, target: Target,
                stats: Float64Array, equations: Float64Array, start: int,
                output: PixelOutput) -> int:
    """
    Compare one hypothesis with all views.

    :param hypotheses: row k of it says which mesh and category; `h` (10,) float64 where it is.
    :param stats: (STATS,) float64, filled. SHARE stays 0 where the views have no patch_size.
    :param equations: (9, 10) float64, filled with the Gauss-Newton equations of the agreeing
        pixels, see core/kernels/gauss_newton.py; (0, 0) = not wanted.
    :param start: where to write the covered pixels with a reading in `output`; -1 = nowhere.
    :return: where the next one would go.
    """
    meshes, views = target.meshes, target.views
    s: int = hypotheses.shape[k]
    vertices = meshes.vertices[meshes.vertex_start[s]:meshes.vertex_start[s + 1]]
    faces = meshes.faces[meshes.face_start[s]:meshes.face_start[s + 1]]
    R, world = np.empty((3, 3)), np.empty(vertices.shape)
    rotation_of(h, R)
    posed(h, vertices, world)
    subject = Subject(h, R, world, faces, meshes.closed[s], hypotheses.category[k],
                      hypotheses.me[k])
    stats[:] = 0.0
    equations[:] = 0.0
    sums = Sums(stats, equations, np.full(MAX_PATCHES, -1), np.zeros(MAX_PATCHES))
    at = start
    for view in range(views.K.shape[0]):
        agreed = stats[AGREE]
        at = _compare_view(subject, target, view, sums, at, output)
        if stats[AGREE] > agreed:
            stats[VIEWS] += 1
    stats[SHARE] = _share(sums, views.patch_size)
    return at


@nb.njit(cache=True, parallel=True)
def compare_all(hypotheses: Hypotheses, views: Views, meshes: Meshes, context: Context,
                weights: PixelWeights, output: PixelOutput) -> tuple[Float64Array, Int64Array]:
    """
    Run compare_one for every hypothesis.

    :return: stats (m, STATS) float64, and (m,) int64 the pixels that each has written.
    """
    m = hypotheses.rows.shape[0]
    stats = np.zeros((m, STATS))
    n = np.zeros(m, np.int64)
    for k in nb.prange(m):
        target = Target(views, meshes, context, weights)
        start = output.start[k]
        n[k] = compare_one(hypotheses, k, hypotheses.rows[k], target, stats[k],
                           np.empty((0, 0)), start, output) - start
    return stats, n
