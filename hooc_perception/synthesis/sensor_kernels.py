# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Pixel loops of the simulated depth cameras; see sensor.py for meaning and sources."""

import math
from typing import NamedTuple

from hooc_perception.core.arrays import BoolArray, Float32Array, Float64Array, Int32Array
import numba as nb
import numpy as np

# Kinect v1: distance from camera to projector, and the step of 1 / depth of the readings.
BASELINE_M = 0.075
DISPARITY_STEP = 0.00285
# Least cosine between normal and ray of the time-of-flight model.
LEAST_COSINE = 0.02


class Clean(NamedTuple):
    """
    What a perfect camera would see.

    :ivar depth: (H, W) float32 metres, inf where there is nothing.
    :ivar ids: (H, W) int32, -1 for the surroundings.
    :ivar cosine: (H, W) float32 between surface normal and ray.
    :ivar behind: (H, W) float32 depth without the translucent objects; read if `has_behind`.
    :ivar fx: focal length, pixels.
    """

    depth: Float32Array
    ids: Int32Array
    cosine: Float32Array
    behind: Float32Array
    has_behind: bool
    fx: float


class Surfaces(NamedTuple):
    """
    What the light meets, and how the image drifts.

    :ivar reflectance: (n + 1,) float64 of every id, the last one of the surroundings.
    :ivar glass: (n + 1,) bool, which are translucent; shift (n + 1,) float64 their mean shift
        away from the camera, metres.
    :ivar ripple: (H, W) float32 metres on top of the shift; drift (H, W) float32 metres.
    """

    reflectance: Float64Array
    glass: BoolArray
    shift: Float64Array
    ripple: Float32Array
    drift: Float32Array


class Errors(NamedTuple):
    """The figures of a SensorConfig by the same names, see there."""

    noise_scale: float
    lateral_px: float
    edge_m: float
    flying: float
    edge_dropout: float
    random_dropout: float
    signal_floor: float
    range_low: float
    range_high: float
    glass_dropout: float
    quantum_m: float


@nb.njit(cache=True)
def upsample(knots: Float32Array, height: int, width: int) -> Float32Array:
    """Return (height, width) float32: cubic B-spline surface over knots (m, m), unit variance."""
    m = knots.shape[0] - 3
    out = np.empty((height, width), np.float32)
    wu = np.empty((width, 4))
    iu = np.empty(width, np.int64)
    for u in range(width):
        s = u * m / width
        iu[u] = int(s)
        _spline(s - iu[u], wu[u])
    wv = np.empty(4)
    row = np.empty(knots.shape[1])
    for v in range(height):
        s = v * m / height
        k = int(s)
        _spline(s - k, wv)
        for j in range(knots.shape[1]):
            row[j] = (wv[0] * knots[k, j] + wv[1] * knots[k + 1, j] + wv[2] * knots[k + 2, j]
                      + wv[3] * knots[k + 3, j])
        for u in range(width):
            k = iu[u]
            # A B-spline averages its knots: a factor of about 2 gives the variance back.
            out[v, u] = 2.0 * (wu[u, 0] * row[k] + wu[u, 1] * row[k + 1]
                               + wu[u, 2] * row[k + 2] + wu[u, 3] * row[k + 3])
    return out


@nb.njit(cache=True)
def _spline(t: float, w: Float64Array) -> None:
    """Fill w (4,) with the weights of a uniform cubic B-spline at t in 0..1."""
    w[0] = (1 - t) ** 3 / 6
    w[1] = (3 * t ** 3 - 6 * t ** 2 + 4) / 6
    w[2] = (-3 * t ** 3 + 3 * t ** 2 + 3 * t + 1) / 6
    w[3] = t ** 3 / 6


@nb.njit(cache=True)
def incidence(depth: Float32Array, fx: float, fy: float, cx: float, cy: float) -> Float32Array:
    """
    Return (H, W) float32 cosines between surface normal and ray, from the depth's slopes.

    The smaller of the two one-sided slopes is taken along each axis, so that a depth edge does
    not count as a grazing surface.
    """
    h, w = depth.shape
    out = np.ones((h, w), np.float32)
    for v in range(h):
        y = (v - cy) / fy
        for u in range(w):
            z = depth[v, u]
            if not z < np.inf:
                continue
            zu = _slope(depth[v, max(u - 1, 0)], z, depth[v, min(u + 1, w - 1)])
            zv = _slope(depth[max(v - 1, 0), u], z, depth[min(v + 1, h - 1), u])
            x = (u - cx) / fx
            a, b = fx * zu, fy * zv
            c = z + x * a + y * b
            out[v, u] = z / math.sqrt((a * a + b * b + c * c) * (x * x + y * y + 1))
    return out


