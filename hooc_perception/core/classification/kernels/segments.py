# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Voxel graph of the foreground, its convex segments, and their shape measures."""

from typing import NamedTuple

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array, Int64Array
from hooc_perception.core.classification.kernels.texture import normal_shape
from hooc_perception.core.frame.kernels.patches import root
import numba as nb
import numpy as np

# Columns of a segment's frame: horizontal centre, long horizontal axis (from the narrow to the
# wide end), lowest point.
CENTRE_X, CENTRE_Y, AXIS_X, AXIS_Y, LOWEST, FRAME_COLUMNS = range(6)
# Columns of a segment's features.
SLICES = 6
LENGTH, BREADTH, HEIGHT, BOTTOM, AREA, BREADTH_RATIO, HEIGHT_RATIO, SPREADS = range(8)
MEAN_NORMAL_Z, FLAT_SHARE, WALL_SHARE, CIRCLE_RADIUS, CIRCLE_RESIDUAL = range(
    SPREADS + 3, SPREADS + 8)
FILL, MEAN_HEIGHT, TOP, SLICE_WIDTH = range(CIRCLE_RESIDUAL + 1, CIRCLE_RESIDUAL + 5)
SLICE_TOP = SLICE_WIDTH + SLICES
SLICE_SHARE = SLICE_TOP + SLICES
NORMAL_SHAPE = SLICE_SHARE + SLICES
SEGMENT_FEATURES = NORMAL_SHAPE + 4
# Extents leave out this share of the voxels at either end.
QUANTILE = 0.01
# Most edges per voxel, their greatest length in cells, and the cosine of the angle between
# normals beyond which two voxels lie on opposite sides of a thin sheet.
MOST_EDGES, LONGEST_EDGE, OPPOSITE = 40, 2.2, -0.5
# Shares in an edge's weight: angle between the normals, distance in cells, its own concave
# angle, the mean concave angle around each of the two voxels.
BEND_SHARE, DISTANCE_SHARE, OWN_SHARE, AROUND_SHARE = 0.05, 0.2, 0.5, 0.25


@nb.njit(cache=True)
def voxelise(points: Float64Array, normals: Float64Array, origin: Float64Array, cell: float,
             shape: tuple[int, int, int]
             ) -> tuple[Int32Array, Float64Array, Float64Array, Int32Array]:
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


class _Edges(NamedTuple):
    """
    Edges under construction.

    :ivar pairs: (most, 2) int32; weight and valley (most,) float32, the concave angle.
    :ivar total: (m,) float32 sum of the concave angles around each voxel; degree (m,) float32.
    """

    pairs: Int32Array
    weight: Float32Array
    valley: Float32Array
    total: Float32Array
    degree: Float32Array


@nb.njit(cache=True, inline='always')
def _joint(mean: Float64Array, normal: Float64Array, v: int, w: int,
           cell: float) -> tuple[float, float, float]:
    """Return (distance metres, bend, concave angle) of two voxels; distance inf = no edge."""
    dx, dy, dz = (mean[w, 0] - mean[v, 0], mean[w, 1] - mean[v, 1], mean[w, 2] - mean[v, 2])
    d = np.sqrt(dx * dx + dy * dy + dz * dz)
    if d > LONGEST_EDGE * cell or d < 1e-9:
        return np.inf, 0.0, 0.0
    pv = (normal[v, 0] * dx + normal[v, 1] * dy + normal[v, 2] * dz) / d
    pw = (normal[w, 0] * dx + normal[w, 1] * dy + normal[w, 2] * dz) / d
    dot = (normal[v, 0] * normal[w, 0] + normal[v, 1] * normal[w, 1]
           + normal[v, 2] * normal[w, 2])
    bend = np.arccos(min(1.0, max(-1.0, dot)))
    # Normals that turn towards each other: pv > 0 or pw < 0 is a valley.
    concave = min(bend, max(0.0, pv - pw))
    # Seen from opposite sides, a thin sheet: no valley between them.
    if dot < OPPOSITE:
        concave = 0.0
    return d, bend, concave


