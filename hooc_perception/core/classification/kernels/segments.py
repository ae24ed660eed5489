# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Voxel graph of the foreground, its convex segments, and their shape measures."""

from hooc_perception.core.classification.kernels.texture import normal_shape
from hooc_perception.core.frame.kernels.patches import root
import numba as nb
import numpy as np

SEGMENT_FEATURES = 40
SLICES = 6


@nb.njit(cache=True)
def voxelise(points, normals, origin, cell, shape):
    """
    Return (voxel of each point (n,) int32, mean points (m, 3), unit normals (m, 3), grid).

    Voxels are numbered in the order in which points first fall into them; `grid` is
    (nx, ny, nz) int32, -1 = empty.
    """
    grid = np.full(shape, -1, np.int32)
    voxel = np.empty(points.shape[0], np.int32)
    m = 0
    for i in range(points.shape[0]):
        a = min(max(int((points[i, 0] - origin[0]) / cell), 0), shape[0] - 1)
        b = min(max(int((points[i, 1] - origin[1]) / cell), 0), shape[1] - 1)
        c = min(max(int((points[i, 2] - origin[2]) / cell), 0), shape[2] - 1)
        if grid[a, b, c] < 0:
            grid[a, b, c] = m
            m += 1
        voxel[i] = grid[a, b, c]
    mean = np.zeros((m, 3))
    normal = np.zeros((m, 3))
    count = np.zeros(m)
    for i in range(points.shape[0]):
        v = voxel[i]
        count[v] += 1
        for k in range(3):
            mean[v, k] += points[i, k]
            normal[v, k] += normals[i, k]
    for v in range(m):
        length = np.sqrt(normal[v, 0] ** 2 + normal[v, 1] ** 2 + normal[v, 2] ** 2) + 1e-12
        for k in range(3):
            mean[v, k] /= count[v]
            normal[v, k] /= length
    return voxel, mean, normal, grid


@nb.njit(cache=True)
def edges(mean, normal, grid, origin, cell):
    """
    Return (pairs (e, 2) int32, weight (e,) float32) of voxels that touch (5^3 neighbours).

    The weight is the concave angle between the two surfaces (radians, 0 for a convex or flat
    joint; cf. LCCP, Stein et al. 2014), half of it averaged over all joints of both voxels
    because single normals are noisy; plus shares of the angle between the normals and of the
    distance, so that smooth and close joints close first. The shares maximised the overlap
    of segments with objects.
    """
    pairs = np.empty((mean.shape[0] * 40, 2), np.int32)
    weight = np.empty(mean.shape[0] * 40, np.float32)
    valley = np.empty(mean.shape[0] * 40, np.float32)
    total = np.zeros(mean.shape[0], np.float32)
    degree = np.zeros(mean.shape[0], np.float32)
    e = 0
    nx, ny, nz = grid.shape
    for v in range(mean.shape[0]):
        a = min(max(int((mean[v, 0] - origin[0]) / cell), 0), nx - 1)
        b = min(max(int((mean[v, 1] - origin[1]) / cell), 0), ny - 1)
        c = min(max(int((mean[v, 2] - origin[2]) / cell), 0), nz - 1)
        for i in range(max(0, a - 2), min(nx, a + 3)):
            for j in range(max(0, b - 2), min(ny, b + 3)):
                for k in range(max(0, c - 2), min(nz, c + 3)):
                    w = grid[i, j, k]
                    if w <= v or e >= weight.shape[0]:
                        continue
                    dx, dy, dz = (mean[w, 0] - mean[v, 0], mean[w, 1] - mean[v, 1],
                                  mean[w, 2] - mean[v, 2])
                    d = np.sqrt(dx * dx + dy * dy + dz * dz)
                    if d > 2.2 * cell or d < 1e-9:
                        continue
                    pv = (normal[v, 0] * dx + normal[v, 1] * dy + normal[v, 2] * dz) / d
                    pw = (normal[w, 0] * dx + normal[w, 1] * dy + normal[w, 2] * dz) / d
                    dot = (normal[v, 0] * normal[w, 0] + normal[v, 1] * normal[w, 1]
                           + normal[v, 2] * normal[w, 2])
                    bend = np.arccos(min(1.0, max(-1.0, dot)))
                    # Normals that turn towards each other: pv > 0 or pw < 0 is a valley.
                    concave = min(bend, max(0.0, pv - pw))
                    # Seen from opposite sides, a thin sheet: no valley between them.
                    if dot < -0.5:
                        concave = 0.0
                    pairs[e, 0], pairs[e, 1] = v, w
                    valley[e] = concave
                    weight[e] = 0.05 * bend + 0.2 * d / cell
                    total[v] += concave
                    total[w] += concave
                    degree[v] += 1
                    degree[w] += 1
                    e += 1
    for i in range(e):
        v, w = pairs[i, 0], pairs[i, 1]
        weight[i] += 0.5 * valley[i] + 0.25 * (total[v] / degree[v] + total[w] / degree[w])
    return pairs[:e], weight[:e]


