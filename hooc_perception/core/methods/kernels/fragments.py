# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Fragments of likely objects, their alignment with a model, and how well the two agree.

Basevi & Leonardis 2016, section 4.
"""

import math
from typing import NamedTuple

from hooc_perception.core.arrays import (
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    UInt8Array,
)
from hooc_perception.core.methods.kernels import icp
import numba as nb
import numpy as np

# Points nearer to a camera than this, metres, are not projected into it.
NEAR_M = 0.05
# A region wider than this many pixels is sampled in steps.
SAMPLED_PX = 80
FEWEST_POINTS = 6
# A model point that no view confirms or contradicts says nothing: the worst residual.
UNSEEN = 1.0
# Tolerances of the coarse and the fine alignment.
COARSE_TOLERANCE, FINE_TOLERANCE = 1e-2, 1e-3


class Images(NamedTuple):
    """
    The measured depth of all views, numbered through view by view, row by row.

    :ivar first: (V,) int64 where each view begins in `depth`; width, height (V,) int64.
    :ivar K: (V, 3, 3) float64; T_camera_world (V, 4, 4) float64.
    :ivar centre: (V, 3) float64 positions of the cameras in the world.
    :ivar depth: (P,) float32 metres, NaN = none.
    """

    first: Int64Array
    width: Int64Array
    height: Int64Array
    K: Float64Array
    T_camera_world: Float64Array
    centre: Float64Array
    depth: Float32Array


class Listed(NamedTuple):
    """
    The pixels with a class probability and a reading.

    :ivar row: (P,) int32 row in the arrays below for every pixel of all views, or -1.
    :ivar points: (M, 3) float64 world points, metres.
    :ivar p: (M,) uint8 probability x 255 of the category in question.
    """

    row: Int32Array
    points: Float64Array
    p: UInt8Array


class Draws(NamedTuple):
    """
    What is drawn at random for m fragments of one category.

    :ivar pixel: (m,) int32 listed row of the central pixel.
    :ivar half: (m,) half side of the bounding region, metres.
    :ivar least: (m,) uint8 probability from which on a pixel is likely.
    :ivar offset: (m,) in 0..1, where thinning begins.
    :ivar R: (m, 3, 3) initial R_world_model; shift (m, 3) metres from the fragment's centroid.
    :ivar scale: (m,) size of the model as a multiple of the generic one.
    """

    pixel: Int32Array
    half: Float64Array
    least: UInt8Array
    offset: Float64Array
    R: Float64Array
    shift: Float64Array
    scale: Float64Array


class Rules(NamedTuple):
    """
    Fixed numbers of the procedure, see `core.methods.fragments.FragmentConfig`.

    :ivar coarse_reach, fine_reach: farthest pairs, model units.
    :ivar coarse_points: fragment points of the coarse passes.
    :ivar coarse_passes, fine_passes: most iterations.
    :ivar fewest, most: pixels that a fragment needs; points that it keeps.
    :ivar truncation_m: largest residual.
    :ivar score_step: every score_step-th model point is scored.
    """

    coarse_reach: float
    fine_reach: float
    coarse_points: int
    coarse_passes: int
    fine_passes: int
    fewest: int
    most: int
    truncation_m: float
    score_step: int


class Pose(NamedTuple):
    """A posed model: world = scale * R model + t; R (3, 3), t (3,) metres."""

    scale: float
    R: Float64Array
    t: Float64Array


@nb.njit(cache=True, inline='always')
def _depth_in(T: Float64Array, x: float, y: float, z: float) -> float:
    """Return the depth of a world point along the optical axis of a camera T_camera_world."""
    return T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]


@nb.njit(cache=True)
def collect(centre: Float64Array, half: float, least: int, listed: Listed, images: Images,
            found: Int32Array) -> tuple[int, int]:
    """
    Write the rows of the likely pixels around a 3D point to `found` (M,).

    In each view the bounding region is the square around the point's projection whose half
    side is `half` metres at the point's depth. A pixel in it counts if it is likely and its own
    3D point lies within `half` of the centre along the optical axis.

    :param least: probability x 255 from which on a pixel is likely.
    :return: (how many rows were written, how many pixels they stand for): a wide region is
        sampled in steps, since a fragment is thinned in the end anyway.
    """
    count, pixels = 0, 0
    for v in range(images.first.shape[0]):
        T, K = images.T_camera_world[v], images.K[v]
        x = T[0, 0] * centre[0] + T[0, 1] * centre[1] + T[0, 2] * centre[2] + T[0, 3]
        y = T[1, 0] * centre[0] + T[1, 1] * centre[1] + T[1, 2] * centre[2] + T[1, 3]
        z = _depth_in(T, centre[0], centre[1], centre[2])
        if z <= NEAR_M:
            continue
        u, w = K[0, 0] * x / z + K[0, 2], K[1, 1] * y / z + K[1, 2]
        du, dw = K[0, 0] * half / z, K[1, 1] * half / z
        u_lo, u_hi = max(0, int(np.ceil(u - du))), min(images.width[v] - 1, int(np.floor(u + du)))
        w_lo, w_hi = max(0, int(np.ceil(w - dw))), min(images.height[v] - 1, int(np.floor(w + dw)))
        step = 1 + int(2.0 * du / SAMPLED_PX)
        for j in range(w_lo, w_hi + 1, step):
            for i in range(u_lo, u_hi + 1, step):
                r = listed.row[images.first[v] + j * images.width[v] + i]
                if r < 0 or listed.p[r] < least:
                    continue
                q = listed.points[r]
                if abs(_depth_in(T, q[0], q[1], q[2]) - z) <= half:
                    found[count] = r
                    count += 1
                    pixels += step * step
    return count, pixels


@nb.njit(cache=True)
def thin(found: Int32Array, count: int, offset: float, points: Float64Array,
         fragment: Float64Array) -> int:
    """Write evenly spaced points of found[:count] to `fragment` (most, 3); return how many."""
    most = fragment.shape[0]
    step = max(1.0, count / most)
    n = 0
    at = offset * step
    while n < most and int(at) < count:
        for c in range(3):
            fragment[n, c] = points[found[int(at)], c]
        n += 1
        at += step
    return n


@nb.njit(cache=True)
def _fragment_residual(fragment: Float64Array, n: int, target: icp.TargetCloud, pose: Pose,
                       limit: float) -> float:
    """Return the mean distance of the first n fragment points to the model, in 0..1 of limit."""
    R, t, scale = pose.R, pose.t, pose.scale
    total = 0.0
    for i in range(n):
        dx, dy, dz = fragment[i, 0] - t[0], fragment[i, 1] - t[1], fragment[i, 2] - t[2]
        m, d2 = icp.nearest(
            (R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz) / scale,
            (R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz) / scale,
            (R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz) / scale, target, limit / scale)
        total += 1.0 if m < 0 else math.sqrt(d2) * scale / limit
    return total / max(n, 1)


@nb.njit(cache=True, inline='always')
def _behind_measured(images: Images, v: int, p: tuple[float, float, float]) -> float:
    """
    Return how far world point p lies behind what view v measured at its pixel, metres.

    Negative = in front of it; NaN where the view has no reading there.
    """
    px, py, pz = p
    T, K = images.T_camera_world[v], images.K[v]
    z = _depth_in(T, px, py, pz)
    if z <= NEAR_M:
        return np.nan
    x = T[0, 0] * px + T[0, 1] * py + T[0, 2] * pz + T[0, 3]
    y = T[1, 0] * px + T[1, 1] * py + T[1, 2] * pz + T[1, 3]
    i = int(np.floor(K[0, 0] * x / z + K[0, 2] + 0.5))
    j = int(np.floor(K[1, 1] * y / z + K[1, 2] + 0.5))
    if i < 0 or j < 0 or i >= images.width[v] or j >= images.height[v]:
        return np.nan
    return z - float(images.depth[images.first[v] + j * images.width[v] + i])


@nb.njit(cache=True)
def _model_residual(target: icp.TargetCloud, pose: Pose, step: int, limit: float,
                    images: Images) -> float:
    """
    Return the mean depth residual of the model's visible surface, in 0..1 of limit.

    Of each step-th model point and view that it faces, the distance along the optical axis to
    what was measured at its pixel. Points that something nearer hides say nothing; points in
    front of the measured surface contradict it at full weight.
    """
    R, t, scale = pose.R, pose.t, pose.scale
    total, seen = 0.0, 0
    for m in range(0, target.points.shape[0], step):
        q, n = target.points[m], target.normals[m]
        px = scale * (R[0, 0] * q[0] + R[0, 1] * q[1] + R[0, 2] * q[2]) + t[0]
        py = scale * (R[1, 0] * q[0] + R[1, 1] * q[1] + R[1, 2] * q[2]) + t[1]
        pz = scale * (R[2, 0] * q[0] + R[2, 1] * q[1] + R[2, 2] * q[2]) + t[2]
        nx = R[0, 0] * n[0] + R[0, 1] * n[1] + R[0, 2] * n[2]
        ny = R[1, 0] * n[0] + R[1, 1] * n[1] + R[1, 2] * n[2]
        nz = R[2, 0] * n[0] + R[2, 1] * n[1] + R[2, 2] * n[2]
        for v in range(images.first.shape[0]):
            C = images.centre[v]
            if nx * (C[0] - px) + ny * (C[1] - py) + nz * (C[2] - pz) <= 0.0:
                continue
            behind = _behind_measured(images, v, (px, py, pz))
            if not behind <= limit:
                continue
            seen += 1
            total += min(abs(behind) / limit, 1.0)
    return total / seen if seen else UNSEEN


@nb.njit(cache=True)
def disagreement(fragment: Float64Array, n: int, target: icp.TargetCloud, pose: Pose,
                 rules: Rules, images: Images) -> tuple[float, float]:
    """
    Return (forward, backward), mean truncated residuals in 0..1 of fragment and model.

    Forward: distance of the first n points of `fragment` (most, 3) to the model. Backward: depth
    residual of the model's visible surface.
    """
    return (_fragment_residual(fragment, n, target, pose, rules.truncation_m),
            _model_residual(target, pose, rules.score_step, rules.truncation_m, images))


@nb.njit(cache=True)
def _aligned(source: Float64Array, R: Float64Array, shift: Float64Array,
             target: icp.TargetCloud, rules: Rules) -> tuple[Float64Array, Float64Array]:
    """
    Return (Q (3, 3), q (3,)) = T_model_world of a fragment, coarse passes first.

    :param source: (n, 3) the fragment in model units; R, shift: where to start, see Draws.
    """
    n = source.shape[0]
    middle = np.zeros(3)
    for k in range(n):
        for c in range(3):
            middle[c] += source[k, c] / n
    Q, q = np.empty((3, 3)), np.empty(3)
    for a in range(3):
        for b in range(3):
            Q[a, b] = R[b, a]
    for c in range(3):
        q[c] = 0.0
        for b in range(3):
            q[c] -= Q[c, b] * (middle[b] + shift[b])
    coarse_target = icp.TargetCloud(
        target.points, target.normals, target.grid, target.origin, target.cell, target.margin,
        np.zeros((target.points.shape[0], 0), np.int32))
    icp.align(source, coarse_target, Q, q, icp.Passes(
        max(1, n // rules.coarse_points), rules.coarse_reach, rules.coarse_passes, False,
        COARSE_TOLERANCE))
    icp.align(source, target, Q, q, icp.Passes(
        1, rules.fine_reach, rules.fine_passes, True, FINE_TOLERANCE))
    return Q, q


@nb.njit(cache=True)
def propose(draws: Draws, listed: Listed, target: icp.TargetCloud, images: Images,
            rules: Rules) -> tuple[Float64Array, Float64Array, Float64Array]:
    """
    Cut out a fragment for every drawn pixel, align the model with it and score the two.

    :return: R (m, 3, 3) and t (m, 3), world from scaled model; score (m,) in 0..1, -1 where the
        fragment is too small.
    """
    m = draws.pixel.shape[0]
    R, t, score = np.zeros((m, 3, 3)), np.zeros((m, 3)), np.full(m, -1.0)
    found = np.empty(listed.points.shape[0], np.int32)
    fragment = np.empty((rules.most, 3))
    for i in range(m):
        count, pixels = collect(listed.points[draws.pixel[i]], draws.half[i], draws.least[i],
                                listed, images, found)
        if pixels < rules.fewest or count < FEWEST_POINTS:
            continue
        n = thin(found, count, draws.offset[i], listed.points, fragment)
        # Align in the model's own units: the fragment shrinks instead of the model growing.
        scale = draws.scale[i]
        source, shift = np.empty((n, 3)), np.empty(3)
        for c in range(3):
            for k in range(n):
                source[k, c] = fragment[k, c] / scale
            shift[c] = draws.shift[i, c] / scale
        Q, q = _aligned(source, draws.R[i], shift, target, rules)
        for a in range(3):
            for b in range(3):
                R[i, a, b] = Q[b, a]
        for a in range(3):
            for b in range(3):
                t[i, a] -= scale * R[i, a, b] * q[b]
        forward, backward = disagreement(fragment, n, target, Pose(scale, R[i], t[i]), rules,
                                         images)
        score[i] = 1.0 - 0.5 * (forward + backward)
    return R, t, score