@nb.njit(cache=True)
def edges(mean: Float64Array, normal: Float64Array, grid: Int32Array, origin: Float64Array,
          cell: float) -> tuple[Int32Array, Float32Array]:
    """
    Return (pairs (e, 2) int32, weight (e,) float32) of voxels that touch (5^3 neighbours).

    The weight is the concave angle between the two surfaces (radians, 0 for a convex or flat
    joint; cf. LCCP, Stein et al. 2014), half of it averaged over all joints of both voxels
    because single normals are noisy; plus shares of the angle between the normals and of the
    distance, so that smooth and close joints close first. The shares maximised the overlap
    of segments with objects.
    """
    m = mean.shape[0]
    most = m * MOST_EDGES
    out = _Edges(np.empty((most, 2), np.int32), np.empty(most, np.float32),
                 np.empty(most, np.float32), np.zeros(m, np.float32), np.zeros(m, np.float32))
    e = 0
    nx, ny, nz = grid.shape
    for v in range(m):
        a = min(max(int((mean[v, 0] - origin[0]) / cell), 0), nx - 1)
        b = min(max(int((mean[v, 1] - origin[1]) / cell), 0), ny - 1)
        c = min(max(int((mean[v, 2] - origin[2]) / cell), 0), nz - 1)
        for i in range(max(0, a - 2), min(nx, a + 3)):
            for j in range(max(0, b - 2), min(ny, b + 3)):
                for k in range(max(0, c - 2), min(nz, c + 3)):
                    w = grid[i, j, k]
                    if w <= v or e >= most:
                        continue
                    d, bend, concave = _joint(mean, normal, v, w, cell)
                    if d == np.inf:
                        continue
                    out.pairs[e, 0], out.pairs[e, 1] = v, w
                    out.valley[e] = concave
                    out.weight[e] = BEND_SHARE * bend + DISTANCE_SHARE * d / cell
                    out.total[v] += concave
                    out.total[w] += concave
                    out.degree[v] += 1
                    out.degree[w] += 1
                    e += 1
    for i in range(e):
        v, w = out.pairs[i, 0], out.pairs[i, 1]
        out.weight[i] += OWN_SHARE * out.valley[i] + AROUND_SHARE * (
            out.total[v] / out.degree[v] + out.total[w] / out.degree[w])
    return out.pairs[:e], out.weight[:e]


@nb.njit(cache=True)
def segment(n: int, pairs: Int32Array, weight: Float32Array, order: Int64Array, k: float,
            smallest: int) -> Int32Array:
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


@nb.njit(cache=True, parallel=True)
def segment_at(scales: Float64Array, n: int, pairs: Int32Array, weight: Float32Array,
               order: Int64Array, smallest: int) -> Int32Array:
    """Return (len(scales), n) int32: what `segment` returns for each k of `scales`."""
    ids = np.empty((scales.shape[0], n), np.int32)
    for i in nb.prange(scales.shape[0]):
        ids[i] = segment(n, pairs, weight, order, scales[i], smallest)
    return ids


@nb.njit(cache=True)
def _spread(values: Float64Array, low: float, high: float) -> tuple[float, float]:
    """Return (low, high) quantiles of a non-empty array."""
    s = np.sort(values)
    n = s.shape[0] - 1
    return s[int(low * n + 0.5)], s[int(high * n + 0.5)]


@nb.njit(cache=True)
def _members(ids: Int32Array, n_segments: int) -> tuple[Int64Array, Int64Array]:
    """Return (order (m,), start (n_segments + 1,)): the voxels, segment by segment."""
    count = np.bincount(ids, minlength=n_segments)
    start = np.zeros(n_segments + 1, np.int64)
    start[1:] = np.cumsum(count)
    fill = start[:-1].copy()
    order = np.empty(ids.shape[0], np.int64)
    for i in range(ids.shape[0]):
        order[fill[ids[i]]] = i
        fill[ids[i]] += 1
    return order, start