@nb.njit(cache=True)
def segment(n, pairs, weight, order, k, smallest):
    """
    Return (n,) int32 segment ids 0.. by graph merging (Felzenszwalb and Huttenlocher 2004).

    :param order: edge indices by ascending weight.
    :param k: a segment of s voxels joins another over an edge of at most its largest inner
        edge + k / s.
    :param smallest: segments with fewer voxels then join their best neighbour.
    """
    parent = np.arange(n)
    size = np.ones(n, np.int32)
    inner = np.zeros(n, np.float32)
    for round_ in range(2):
        for e in order:
            a, b = root(parent, pairs[e, 0]), root(parent, pairs[e, 1])
            if a == b:
                continue
            w = weight[e]
            if round_ == 0:
                join = w <= min(inner[a] + k / size[a], inner[b] + k / size[b])
            else:
                join = min(size[a], size[b]) < smallest
            if join:
                lo, hi = min(a, b), max(a, b)
                parent[hi] = lo
                size[lo] += size[hi]
                inner[lo] = max(w, inner[a], inner[b])
    ids = np.full(n, -1, np.int32)
    out = np.empty(n, np.int32)
    m = 0
    for i in range(n):
        r = root(parent, i)
        if ids[r] < 0:
            ids[r] = m
            m += 1
        out[i] = ids[r]
    return out


@nb.njit(cache=True)
def _spread(values, low, high):
    """Return (low, high) quantiles of a non-empty array."""
    s = np.sort(values)
    n = s.shape[0] - 1
    return s[int(low * n + 0.5)], s[int(high * n + 0.5)]


