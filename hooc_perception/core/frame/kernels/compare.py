# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Render hypotheses into all views at once and hold them against what was measured."""

from hooc_perception.core.hypotheses.kernels.hypotheses import rotation_of
from hooc_perception.core.kernels import raster
from hooc_perception.core.kernels.gauss_newton import accumulate, pulled, SCALES, stepped
import numba as nb
import numpy as np

# Columns of the statistics of one hypothesis.
(SHOWN, AGREE, GAIN, VIOLATE, BEHIND, MISSING, SHARE, UNLIKELINESS, COS, RESIDUAL, DELTA,
 VIEWS) = range(12)
STATS = 12
# Probability 0..255 as a cost: 1 at 2 % and less.
UNLIKELY = np.minimum(1.0, -np.log(np.maximum(np.arange(256) / 255.0, 0.002)) / 4.0)


@nb.njit(cache=True, inline='always')
def posed(h, vertices, out):
    """Write the world vertices (V, 3) of hypothesis `h` (translation, xyzw, scale) into out."""
    R = np.empty((3, 3))
    rotation_of(h, R)
    for i in range(vertices.shape[0]):
        x, y, z = vertices[i, 0] * h[7], vertices[i, 1] * h[8], vertices[i, 2] * h[9]
        for k in range(3):
            out[i, k] = R[k, 0] * x + R[k, 1] * y + R[k, 2] * z + h[k]


@nb.njit(cache=True, inline='always')
def pixel_cost(z, d, foreground, cosine, unlikely, tolerance, w_normal, w_class, w_free):
    """
    Return (cost, state) of showing depth z where d was measured.

    `unlikely` is 0 where the classifier is sure of the category and 1 where it rules it out.
    An unexplained foreground pixel costs 1, seen table 0. State: 1 agrees, 2 seen through,
    3 behind what is measured.
    """
    off = (z - d) / tolerance
    size = min(1.0, abs(off))
    if not foreground:
        # Table or room was measured through the object.
        return w_free * size, 2
    if size >= 1.0:
        return (1.0 if off > 0 else 0.5 + 0.5 * w_free) + 0.5 * w_class, 3 if off > 0 else 2
    return (size + w_normal * (1.0 - max(0.0, cosine))
            + w_class * unlikely), 1


