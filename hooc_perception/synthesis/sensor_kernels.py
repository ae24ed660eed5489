# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Pixel loops of the simulated depth cameras; see sensor.py for meaning and sources."""

import math

import numba as nb
import numpy as np


@nb.njit(cache=True)
def upsample(knots, height, width):
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
def _spline(t, w):
    w[0] = (1 - t) ** 3 / 6
    w[1] = (3 * t ** 3 - 6 * t ** 2 + 4) / 6
    w[2] = (-3 * t ** 3 + 3 * t ** 2 + 3 * t + 1) / 6
    w[3] = t ** 3 / 6


@nb.njit(cache=True)
def incidence(depth, fx, fy, cx, cy, edge_m):
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
def _slope(before, here, after):
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
def _edge_partner(depth, v, u, z, edge_m):
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
def _source(depth, v, u, lateral, rng):
    """Return (row, column) that pixel (v, u) looks at after lateral noise."""
    h, w = depth.shape
    vv = min(max(int(round(v + lateral * rng.standard_normal())), 0), h - 1)
    uu = min(max(int(round(u + lateral * rng.standard_normal())), 0), w - 1)
    return vv, uu


@nb.njit(cache=True)
def _near_edge(depth, v, u, z, edge_m):
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
def time_of_flight(depth, ids, cosine, drift, ripple, reflectance, glass, shift, behind,
                   has_behind, rng, fx, noise_scale, lateral_px, edge_m, flying, edge_dropout,
                   random_dropout, signal_floor, range_low, range_high, glass_dropout,
                   quantum_m):
    """Return (depth float32 with NaN, ids int32) of a Kinect v2; arguments as in `sense`."""
    h, w = depth.shape
    n = reflectance.shape[0] - 1
    dark = 1.0 + 0.3 * (1.0 / np.sqrt(reflectance) - 1.0)
    out = np.full((h, w), np.nan, np.float32)
    seen = ids.copy()
    for v in range(h):
        for u in range(w):
            z = np.float64(depth[v, u])
            sv, su = v, u
            # Lateral noise only shows near edges; elsewhere the slope is inside axial noise.
            edge = _near_edge(depth, v, u, z, edge_m)
            if edge:
                sv, su = _source(depth, v, u, lateral_px, rng)
                z = np.float64(depth[sv, su])
                seen[v, u] = ids[sv, su]
            chance = rng.random()
            if not z < range_high or z < range_low or chance < random_dropout:
                continue
            which = ids[sv, su] if ids[sv, su] >= 0 else n
            cos = max(np.float64(cosine[sv, su]), 0.02)
            # Light falls with the square of the distance and towards the image's corners.
            eccentric = ((u - 0.5 * w) ** 2 + (v - 0.5 * h) ** 2) / (fx * fx)
            signal = reflectance[which] * cos / (z * z * (1.0 + eccentric))
            if signal < 8.0 * signal_floor and chance < random_dropout + math.exp(
                    -signal / signal_floor) * (1.0 - random_dropout):
                continue
            theta = math.acos(min(cos, 1.0))
            # Fankhauser et al. 2015, millimetres for z in metres.
            sigma = 1.5 - 0.5 * z + 0.3 * z * z + 0.1 * z * math.sqrt(z) * (
                theta / (0.5 * math.pi - theta + 0.02)) ** 2
            sigma = 1e-3 * min(sigma, 15.0) * dark[which] * (1.0 + 0.8 * eccentric)
            if glass[which]:
                if rng.random() < glass_dropout:
                    continue
                sigma *= 2.0
                far = shift[which] + ripple[sv, su]
                if has_behind and behind[sv, su] < np.inf:
                    far = min(far, max(np.float64(behind[sv, su]) - z, 0.0))
                z += max(far, 0.0)
            elif edge:
                other = np.float64(_edge_partner(depth, sv, su, depth[sv, su], edge_m))
                if other != depth[sv, su]:
                    q = rng.random()
                    if q < edge_dropout:
                        continue
                    if q < edge_dropout + flying:
                        # The nearer surface sends more light back: weights lean towards it.
                        a = rng.random() ** 2
                        z += a * (other - z) if other > z else (1.0 - a) * (other - z) * 0.5
            z += drift[v, u] + noise_scale * sigma * rng.standard_normal()
            if quantum_m > 0:
                z = quantum_m * math.floor(z / quantum_m + 0.5)
            out[v, u] = z
    return out, seen


@nb.njit(cache=True)
def structured_light(depth, ids, cosine, drift, ripple, reflectance, glass, shift, behind,
                     has_behind, rng, fx, noise_scale, lateral_px, edge_m, flying, edge_dropout,
                     random_dropout, signal_floor, range_low, range_high, glass_dropout,
                     quantum_m):
    """
    Return (depth float32 with NaN, ids int32) of a Kinect v1; arguments as in `sense`.

    Readings are steps of disparity (2.85 mm at 1 m, growing with z squared), and the
    projector, 75 mm to the right of the camera, casts a shadow left of every object.
    """
    h, w = depth.shape
    n = reflectance.shape[0] - 1
    baseline_px = 0.075 * fx
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
            sv, su = _source(depth, v, u, lateral_px, rng)
            z = np.float64(depth[sv, su])
            seen[v, u] = ids[sv, su]
            if shadow or not z < range_high or z < range_low or rng.random() < random_dropout:
                continue
            which = ids[sv, su] if ids[sv, su] >= 0 else n
            cos = np.float64(cosine[sv, su])
            if cos < 0.12 + 0.05 * rng.random():
                continue
            if glass[which]:
                if rng.random() < glass_dropout:
                    continue
                far = shift[which] + ripple[sv, su]
                if has_behind and behind[sv, su] < np.inf:
                    far = min(far, max(np.float64(behind[sv, su]) - z, 0.0))
                z += max(far, 0.0)
            elif _edge_partner(depth, sv, su, depth[sv, su], edge_m) != depth[sv, su]:
                if rng.random() < edge_dropout:
                    continue
            # Nguyen et al. 2012.
            theta = math.acos(min(max(cos, 0.02), 1.0))
            sigma = 0.0012 + 0.0019 * (z - 0.4) ** 2 + 0.0001 / math.sqrt(z) * (
                theta / (0.5 * math.pi - theta + 0.02)) ** 2
            z += drift[v, u] + 0.6 * noise_scale * min(sigma, 0.03) * rng.standard_normal()
            step = 0.00285
            z = 1.0 / (step * max(math.floor(1.0 / (step * max(z, 0.1)) + 0.5), 1.0))
            if quantum_m > 0:
                z = quantum_m * math.floor(z / quantum_m + 0.5)
            out[v, u] = z
    return out, seen
