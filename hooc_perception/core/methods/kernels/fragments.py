# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fragments of likely objects, their alignment with a model, and how well the two agree."""

from hooc_perception.core.methods.kernels import icp
import numba as nb
import numpy as np

NEAR_M = 0.05
GLANCES = 80


@nb.njit(cache=True)
def collect(centre, half, p, least, row, first, width, height, K, T_camera_world, points, found):
    """
    Write the rows of the likely pixels around a 3D point to `found`.

    Return how many were written and how many pixels they stand for: a region wider than
    GLANCES pixels is looked at in steps, since a fragment is thinned in the end anyway.

    In each view the bounding region is the square around the point's projection whose half
    side is `half` metres at the point's depth; of its pixels those count that are likely and
    whose own 3D point lies within `half` of the centre along the optical axis.

    :param p: (M,) uint8 probability of the category, per listed pixel; likely is what has at
        least `least`.
    :param row: (P,) int32, listed pixel of every pixel of all views, or -1; `first` (views,)
        where each view begins.
    :param points: (M, 3) float64 world points of the listed pixels.
    :param found: (M,) int32, written.
    """
    count, pixels = 0, 0
    for v in range(first.shape[0]):
        T = T_camera_world[v]
        x = T[0, 0] * centre[0] + T[0, 1] * centre[1] + T[0, 2] * centre[2] + T[0, 3]
        y = T[1, 0] * centre[0] + T[1, 1] * centre[1] + T[1, 2] * centre[2] + T[1, 3]
        z = T[2, 0] * centre[0] + T[2, 1] * centre[1] + T[2, 2] * centre[2] + T[2, 3]
        if z <= NEAR_M:
            continue
        u, w = K[v, 0, 0] * x / z + K[v, 0, 2], K[v, 1, 1] * y / z + K[v, 1, 2]
        du, dw = K[v, 0, 0] * half / z, K[v, 1, 1] * half / z
        u_lo, u_hi = max(0, int(np.ceil(u - du))), min(width[v] - 1, int(np.floor(u + du)))
        w_lo, w_hi = max(0, int(np.ceil(w - dw))), min(height[v] - 1, int(np.floor(w + dw)))
        step = 1 + int(2.0 * du / GLANCES)
        for j in range(w_lo, w_hi + 1, step):
            for i in range(u_lo, u_hi + 1, step):
                r = row[first[v] + j * width[v] + i]
                if r < 0 or p[r] < least:
                    continue
                q = points[r]
                depth = T[2, 0] * q[0] + T[2, 1] * q[1] + T[2, 2] * q[2] + T[2, 3]
                if abs(depth - z) <= half:
                    found[count] = r
                    count += 1
                    pixels += step * step
    return count, pixels


@nb.njit(cache=True)
def thin(found, count, most, offset, points, fragment):
    """Write every (count / most)-th point to `fragment` (most, 3); return how many."""
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
def disagreement(fragment, n, cloud, normals, grid, origin, cell, margin, graph, scale, R, t,
                 step, limit, depth, first, width, height, K, T_camera_world, C):
    """
    Return (forward, backward), mean truncated residuals in 0..1 of fragment and model.

    Forward: distance of each fragment point to the model. Backward: of each step-th model
    point and view that it faces, the distance along the optical axis to what was measured at
    its pixel. Points that something nearer hides say nothing; points in front of the measured
    surface contradict it at full weight.

    :param scale: model units to metres; R, t: T_world_model after the scale.
    :param limit: truncation, metres.
    :param depth: (P,) float32 measured depth of all views, NaN = none.
    :param C: (views, 3) the cameras' places in the world.
    """
    forward = 0.0
    for i in range(n):
        dx, dy, dz = fragment[i, 0] - t[0], fragment[i, 1] - t[1], fragment[i, 2] - t[2]
        m, d2 = icp.nearest(
            (R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz) / scale,
            (R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz) / scale,
            (R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz) / scale,
            cloud, grid, origin, cell, margin, graph, limit / scale)
        forward += 1.0 if m < 0 else np.sqrt(d2) * scale / limit
    backward, seen = 0.0, 0
    for m in range(0, cloud.shape[0], step):
        q, n_model = cloud[m], normals[m]
        px = scale * (R[0, 0] * q[0] + R[0, 1] * q[1] + R[0, 2] * q[2]) + t[0]
        py = scale * (R[1, 0] * q[0] + R[1, 1] * q[1] + R[1, 2] * q[2]) + t[1]
        pz = scale * (R[2, 0] * q[0] + R[2, 1] * q[1] + R[2, 2] * q[2]) + t[2]
        nx = R[0, 0] * n_model[0] + R[0, 1] * n_model[1] + R[0, 2] * n_model[2]
        ny = R[1, 0] * n_model[0] + R[1, 1] * n_model[1] + R[1, 2] * n_model[2]
        nz = R[2, 0] * n_model[0] + R[2, 1] * n_model[1] + R[2, 2] * n_model[2]
        for v in range(first.shape[0]):
            if nx * (C[v, 0] - px) + ny * (C[v, 1] - py) + nz * (C[v, 2] - pz) <= 0.0:
                continue
            T = T_camera_world[v]
            z = T[2, 0] * px + T[2, 1] * py + T[2, 2] * pz + T[2, 3]
            if z <= NEAR_M:
                continue
            x = T[0, 0] * px + T[0, 1] * py + T[0, 2] * pz + T[0, 3]
            y = T[1, 0] * px + T[1, 1] * py + T[1, 2] * pz + T[1, 3]
            i = int(np.floor(K[v, 0, 0] * x / z + K[v, 0, 2] + 0.5))
            j = int(np.floor(K[v, 1, 1] * y / z + K[v, 1, 2] + 0.5))
            if i < 0 or j < 0 or i >= width[v] or j >= height[v]:
                continue
            behind = z - depth[first[v] + j * width[v] + i]
            if not behind <= limit:
                continue
            seen += 1
            backward += min(abs(behind) / limit, 1.0)
    return forward / max(n, 1), backward / seen if seen else 1.0