@nb.njit(cache=True)
def _describe_normals(normal: Float64Array, members: Int64Array, f: Float32Array) -> None:
    """Fill the columns of f that the normals of a segment determine."""
    n = members.shape[0]
    flat, wall, nz_sum = 0.0, 0.0, 0.0
    for i in members:
        nz = normal[i, 2]
        nz_sum += nz / n
        flat += (nz > 0.85) / n
        wall += (abs(nz) < 0.35) / n
    f[MEAN_NORMAL_Z], f[FLAT_SHARE], f[WALL_SHARE] = nz_sum, flat, wall
    moment = np.zeros(6)
    for i in members:
        a, b, c = normal[i, 0], normal[i, 1], normal[i, 2]
        moment[0] += a * a / n
        moment[1] += a * b / n
        moment[2] += a * c / n
        moment[3] += b * b / n
        moment[4] += b * c / n
        moment[5] += c * c / n
    normal_shape(moment, f[NORMAL_SHAPE:NORMAL_SHAPE + 4])


@nb.njit(cache=True)
def _describe_slices(along: Float64Array, across: Float64Array, z: Float64Array,
                     ends: tuple[float, float], bottom: float, f: Float32Array) -> bool:
    """
    Fill widths, heights and shares of voxels in slices along the long axis, narrow end first.

    :param along, across, z: (n,) coordinates of the voxels; ends: the slices lie in between.
    :return: whether the axis points to the narrow end and has to be reversed.
    """
    n = along.shape[0]
    t0, t1 = ends
    lo = np.full(SLICES, np.inf)
    hi = np.full(SLICES, -np.inf)
    top = np.full(SLICES, -np.inf)
    share = np.zeros(SLICES)
    for i in range(n):
        b = min(SLICES - 1, max(0, int((along[i] - t0) / (t1 - t0 + 1e-9) * SLICES)))
        lo[b], hi[b] = min(lo[b], across[i]), max(hi[b], across[i])
        top[b] = max(top[b], z[i])
        share[b] += 1.0 / n
    first, last = 0.0, 0.0
    for b in range(SLICES // 2):
        first += max(0.0, hi[b] - lo[b])
        last += max(0.0, hi[SLICES - 1 - b] - lo[SLICES - 1 - b])
    reverse = first > last
    for b in range(SLICES):
        a = SLICES - 1 - b if reverse else b
        if hi[a] >= lo[a]:
            f[SLICE_WIDTH + b] = hi[a] - lo[a]
            f[SLICE_TOP + b] = top[a] - bottom
            f[SLICE_SHARE + b] = share[a]
    return reverse


@nb.njit(cache=True)
def _circle(u: Float64Array, w: Float64Array) -> tuple[float, float]:
    """
    Fit a circle to plan view coordinates (n,) (Kasa 1976): cups, cans, plates, rolls.

    :return: (radius, mean absolute distance from it), metres; (0, 1) where there is none.
    """
    uu, ww = u * u, w * w
    den = np.sum(uu) * np.sum(ww) - np.sum(u * w) ** 2
    radius, off = 0.0, 1.0
    if den > 1e-12:
        bu, bw = np.sum(u * (uu + ww)) / 2, np.sum(w * (uu + ww)) / 2
        cu = (bu * np.sum(ww) - bw * np.sum(u * w)) / den
        cw = (bw * np.sum(uu) - bu * np.sum(u * w)) / den
        radius = np.sqrt(cu * cu + cw * cw + np.mean(uu + ww))
        off = np.mean(np.abs(np.sqrt((u - cu) ** 2 + (w - cw) ** 2) - radius))
    return radius, off


@nb.njit(cache=True)
def _principal_spreads(u: Float64Array, w: Float64Array, z: Float64Array,
                       horizontal: tuple[float, float, float]) -> Float64Array:
    """
    Return (3,) ascending standard deviations along the principal axes of points (n,).

    :param u, w: relative to their means; horizontal: their covariances (uu, uw, ww).
    """
    cov = np.zeros((3, 3))
    mz = np.mean(z)
    cov[0, 0], cov[0, 1], cov[1, 1] = horizontal
    cov[0, 2], cov[1, 2] = np.mean(u * (z - mz)), np.mean(w * (z - mz))
    cov[2, 2] = np.mean((z - mz) ** 2)
    cov[1, 0], cov[2, 0], cov[2, 1] = cov[0, 1], cov[0, 2], cov[1, 2]
    return np.sqrt(np.maximum(np.linalg.eigvalsh(cov), 0))


@nb.njit(cache=True)
def _describe_one(members: Int64Array, mean: Float64Array, normal: Float64Array, cell: float,
                  frame: Float64Array, f: Float32Array) -> None:
    """Fill the frame (FRAME_COLUMNS,) and the features (SEGMENT_FEATURES,) of one segment."""
    n = members.shape[0]
    x, y, z = mean[members, 0], mean[members, 1], mean[members, 2]
    mx, my = np.mean(x), np.mean(y)
    sxx, syy = np.mean((x - mx) ** 2), np.mean((y - my) ** 2)
    sxy = np.mean((x - mx) * (y - my))
    angle = 0.5 * np.arctan2(2 * sxy, sxx - syy)
    ax, ay = np.cos(angle), np.sin(angle)
    t, q = (x - mx) * ax + (y - my) * ay, -(x - mx) * ay + (y - my) * ax
    t0, t1 = _spread(t, QUANTILE, 1 - QUANTILE)
    q0, q1 = _spread(q, QUANTILE, 1 - QUANTILE)
    z0, z1 = _spread(z, QUANTILE, 1 - QUANTILE)
    length, breadth, height = t1 - t0 + cell, q1 - q0 + cell, z1 - z0 + cell
    if _describe_slices(t, q, z, (t0, t1), z0, f):
        ax, ay = -ax, -ay
        t0, t1 = -t1, -t0
        q0, q1 = -q1, -q0
    frame[CENTRE_X] = mx + ax * (t0 + t1) / 2 - ay * (q0 + q1) / 2
    frame[CENTRE_Y] = my + ay * (t0 + t1) / 2 + ax * (q0 + q1) / 2
    frame[AXIS_X], frame[AXIS_Y], frame[LOWEST] = ax, ay, z0
    u, w = x - mx, y - my
    radius, off = _circle(u, w)
    spreads = _principal_spreads(u, w, z, (sxx, sxy, syy))
    f[LENGTH], f[BREADTH], f[HEIGHT], f[BOTTOM] = length, breadth, height, z0
    f[AREA], f[BREADTH_RATIO] = n * cell * cell, breadth / length
    f[HEIGHT_RATIO] = height / length
    for k in range(3):
        f[SPREADS + k] = spreads[k]
    f[CIRCLE_RADIUS], f[CIRCLE_RESIDUAL] = min(radius, 1.0), off / max(radius, 1e-3)
    f[FILL] = n * cell * cell / (length * breadth)
    f[MEAN_HEIGHT] = np.mean(z) - z0
    f[TOP] = z1
    _describe_normals(normal, members, f)


@nb.njit(cache=True, parallel=True)
def describe(ids: Int32Array, n_segments: int, mean: Float64Array, normal: Float64Array,
             cell: float) -> tuple[Float64Array, Float32Array]:
    """
    Describe segments, gravity aligned.

    :return: frames (s, FRAME_COLUMNS) float64 and features (s, SEGMENT_FEATURES) float32, their
        columns as named at the top of this module; lengths in metres.
    """
    frames = np.zeros((n_segments, FRAME_COLUMNS))
    out = np.zeros((n_segments, SEGMENT_FEATURES), np.float32)
    order, start = _members(ids, n_segments)
    for s in nb.prange(n_segments):
        _describe_one(order[start[s]:start[s + 1]], mean, normal, cell, frames[s], out[s])
    return frames, out