@nb.njit(cache=True)
def describe(ids, n_segments, mean, normal, cell):
    """
    Return (frames (s, 5), features (s, SEGMENT_FEATURES)) of segments, gravity aligned.

    A frame is (cx, cy, ax, ay, zmin): the horizontal centre, the long horizontal axis (from
    the narrow to the wide end) and the lowest point. Lengths in metres.
    """
    frames = np.zeros((n_segments, 5))
    out = np.zeros((n_segments, SEGMENT_FEATURES), np.float32)
    count = np.bincount(ids, minlength=n_segments)
    start = np.zeros(n_segments + 1, np.int64)
    start[1:] = np.cumsum(count)
    fill = start[:-1].copy()
    order = np.empty(ids.shape[0], np.int64)
    for i in range(ids.shape[0]):
        order[fill[ids[i]]] = i
        fill[ids[i]] += 1
    for s in range(n_segments):
        m = order[start[s]:start[s + 1]]
        n = m.shape[0]
        f = out[s]
        x, y, z = mean[m, 0], mean[m, 1], mean[m, 2]
        mx, my = np.mean(x), np.mean(y)
        sxx, syy = np.mean((x - mx) ** 2), np.mean((y - my) ** 2)
        sxy = np.mean((x - mx) * (y - my))
        angle = 0.5 * np.arctan2(2 * sxy, sxx - syy)
        ax, ay = np.cos(angle), np.sin(angle)
        t, q = (x - mx) * ax + (y - my) * ay, -(x - mx) * ay + (y - my) * ax
        t0, t1 = _spread(t, 0.01, 0.99)
        q0, q1 = _spread(q, 0.01, 0.99)
        z0, z1 = _spread(z, 0.01, 0.99)
        length, breadth, height = t1 - t0 + cell, q1 - q0 + cell, z1 - z0 + cell
        # Widths, heights and shares of the voxels in slices along the long axis.
        lo = np.full(SLICES, np.inf)
        hi = np.full(SLICES, -np.inf)
        top = np.full(SLICES, -np.inf)
        low = np.full(SLICES, np.inf)
        share = np.zeros(SLICES)
        flat, wall, nz_sum = 0.0, 0.0, 0.0
        for i in range(n):
            b = min(SLICES - 1, max(0, int((t[i] - t0) / (t1 - t0 + 1e-9) * SLICES)))
            lo[b], hi[b] = min(lo[b], q[i]), max(hi[b], q[i])
            top[b], low[b] = max(top[b], z[i]), min(low[b], z[i])
            share[b] += 1.0 / n
            nz = normal[m[i], 2]
            nz_sum += nz / n
            flat += (nz > 0.85) / n
            wall += (abs(nz) < 0.35) / n
        first, last = 0.0, 0.0
        for b in range(SLICES // 2):
            first += max(0.0, hi[b] - lo[b])
            last += max(0.0, hi[SLICES - 1 - b] - lo[SLICES - 1 - b])
        flip = first > last
        if flip:
            ax, ay = -ax, -ay
            t0, t1 = -t1, -t0
            q0, q1 = -q1, -q0
        # Circle through the plan view (Kasa): cups, cans, plates, rolls.
        u, w = x - mx, y - my
        uu, ww = u * u, w * w
        den = np.sum(uu) * np.sum(ww) - np.sum(u * w) ** 2
        radius, off = 0.0, 1.0
        if den > 1e-12:
            bu, bw = np.sum(u * (uu + ww)) / 2, np.sum(w * (uu + ww)) / 2
            cu = (bu * np.sum(ww) - bw * np.sum(u * w)) / den
            cw = (bw * np.sum(uu) - bu * np.sum(u * w)) / den
            radius = np.sqrt(cu * cu + cw * cw + np.mean(uu + ww))
            off = np.mean(np.abs(np.sqrt((u - cu) ** 2 + (w - cw) ** 2) - radius))
        frames[s, 0] = mx + ax * (t0 + t1) / 2 - ay * (q0 + q1) / 2
        frames[s, 1] = my + ay * (t0 + t1) / 2 + ax * (q0 + q1) / 2
        frames[s, 2], frames[s, 3], frames[s, 4] = ax, ay, z0
        cov = np.zeros((3, 3))
        mz = np.mean(z)
        cov[0, 0], cov[0, 1], cov[1, 1] = sxx, sxy, syy
        cov[0, 2], cov[1, 2] = np.mean(u * (z - mz)), np.mean(w * (z - mz))
        cov[2, 2] = np.mean((z - mz) ** 2)
        cov[1, 0], cov[2, 0], cov[2, 1] = cov[0, 1], cov[0, 2], cov[1, 2]
        eig = np.sqrt(np.maximum(np.linalg.eigvalsh(cov), 0))
        f[0], f[1], f[2], f[3] = length, breadth, height, z0
        f[4], f[5], f[6] = n * cell * cell, breadth / length, height / length
        f[7], f[8], f[9] = eig[0], eig[1], eig[2]
        f[10], f[11], f[12] = nz_sum, flat, wall
        f[13], f[14] = min(radius, 1.0), off / max(radius, 1e-3)
        f[15] = n * cell * cell / (length * breadth)
        f[16] = mz - z0
        f[17] = z1
        moment = np.zeros(6)
        for i in m:
            a, b, c = normal[i, 0], normal[i, 1], normal[i, 2]
            moment[0] += a * a / n
            moment[1] += a * b / n
            moment[2] += a * c / n
            moment[3] += b * b / n
            moment[4] += b * c / n
            moment[5] += c * c / n
        normal_shape(moment, f[36:40])
        for b in range(SLICES):
            a = SLICES - 1 - b if flip else b
            if hi[a] >= lo[a]:
                f[18 + b] = hi[a] - lo[a]
                f[18 + SLICES + b] = top[a] - z0
                f[18 + 2 * SLICES + b] = share[a]
    return frames, out