@nb.njit(cache=True)
def propose(drawn, half, p, least, row, points, offset, R0, shift, scale, reach, coarse, passes,
            most, fewest, limit, score_step, cloud, normals, grid, origin, cell, margin, graph,
            depth, first, width, height, K, T_camera_world, C):
    """
    Cut out a fragment for every drawn pixel, align the model with it and score the two.

    :param drawn: (m,) int32 rows of the central pixels; `half` (m,) metres; `p` (M,) uint8
        probability of the category; `least` (m,) what counts as likely.
    :param R0: (m, 3, 3) start, world from model; `shift` (m, 3) metres from the fragment's
        centroid; `scale` (m,).
    :param reach: (2,) model units, pairs of the coarse and the fine passes; `coarse`: number
        of fragment points of the coarse passes; `passes` (2,) iterations.
    :return: (R (m, 3, 3), t (m, 3), score (m,) in 0..1, -1 where the fragment is too small).
    """
    m = drawn.shape[0]
    R, t, score = np.zeros((m, 3, 3)), np.zeros((m, 3)), np.full(m, -1.0)
    no_graph = np.zeros((cloud.shape[0], 0), np.int32)
    found = np.empty(points.shape[0], np.int32)
    for i in range(m):
        count, pixels = collect(points[drawn[i]], half[i], p, least[i], row, first, width,
                                height, K, T_camera_world, points, found)
        if pixels < fewest or count < 6:
            continue
        fragment = np.empty((most, 3))
        n = thin(found, count, most, offset[i], points, fragment)
        # Align in the model's own units: the fragment shrinks instead of the model growing.
        source = np.empty((n, 3))
        middle = np.zeros(3)
        for k in range(n):
            for c in range(3):
                source[k, c] = fragment[k, c] / scale[i]
                middle[c] += source[k, c] / n
        Q, q = np.empty((3, 3)), np.empty(3)
        for a in range(3):
            for b in range(3):
                Q[a, b] = R0[i, b, a]
        for c in range(3):
            q[c] = 0.0
            for b in range(3):
                q[c] -= Q[c, b] * (middle[b] + shift[i, b] / scale[i])
        icp.align(source, max(1, n // coarse), cloud, normals, grid, origin, cell, margin,
                  no_graph, Q, q, reach[0], passes[0], False, 1e-2)
        icp.align(source, 1, cloud, normals, grid, origin, cell, margin, graph, Q, q, reach[1],
                  passes[1], True, 1e-3)
        for a in range(3):
            for b in range(3):
                R[i, a, b] = Q[b, a]
        for a in range(3):
            for b in range(3):
                t[i, a] -= scale[i] * R[i, a, b] * q[b]
        forward, backward = disagreement(
            fragment, n, cloud, normals, grid, origin, cell, margin, graph, scale[i], R[i], t[i],
            score_step, limit, depth, first, width, height, K, T_camera_world, C)
        score[i] = 1.0 - 0.5 * (forward + backward)
    return R, t, score