@nb.njit(cache=True)
def _slope(before: float, here: float, after: float) -> float:
    """Return the smaller of the two one-sided differences, 0 where there is none."""
    left, right = here - before, after - here
    if not abs(left) < np.inf:
        return right if abs(right) < np.inf else 0.0
    if not abs(right) < np.inf:
        return left
    # At the image's border one of the two is 0 by construction: take the other.
    if left == 0.0 or right == 0.0:
        return left + right if abs(left + right) < 0.02 else 0.0
    return left if abs(left) < abs(right) else right


@nb.njit(cache=True)
def _edge_partner(depth: Float32Array, v: int, u: int, z: float, edge_m: float) -> float:
    """Return the depth of the 4-neighbour beyond the largest step over edge_m, or z."""
    h, w = depth.shape
    best, partner = edge_m, z
    for k in range(4):
        vv = v + (k == 0) - (k == 1)
        uu = u + (k == 2) - (k == 3)
        if 0 <= vv < h and 0 <= uu < w:
            other = depth[vv, uu]
            if other < np.inf and abs(other - z) > best:
                best, partner = abs(other - z), other
    return partner


@nb.njit(cache=True)
def _source(depth: Float32Array, v: int, u: int, lateral: float,
            rng: np.random.Generator) -> tuple[int, int]:
    """Return (row, column) that pixel (v, u) looks at after lateral noise."""
    h, w = depth.shape
    vv = min(max(int(round(v + lateral * rng.standard_normal())), 0), h - 1)
    uu = min(max(int(round(u + lateral * rng.standard_normal())), 0), w - 1)
    return vv, uu


@nb.njit(cache=True)
def _near_edge(depth: Float32Array, v: int, u: int, z: float, edge_m: float) -> bool:
    """Return whether some 4-neighbour at 2 pixels or nearer is a step over edge_m away."""
    h, w = depth.shape
    for k in range(8):
        step = 1 + k // 4
        q = k % 4
        vv = v + step * ((q == 0) - (q == 1))
        uu = u + step * ((q == 2) - (q == 3))
        if 0 <= vv < h and 0 <= uu < w and abs(depth[vv, uu] - z) > edge_m:
            return True
    return False


@nb.njit(cache=True)
def _through_glass(clean: Clean, surfaces: Surfaces, which: int, v: int, u: int,
                   z: float) -> float:
    """Return the depth that is measured at a translucent object: behind its surface."""
    far = surfaces.shift[which] + surfaces.ripple[v, u]
    if clean.has_behind and clean.behind[v, u] < np.inf:
        far = min(far, max(np.float64(clean.behind[v, u]) - z, 0.0))
    return z + max(far, 0.0)


@nb.njit(cache=True)
def _quantised(z: float, quantum_m: float) -> float:
    """Return z rounded to whole steps of the readings."""
    if quantum_m > 0:
        z = quantum_m * math.floor(z / quantum_m + 0.5)
    return z


@nb.njit(cache=True)
def _axial_noise_v2(z: float, cosine: float) -> float:
    """Return the standard deviation in metres of a Kinect v2 (Fankhauser et al. 2015)."""
    theta = math.acos(min(cosine, 1.0))
    # The published formula gives millimetres for z in metres.
    sigma = 1.5 - 0.5 * z + 0.3 * z * z + 0.1 * z * math.sqrt(z) * (
        theta / (0.5 * math.pi - theta + 0.02)) ** 2
    return 1e-3 * min(sigma, 15.0)


@nb.njit(cache=True)
def _axial_noise_v1(z: float, cosine: float) -> float:
    """Return the standard deviation in metres of a Kinect v1 (Nguyen et al. 2012)."""
    theta = math.acos(min(max(cosine, 0.02), 1.0))
    return 0.0012 + 0.0019 * (z - 0.4) ** 2 + 0.0001 / math.sqrt(z) * (
        theta / (0.5 * math.pi - theta + 0.02)) ** 2


@nb.njit(cache=True)
def _flying(z: float, other: float, errors: Errors, rng: np.random.Generator) -> float:
    """Return the reading at the edge of surfaces at depths z and other; NaN where it drops out."""
    q = rng.random()
    if q < errors.edge_dropout:
        return np.nan
    if q < errors.edge_dropout + errors.flying:
        # The nearer surface sends more light back: weights lean towards it.
        a = rng.random() ** 2
        z += a * (other - z) if other > z else (1.0 - a) * (other - z) * 0.5
    return z