@nb.njit(cache=True, error_model='numpy')
def explain_one(h, category, vertices, faces, closed, me, context, K, R_cw, t_cw, size, first,
                depth, foreground, normals, patch, patch_size, p, p_row, tolerance, w_normal,
                w_class, w_free, stats, pull, emit_at, out_pixel, out_depth, out_cost):
    """
    Hold one hypothesis against every view.

    :param closed: whether only the faces towards the camera are drawn, see raster.draw.
    :param context: what is shown already: tuple of (P,) arrays owner int32, depth float32, cost
        float32 of the nearest member and depth, cost of the next one; inf and the cost of
        showing nothing where there is none. Only pixels where the hypothesis is nearer count.
    :param me: the hypothesis' own number in `context`, which is looked through; -1 = none.
    :param size: (views, 2) int64 width, height; first (views + 1,) first pixel of each view.
    :param depth: (P,) float32 measured, NaN none; foreground (P,) bool; normals (P, 3) float32;
        patch (P,) int32, -1 none; patch_size (patches,) pixels over all views, empty where
        nobody asks for SHARE.
    :param p: (M, N + 1) uint8, p_row (P,) int32 row of a pixel or -1.
    :param stats: (STATS,) float64, filled.
    :param pull: (9, 10) float64, filled with the equations of kernels/pull.py; empty: not asked.
    :param emit_at: -1, or where to write the pixel lists in out_*.
    :return: number of pixels with a reading that it covers.
    """
    owner, depth_1, cost_1, depth_2, cost_2 = context
    world = np.empty(vertices.shape)
    posed(h, vertices, world)
    stats[:] = 0.0
    pull[:] = 0.0
    R = np.empty((3, 3))
    rotation_of(h, R)
    n = 0
    touched = np.empty(64, np.int64)
    hits = np.zeros(64)
    n_touched = 0
    for v in range(K.shape[0]):
        agreed = stats[AGREE]
        w = size[v, 0]
        uvz, (u0, v0, u1, v1) = raster.in_view(world, R_cw[v], t_cw[v], K[v], size[v])
        if u1 <= u0 or v1 <= v0:
            continue
        z = np.full((v1 - v0, u1 - u0), np.inf, np.float32)
        face = np.zeros(z.shape, np.int32)
        raster.draw(uvz, faces, -1, u0, v0, z, face, closed)
        cam = -(R_cw[v].T @ t_cw[v])
        for y in range(v1 - v0):
            for x in range(u1 - u0):
                if z[y, x] == np.inf:
                    continue
                i = first[v] + (y + v0) * w + x + u0
                if owner[i] == me:
                    before, base = depth_2[i], cost_2[i]
                else:
                    before, base = depth_1[i], cost_1[i]
                stats[SHOWN] += 1
                if before < z[y, x]:
                    stats[BEHIND] += 1
                    continue
                d = depth[i]
                if not d > 0:
                    stats[MISSING] += 1
                    continue
                cosine = 1.0
                if foreground[i] and normals[i, 0] == normals[i, 0]:
                    a, b, c = faces[face[y, x], 0], faces[face[y, x], 1], faces[face[y, x], 2]
                    e0, e1, e2 = (world[b, 0] - world[a, 0], world[b, 1] - world[a, 1],
                                  world[b, 2] - world[a, 2])
                    f0, f1, f2 = (world[c, 0] - world[a, 0], world[c, 1] - world[a, 1],
                                  world[c, 2] - world[a, 2])
                    n0, n1, n2 = e1 * f2 - e2 * f1, e2 * f0 - e0 * f2, e0 * f1 - e1 * f0
                    norm = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2) + 1e-20
                    # Both sides are drawn: the facing side is the one towards the camera.
                    if (n0 * (cam[0] - world[a, 0]) + n1 * (cam[1] - world[a, 1])
                            + n2 * (cam[2] - world[a, 2])) < 0:
                        norm = -norm
                    cosine = (n0 * normals[i, 0] + n1 * normals[i, 1]
                              + n2 * normals[i, 2]) / norm
                unlikely = 1.0
                if p_row[i] >= 0:
                    unlikely = UNLIKELY[p[p_row[i], category]]
                cost, state = pixel_cost(z[y, x], d, foreground[i], cosine, unlikely, tolerance,
                                         w_normal, w_class, w_free)
                stats[DELTA] += cost - base
                if emit_at >= 0:
                    out_pixel[emit_at + n] = i
                    out_depth[emit_at + n] = z[y, x]
                    out_cost[emit_at + n] = cost
                n += 1
                if state == 1:
                    stats[AGREE] += 1
                    stats[GAIN] += 1.0 - cost
                    stats[COS] += cosine
                    stats[RESIDUAL] += abs(z[y, x] - d)
                    stats[UNLIKELINESS] += unlikely
                    if pull.shape[0] and cosine > 0.3 and normals[i, 0] == normals[i, 0]:
                        # Along the ray of the pixel from the camera's centre.
                        a0 = (x + u0 - K[v, 0, 2]) / K[v, 0, 0]
                        a1 = (y + v0 - K[v, 1, 2]) / K[v, 1, 1]
                        r0 = R_cw[v, 0, 0] * a0 + R_cw[v, 1, 0] * a1 + R_cw[v, 2, 0]
                        r1 = R_cw[v, 0, 1] * a0 + R_cw[v, 1, 1] * a1 + R_cw[v, 2, 1]
                        r2 = R_cw[v, 0, 2] * a0 + R_cw[v, 1, 2] * a1 + R_cw[v, 2, 2]
                        off = z[y, x] - d
                        slope = (r0 * normals[i, 0] + r1 * normals[i, 1] + r2 * normals[i, 2])
                        accumulate(pull, h, R, cam[0] + r0 * z[y, x], cam[1] + r1 * z[y, x],
                                   cam[2] + r2 * z[y, x], normals[i, 0], normals[i, 1],
                                   normals[i, 2], slope * off,
                                   cosine / (abs(off) / tolerance + 0.2))
                    s = patch[i] if len(patch_size) else -1
                    if s >= 0:
                        for k in range(n_touched):
                            if touched[k] == s:
                                hits[k] += 1
                                break
                        else:
                            if n_touched < 64:
                                touched[n_touched] = s
                                hits[n_touched] = 1
                                n_touched += 1
                elif state == 2:
                    stats[VIOLATE] += cost if not foreground[i] else 1.0
                else:
                    stats[BEHIND] += 1
        if stats[AGREE] > agreed:
            stats[VIEWS] += 1
    total = 0.0
    for k in range(n_touched):
        stats[SHARE] += hits[k] * min(1.0, hits[k] / patch_size[touched[k]])
        total += hits[k]
    if total > 0:
        stats[SHARE] /= total
    return n


