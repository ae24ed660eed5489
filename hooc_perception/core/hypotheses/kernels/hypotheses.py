# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Sample, score and refine posed, scaled models against the fused field.

A hypothesis is 10 numbers: translation (3, metres), quaternion xyzw (4), scale per model axis
(3, relative to the generic model).
"""

from hooc_perception.core.kernels.gauss_newton import accumulate, multiply, pulled, SCALES, stepped
import numba as nb
import numpy as np

# Least mean of a few points in the quick field: a visible fifth of a model reaches it.
QUICK_MEAN = 12.0
SHELL_M = 0.014
# What 255 in channel 0 of the field stands for.
TRUNCATION_M = 0.02
# The best of every patch of table are kept, so that no part of a scene crowds out the rest.
CELL_M = 0.04
PER_CELL = 4
TRANSLATION, QUATERNION, SCALE = 0, 3, 7
WIDTH = 10


@nb.njit(cache=True, inline='always')
def rotation_of(h, R):
    """Write the rotation matrix of hypothesis `h` into R (3, 3)."""
    x, y, z, w = h[3], h[4], h[5], h[6]
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@nb.njit(cache=True, error_model='numpy')
def evidence(h, points, normals, first, last, field, origin, voxel, R, pull):
    """
    Return (agree, violate, shell) summed over model points first..last - 1 of hypothesis `h`.

    A point on the seen surface with the same facing counts up to 1; a point in space that some
    view sees through, or under the table, counts up to 1 against; hidden points count nothing.
    A point of the former kind without air before it counts up to 1 in `shell`.

    :param pull: (9, 10) float64, filled with the equations of kernels/pull.py; empty: not asked.
    """
    rotation_of(h, R)
    pull[:] = 0.0
    plane = TRUNCATION_M / 127.0
    nx, ny, nz = field.shape[:3]
    inv = 1.0 / voxel
    ox, oy, oz = (h[0] - origin[0]) * inv, (h[1] - origin[1]) * inv, (h[2] - origin[2]) * inv
    px, py, pz = h[7] * inv, h[8] * inv, h[9] * inv
    qx, qy, qz = 1.0 / h[7], 1.0 / h[8], 1.0 / h[9]
    reach = SHELL_M * inv
    # Under the table by more than a centimetre nothing can be.
    lowest = (-0.010 - origin[2]) * inv
    agree = 0.0
    violate = 0.0
    shell = 0.0
    for k in range(first, last):
        x, y, z = points[k, 0] * px, points[k, 1] * py, points[k, 2] * pz
        gz = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + oz
        if gz < lowest:
            violate += 1.0
            continue
        gx = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + ox
        gy = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + oy
        if not (0.0 <= gx < nx and 0.0 <= gy < ny and 0.0 <= gz < nz):
            violate += 0.7
            continue
        ix, iy, iz = int(gx), int(gy), int(gz)
        d = field[ix, iy, iz, 0]
        f = field[ix, iy, iz, 1]
        if f > 0 and d > 100:
            violate += f / 255.0 * min(1.0, (d - 100) / 100.0)
        a, b, c = normals[k, 0] * qx, normals[k, 1] * qy, normals[k, 2] * qz
        n = 1.0 / np.sqrt(a * a + b * b + c * c + 1e-20)
        a, b, c = a * n, b * n, c * n
        wx = R[0, 0] * a + R[0, 1] * b + R[0, 2] * c
        wy = R[1, 0] * a + R[1, 1] * b + R[1, 2] * c
        wz = R[2, 0] * a + R[2, 1] * b + R[2, 2] * c
        if d < 255:
            u = (field[ix, iy, iz, 2] - 128.0) / 127.0
            v = (field[ix, iy, iz, 3] - 128.0) / 127.0
            w = (field[ix, iy, iz, 4] - 128.0) / 127.0
            dot = wx * u + wy * v + wz * w
            if dot > 0:
                e = d / 255.0
                agree += (1.0 - e * e) * min(1.0, dot)
                if pull.shape[0] and dot > 0.3:
                    height = ((field[ix, iy, iz, 5] - 128.0) * plane
                              + voxel * (u * (gx - ix - 0.5) + v * (gy - iy - 0.5)
                                         + w * (gz - iz - 0.5)))
                    accumulate(pull, h, R, gx * voxel + origin[0], gy * voxel + origin[1],
                               gz * voxel + origin[2], u, v, w, height, min(1.0, dot))
        # Just outside of the model there should be air: else it lies inside a larger thing.
        gx, gy, gz = gx + reach * wx, gy + reach * wy, gz + reach * wz
        if 0.0 <= gx < nx and 0.0 <= gy < ny and 0.0 <= gz < nz:
            ds = field[int(gx), int(gy), int(gz), 0]
            if ds < 90:
                shell += 1.0 - ds / 90.0
    return agree, violate, shell


@nb.njit(cache=True)
def quick_field(field):
    """Return (X, Y, Z) int8: 100 on the seen surface, 0 hidden, -100 in space seen through."""
    out = np.zeros(field.shape[:3], np.int8)
    for x in range(field.shape[0]):
        for y in range(field.shape[1]):
            for z in range(field.shape[2]):
                d, f = field[x, y, z, 0], field[x, y, z, 1]
                if d < 255:
                    out[x, y, z] = np.int8(100 * (1.0 - (d / 255.0) ** 2))
                elif f > 0:
                    out[x, y, z] = -np.int8(100 * (f / 255.0))
    return out


@nb.njit(cache=True, error_model='numpy')
def quick(h, points, n, coarse, origin, voxel, R):
    """Return the sum of `coarse` over the first n model points of hypothesis `h`."""
    rotation_of(h, R)
    nx, ny, nz = coarse.shape
    inv = 1.0 / voxel
    ox, oy, oz = (h[0] - origin[0]) * inv, (h[1] - origin[1]) * inv, (h[2] - origin[2]) * inv
    px, py, pz = h[7] * inv, h[8] * inv, h[9] * inv
    total = 0.0
    for k in range(n):
        x, y, z = points[k, 0] * px, points[k, 1] * py, points[k, 2] * pz
        gx = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + ox
        gy = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + oy
        gz = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + oz
        if 0.0 <= gx < nx and 0.0 <= gy < ny and 0.0 <= gz < nz:
            total += coarse[int(gx), int(gy), int(gz)]
        else:
            total -= 70.0
    return total


@nb.njit(cache=True)
def value(h, points, normals, n, field, origin, voxel, free_weight, shell_weight, prior, R,
          pull):
    """Return the score of a hypothesis: mean evidence, weighed by its size, minus priors."""
    agree, violate, shell = evidence(h, points, normals, 0, n, field, origin, voxel, R, pull)
    area = (h[7] * h[8] + h[8] * h[9] + h[7] * h[9]) / 3.0
    a, b, c = np.log(h[7]), np.log(h[8]), np.log(h[9])
    return ((agree - free_weight * violate - shell_weight * shell) / n * area / (area + 0.5) * 1.5
            - prior * (a * a + b * b + c * c))


@nb.njit(cache=True)
def _draw_pose(h, model_points, model_normals, rest, rest_cdf, scene_points, scene_normals, i,
               size_sigma, general, q):
    """Fill `h` so that one model point lies on scene point i with the same facing."""
    iso = np.exp(np.random.normal() * size_sigma)
    for k in range(3):
        h[7 + k] = min(1.8, max(0.5, iso * np.exp(np.random.normal() * 0.6 * size_sigma)))
    nsx, nsy, nsz = scene_normals[i, 0], scene_normals[i, 1], scene_normals[i, 2]
    R = np.empty((3, 3))
    upright = np.random.random() >= general
    h[3], h[4], h[5], h[6] = 0.0, 0.0, 0.0, 1.0
    if upright:
        r = np.searchsorted(rest_cdf, np.random.random() * rest_cdf[-1])
        r = min(r, rest.shape[0] - 1)
        for k in range(4):
            h[3 + k] = rest[r, k]
        # A resting pose with some slack, as rough models and leaning objects need.
        tilt = 0.06 if np.random.random() < 0.7 else 0.3
        q[0], q[1], q[2], q[3] = (np.random.normal() * tilt / 2, np.random.normal() * tilt / 2,
                                  0.0, 1.0)
        multiply(q, h[3:7], h[3:7])
    rotation_of(h, R)
    j = 0
    mx = my = mz = 0.0
    for _ in range(12):
        j = np.random.randint(0, model_points.shape[0])
        a, b, c = (model_normals[j, 0] / h[7], model_normals[j, 1] / h[8],
                   model_normals[j, 2] / h[9])
        norm = 1.0 / np.sqrt(a * a + b * b + c * c + 1e-20)
        mx = norm * (R[0, 0] * a + R[0, 1] * b + R[0, 2] * c)
        my = norm * (R[1, 0] * a + R[1, 1] * b + R[1, 2] * c)
        mz = norm * (R[2, 0] * a + R[2, 1] * b + R[2, 2] * c)
        if not upright or abs(mz - nsz) < 0.2:
            break
    if upright:
        if mx * mx + my * my > 0.1 and nsx * nsx + nsy * nsy > 0.1:
            yaw = (np.arctan2(nsy, nsx) - np.arctan2(my, mx) + np.random.normal() * 0.1)
        else:
            yaw = np.random.random() * 2 * np.pi
        q[0], q[1], q[2], q[3] = 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)
        multiply(q, h[3:7], h[3:7])
    else:
        # Shortest rotation from the model's normal to the scene's, then a spin around it.
        cx, cy, cz = my * nsz - mz * nsy, mz * nsx - mx * nsz, mx * nsy - my * nsx
        dot = mx * nsx + my * nsy + mz * nsz
        if dot < -0.999:
            # Half a turn about anything across the normal.
            n = np.sqrt(mx * mx + my * my)
            if n > 0.1:
                q[0], q[1], q[2], q[3] = -my / n, mx / n, 0.0, 0.0
            else:
                q[0], q[1], q[2], q[3] = 1.0, 0.0, 0.0, 0.0
        else:
            n = 1.0 / np.sqrt(cx * cx + cy * cy + cz * cz + (1 + dot) * (1 + dot))
            q[0], q[1], q[2], q[3] = cx * n, cy * n, cz * n, (1 + dot) * n
        multiply(q, h[3:7], h[3:7])
        spin = np.random.random() * np.pi
        q[0], q[1], q[2], q[3] = (nsx * np.sin(spin), nsy * np.sin(spin), nsz * np.sin(spin),
                                  np.cos(spin))
        multiply(q, h[3:7], h[3:7])
    rotation_of(h, R)
    x, y, z = (model_points[j, 0] * h[7], model_points[j, 1] * h[8], model_points[j, 2] * h[9])
    h[0] = scene_points[i, 0] - (R[0, 0] * x + R[0, 1] * y + R[0, 2] * z)
    h[1] = scene_points[i, 1] - (R[1, 0] * x + R[1, 1] * y + R[1, 2] * z)
    h[2] = scene_points[i, 2] - (R[2, 0] * x + R[2, 1] * y + R[2, 2] * z)


@nb.njit(cache=True)
def sample(seed, n_samples, keep, model_points, model_normals, rest, rest_cdf, scene_points,
           scene_normals, scene_cdf, field, coarse, origin, voxel, free_weight, shell_weight,
           prior, size_sigma, general, n_first, n_points):
    """
    Draw hypotheses that put a model point on a scene point; return the best (keep, 11).

    The last column is the score, descending order is not kept. Rows that were never filled
    have score -inf. One seed, one result, whatever the thread.
    """
    np.random.seed(seed)
    np_x = int(field.shape[0] * voxel / CELL_M) + 1
    np_y = int(field.shape[1] * voxel / CELL_M) + 1
    slots = np.full((np_x * np_y, PER_CELL, WIDTH + 1), -np.inf)
    h = np.empty(WIDTH)
    q, R, no_pull = np.empty(4), np.empty((3, 3)), np.empty((0, 0))
    for _ in range(n_samples):
        i = np.searchsorted(scene_cdf, np.random.random() * scene_cdf[-1])
        i = min(i, scene_points.shape[0] - 1)
        _draw_pose(h, model_points, model_normals, rest, rest_cdf, scene_points, scene_normals,
                   i, size_sigma, general, q)
        # Most draws are hopeless, and a few points in a field that fits the cache tell.
        if quick(h, model_points, n_first, coarse, origin, voxel, R) < QUICK_MEAN * n_first:
            continue
        score = value(h, model_points, model_normals, n_points, field, origin, voxel,
                      free_weight, shell_weight, prior, R, no_pull)
        x = min(np_x - 1, max(0, int((h[0] - origin[0]) / CELL_M)))
        y = min(np_y - 1, max(0, int((h[1] - origin[1]) / CELL_M)))
        cell = slots[x * np_y + y]
        worst = 0
        for k in range(1, PER_CELL):
            if cell[k, WIDTH] < cell[worst, WIDTH]:
                worst = k
        if score > cell[worst, WIDTH]:
            cell[worst, :WIDTH] = h
            cell[worst, WIDTH] = score
    flat = slots.reshape(-1, WIDTH + 1)
    order = np.argsort(-flat[:, WIDTH])
    out = np.full((keep, WIDTH + 1), -np.inf)
    for k in range(min(keep, flat.shape[0])):
        out[k] = flat[order[k]]
    return out


@nb.njit(cache=True)
def refine(seed, h, points, normals, n, field, origin, voxel, free_weight, shell_weight,
           prior, n_steps, sigma_t, sigma_r, sigma_s):
    """
    Climb from hypothesis `h` (in place) by pulls and random steps; return the score.

    A (1+1) evolution strategy with the 1/5 success rule sees all of the score, a pull
    (kernels/pull.py) follows each of its gains until it helps no more.
    """
    np.random.seed(seed)
    R, q = np.empty((3, 3)), np.empty(4)
    here, there = np.zeros((9, 10)), np.zeros((9, 10))
    best = value(h, points, normals, n, field, origin, voxel, free_weight, shell_weight, prior, R,
                 here)
    trial = np.empty(WIDTH)
    step, fresh = 1.0, True
    for _ in range(n_steps):
        trial[:] = h
        pulls = fresh
        if pulls:
            pulled(here, n, h, prior * n * TRUNCATION_M * TRUNCATION_M, *SCALES, trial)
            fresh = False
        else:
            stepped(sigma_t, sigma_r, sigma_s, step, 2.0, q, trial)
        score = value(trial, points, normals, n, field, origin, voxel, free_weight,
                      shell_weight, prior, R, there)
        if score > best:
            best = score
            h[:] = trial
            here, there = there, here
            fresh = True
            if not pulls:
                step = min(2.0, step * 1.3)
        elif not pulls:
            step = max(0.05, step * 0.95)
    return best


@nb.njit(cache=True, parallel=True)
def refine_all(seeds, hypotheses, model_of, points, normals, n, field, origin, voxel,
               free_weight, shell_weight, prior, n_steps, sigma_t, sigma_r, sigma_s):
    """
    Refine every row of `hypotheses` (m, 11) in place, last column the score.

    :param model_of: (m,) int64 index into points / normals (models, P, 3).
    """
    for k in nb.prange(hypotheses.shape[0]):
        c = model_of[k]
        hypotheses[k, WIDTH] = refine(
            seeds[k], hypotheses[k, :WIDTH], points[c], normals[c], n, field, origin, voxel,
            free_weight, shell_weight, prior, n_steps, sigma_t, sigma_r, sigma_s)


@nb.njit(cache=True, parallel=True)
def sample_all(seeds, n_samples, keep, points, normals, rest, rest_cdf, scene_points,
               scene_normals, scene_cdf, field, coarse, origin, voxel, free_weight, shell_weight,
           prior, size_sigma, general, n_first, n_points):
    """
    Run `sample` for every model.

    :param points: (models, P, 3); rest (models, R, 4), rest_cdf (models, R), scene_cdf
        (models, n): cumulative weights.
    :return: (models, keep, 11).
    """
    out = np.empty((points.shape[0], keep, WIDTH + 1))
    for c in nb.prange(points.shape[0]):
        out[c] = sample(seeds[c], n_samples, keep, points[c], normals[c], rest[c], rest_cdf[c],
                        scene_points, scene_normals, scene_cdf[c], field, coarse, origin, voxel,
                        free_weight, shell_weight, prior, size_sigma, general, n_first, n_points)
    return out