@nb.njit(cache=True)
def time_of_flight(clean: Clean, surfaces: Surfaces, errors: Errors,
                   rng: np.random.Generator) -> tuple[Float32Array, Int32Array]:
    """Return (depth float32 with NaN, ids int32) of a Kinect v2, see `sensor.sense`."""
    depth, ids = clean.depth, clean.ids
    h, w = depth.shape
    n = surfaces.reflectance.shape[0] - 1
    dark = 1.0 + 0.3 * (1.0 / np.sqrt(surfaces.reflectance) - 1.0)
    out = np.full((h, w), np.nan, np.float32)
    seen = ids.copy()
    for v in range(h):
        for u in range(w):
            z = np.float64(depth[v, u])
            sv, su = v, u
            # Lateral noise only shows near edges; elsewhere the slope is inside axial noise.
            edge = _near_edge(depth, v, u, z, errors.edge_m)
            if edge:
                sv, su = _source(depth, v, u, errors.lateral_px, rng)
                z = np.float64(depth[sv, su])
                seen[v, u] = ids[sv, su]
            chance = rng.random()
            if not z < errors.range_high or z < errors.range_low or (
                    chance < errors.random_dropout):
                continue
            which = ids[sv, su] if ids[sv, su] >= 0 else n
            cos = max(np.float64(clean.cosine[sv, su]), LEAST_COSINE)
            # Light falls with the square of the distance and towards the image's corners.
            eccentric = ((u - 0.5 * w) ** 2 + (v - 0.5 * h) ** 2) / (clean.fx * clean.fx)
            signal = surfaces.reflectance[which] * cos / (z * z * (1.0 + eccentric))
            floor = errors.signal_floor
            if signal < 8.0 * floor and chance < errors.random_dropout + math.exp(
                    -signal / floor) * (1.0 - errors.random_dropout):
                continue
            sigma = _axial_noise_v2(z, cos) * dark[which] * (1.0 + 0.8 * eccentric)
            if surfaces.glass[which]:
                if rng.random() < errors.glass_dropout:
                    continue
                sigma *= 2.0
                z = _through_glass(clean, surfaces, which, sv, su, z)
            elif edge:
                other = np.float64(_edge_partner(depth, sv, su, depth[sv, su], errors.edge_m))
                if other != depth[sv, su]:
                    z = _flying(z, other, errors, rng)
                    if z != z:
                        continue
            z += surfaces.drift[v, u] + errors.noise_scale * sigma * rng.standard_normal()
            out[v, u] = _quantised(z, errors.quantum_m)
    return out, seen


@nb.njit(cache=True)
def structured_light(clean: Clean, surfaces: Surfaces, errors: Errors,
                     rng: np.random.Generator) -> tuple[Float32Array, Int32Array]:
    """
    Return (depth float32 with NaN, ids int32) of a Kinect v1, see `sensor.sense`.

    Readings are steps of disparity (2.85 mm at 1 m, growing with z squared), and the
    projector, 75 mm to the right of the camera, casts a shadow left of every object.
    """
    depth, ids = clean.depth, clean.ids
    h, w = depth.shape
    n = surfaces.reflectance.shape[0] - 1
    baseline_px = BASELINE_M * clean.fx
    out = np.full((h, w), np.nan, np.float32)
    seen = ids.copy()
    for v in range(h):
        lit_from = 1e9
        for u in range(w - 1, -1, -1):
            z0 = np.float64(depth[v, u])
            shadow = False
            if z0 < np.inf:
                at = u - baseline_px / z0
                shadow = lit_from < at - 0.5
                lit_from = min(lit_from, at)
            sv, su = _source(depth, v, u, errors.lateral_px, rng)
            z = np.float64(depth[sv, su])
            seen[v, u] = ids[sv, su]
            if shadow or not z < errors.range_high or z < errors.range_low or (
                    rng.random() < errors.random_dropout):
                continue
            which = ids[sv, su] if ids[sv, su] >= 0 else n
            cos = np.float64(clean.cosine[sv, su])
            if cos < 0.12 + 0.05 * rng.random():
                continue
            if surfaces.glass[which]:
                if rng.random() < errors.glass_dropout:
                    continue
                z = _through_glass(clean, surfaces, which, sv, su, z)
            elif _edge_partner(depth, sv, su, depth[sv, su], errors.edge_m) != depth[sv, su]:
                if rng.random() < errors.edge_dropout:
                    continue
            sigma = _axial_noise_v1(z, cos)
            z += surfaces.drift[v, u] + 0.6 * errors.noise_scale * min(
                sigma, 0.03) * rng.standard_normal()
            step = DISPARITY_STEP
            z = 1.0 / (step * max(math.floor(1.0 / (step * max(z, 0.1)) + 0.5), 1.0))
            out[v, u] = _quantised(z, errors.quantum_m)
    return out, seen