@nb.njit(cache=True, parallel=True)
def explain_all(H, category, me, vertices, vertex_start, faces, face_start, closed, context, K,
                R_cw, t_cw, size, first, depth, foreground, normals, patch, patch_size, p, p_row,
                tolerance, w_normal, w_class, w_free, emit_at, out_pixel, out_depth, out_cost):
    """
    Run explain_one for every hypothesis (m, 10).

    :param category: (m,) class ids; meshes are concatenated, with faces relative to their own
        first vertex: vertices[vertex_start[c - 1]:vertex_start[c]]; closed (categories,) bool.
    :param emit_at: (m,) int64, where each writes its pixel lists; -1 = not at all.
    :return: (stats (m, STATS), n (m,)).
    """
    m = H.shape[0]
    stats = np.zeros((m, STATS))
    n = np.zeros(m, np.int64)
    for k in nb.prange(m):
        c = category[k]
        n[k] = explain_one(
            H[k], c, vertices[vertex_start[c - 1]:vertex_start[c]],
            faces[face_start[c - 1]:face_start[c]], closed[c - 1], me[k], context, K, R_cw, t_cw,
            size, first, depth, foreground, normals, patch, patch_size, p, p_row, tolerance,
            w_normal, w_class, w_free, stats[k], np.empty((0, 0)), emit_at[k], out_pixel,
            out_depth, out_cost)
    return stats, n


@nb.njit(cache=True, parallel=True)
def polish_all(seeds, H, category, me, vertices, vertex_start, faces, face_start, closed,
               context, K, R_cw, t_cw, size, first, depth, foreground, normals, patch,
               patch_size, p, p_row, tolerance, w_normal, w_class, w_free, complexity, prior,
               n_steps, sigma_t, sigma_r, sigma_s):
    """
    Climb with every hypothesis (m, 10), in place, against the images.

    Random steps of adapting length, and after each that helped pulls until they help no more.

    What falls is the cost of the scene with the hypothesis in `context` instead of its old self
    `me`, plus complexity x the pixels it covers, plus a prior on its scale.

    :return: (m,) float64 the cost reached.
    """
    m = H.shape[0]
    reached = np.zeros(m)
    for k in nb.prange(m):
        np.random.seed(seeds[k])
        c = category[k]
        V = vertices[vertex_start[c - 1]:vertex_start[c]]
        F = faces[face_start[c - 1]:face_start[c]]
        stats, trial, q = np.empty(STATS), np.empty(10), np.empty(4)
        here, there = np.zeros((9, 10)), np.zeros((9, 10))
        none_i, none_f = np.empty(0, np.int64), np.empty(0, np.float32)
        no_patches = np.empty(0, np.int64)
        step, best, agreeing, fresh = 1.0, np.inf, 0.0, False
        for i in range(n_steps + 1):
            trial[:] = H[k]
            pulls = fresh
            if pulls:
                pulled(here, agreeing, H[k], prior * agreeing * tolerance * tolerance, *SCALES,
                       trial)
                fresh = False
            elif i > 0:
                stepped(sigma_t, sigma_r, sigma_s, step, 1.0, q, trial)
            explain_one(trial, c, V, F, closed[c - 1], me[k], context, K, R_cw, t_cw, size,
                        first, depth, foreground, normals, patch, no_patches, p, p_row,
                        tolerance, w_normal, w_class, w_free, stats, there, -1, none_i,
                        none_f, none_f)
            a, b, d = np.log(trial[7]), np.log(trial[8]), np.log(trial[9])
            value = stats[DELTA] + stats[SHOWN] * (
                complexity + prior * (a * a + b * b + d * d))
            if value < best:
                best = value
                H[k] = trial
                here, there = there, here
                agreeing, fresh = stats[AGREE], stats[AGREE] > 20
                if not pulls:
                    step = min(2.0, step * 1.3)
            elif not pulls:
                step = max(0.05, step * 0.93)
        reached[k] = best
    return reached
