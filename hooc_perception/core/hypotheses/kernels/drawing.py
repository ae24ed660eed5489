# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Draw hypotheses that put a model point on a scene point with the same facing.

Most have a resting rotation of the model with some slack, then only the yaw is free; the others
have any rotation that agrees with the scene point's normal. What fails a quick test is dropped,
the rest is scored (scoring.py), and the best of every cell of the table are kept.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import Float64Array, Int8Array, Int64Array
from hooc_perception.core.frame.kernels.records import Field
from hooc_perception.core.hypotheses.kernels.records import (
    DrawSettings,
    ModelTables,
    ScoreWeights,
    Surface,
)
from hooc_perception.core.hypotheses.kernels.scoring import (
    field_evidence,
    quick_score,
    score_of,
)
from hooc_perception.core.kernels.pose import (
    quaternion_multiply,
    QW,
    QX,
    QY,
    QZ,
    rotation_of,
    SCORE,
    SX,
    SY,
    SZ,
    TX,
    TY,
    TZ,
    WIDTH,
)
import numba as nb
import numpy as np

# Least mean of a few points in the quick field: a visible fifth of a model reaches it.
QUICK_MEAN = 12.0
# The best of every cell of the table are kept, so that no part of a scene crowds out the rest.
CELL_M = 0.04
PER_CELL = 4
# A draw is given up if a first share of its points reaches less than a share of the score of what
# it has to replace.
FIRST_SHARE, HOPEFUL = 0.375, 0.5
# Limits of the drawn scale, and spread of the axes about the common factor.
LEAST_SCALE, GREATEST_SCALE = 0.5, 1.8
ASPECT = 0.6
# Tilt of a resting pose, radians: rough models and leaning objects need slack.
SLIGHT_TILT, STRONG_TILT = 0.06, 0.3
SLIGHT_SHARE = 0.7
# Tries to find a model point that faces as the scene point does, and how well it has to.
TRIES = 12
SAME_HEIGHT = 0.2
# A normal tells the yaw where its squared horizontal part exceeds this; it does so up to this
# deviation, radians.
HORIZONTAL = 0.1
YAW_SIGMA = 0.1


class Model(NamedTuple):
    """One row of ModelTables."""

    points: Float64Array
    normals: Float64Array
    rest: Float64Array
    rest_cdf: Float64Array


@nb.njit(cache=True, inline='always')
def _set_quaternion(q: Float64Array, x: float, y: float, z: float, w: float) -> None:
    """Write a quaternion into q (4,)."""
    q[0], q[1], q[2], q[3] = x, y, z, w


@nb.njit(cache=True, inline='always')
def _draw_resting(h: Float64Array, model: Model, q: Float64Array) -> None:
    """Give `h` a resting rotation of the model, a little tilted."""
    r = np.searchsorted(model.rest_cdf, np.random.random() * model.rest_cdf[-1])
    r = min(r, model.rest.shape[0] - 1)
    for k in range(4):
        h[QX + k] = model.rest[r, k]
    tilt = SLIGHT_TILT if np.random.random() < SLIGHT_SHARE else STRONG_TILT
    _set_quaternion(q, np.random.normal() * tilt / 2, np.random.normal() * tilt / 2, 0.0, 1.0)
    quaternion_multiply(q, h[QX:QW + 1], h[QX:QW + 1])


@nb.njit(cache=True, inline='always')
def _world_normal(h: Float64Array, R: Float64Array, normals: Float64Array, j: int,
                  ) -> tuple[float, float, float]:
    """Return the unit normal in the world of point j of the model under `h` with rotation R."""
    a, b, c = normals[j, 0] / h[SX], normals[j, 1] / h[SY], normals[j, 2] / h[SZ]
    norm = 1.0 / np.sqrt(a * a + b * b + c * c + 1e-20)
    return (norm * (R[0, 0] * a + R[0, 1] * b + R[0, 2] * c),
            norm * (R[1, 0] * a + R[1, 1] * b + R[1, 2] * c),
            norm * (R[2, 0] * a + R[2, 1] * b + R[2, 2] * c))


@nb.njit(cache=True, inline='always')
def _turn_about_vertical(h: Float64Array, m: tuple[float, float, float],
                         s: tuple[float, float, float], q: Float64Array) -> None:
    """Turn `h` about the vertical so that normal m points where s does; at random if unknown."""
    if (m[0] * m[0] + m[1] * m[1] > HORIZONTAL
            and s[0] * s[0] + s[1] * s[1] > HORIZONTAL):
        yaw = np.arctan2(s[1], s[0]) - np.arctan2(m[1], m[0]) + np.random.normal() * YAW_SIGMA
    else:
        yaw = np.random.random() * 2 * np.pi
    _set_quaternion(q, 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2))
    quaternion_multiply(q, h[QX:QW + 1], h[QX:QW + 1])


@nb.njit(cache=True, inline='always')
def _turn_onto(h: Float64Array, m: tuple[float, float, float], s: tuple[float, float, float],
               q: Float64Array) -> None:
    """Turn `h` by the shortest rotation from normal m to s, then at random around s."""
    cx, cy, cz = m[1] * s[2] - m[2] * s[1], m[2] * s[0] - m[0] * s[2], m[0] * s[1] - m[1] * s[0]
    dot = m[0] * s[0] + m[1] * s[1] + m[2] * s[2]
    if dot < -0.999:
        # Half a turn about anything perpendicular to the normal.
        n = np.sqrt(m[0] * m[0] + m[1] * m[1])
        if n > 0.1:
            _set_quaternion(q, -m[1] / n, m[0] / n, 0.0, 0.0)
        else:
            _set_quaternion(q, 1.0, 0.0, 0.0, 0.0)
    else:
        n = 1.0 / np.sqrt(cx * cx + cy * cy + cz * cz + (1 + dot) * (1 + dot))
        _set_quaternion(q, cx * n, cy * n, cz * n, (1 + dot) * n)
    quaternion_multiply(q, h[QX:QW + 1], h[QX:QW + 1])
    spin = np.random.random() * np.pi
    _set_quaternion(q, s[0] * np.sin(spin), s[1] * np.sin(spin), s[2] * np.sin(spin),
                    np.cos(spin))
    quaternion_multiply(q, h[QX:QW + 1], h[QX:QW + 1])


@nb.njit(cache=True)
def draw_pose(h: Float64Array, model: Model, scene: Surface, i: int, settings: DrawSettings,
              q: Float64Array, R: Float64Array) -> None:
    """
    Fill `h` (10,) so that one model point lies on scene point i with the same facing.

    :param q: (4,) and R (3, 3), float64 scratch.
    """
    iso = np.exp(np.random.normal() * settings.size_sigma)
    for k in range(3):
        factor = np.exp(np.random.normal() * ASPECT * settings.size_sigma)
        h[SX + k] = min(GREATEST_SCALE, max(LEAST_SCALE, iso * factor))
    s = scene.normals[i, 0], scene.normals[i, 1], scene.normals[i, 2]
    resting = np.random.random() >= settings.tilted
    h[QX], h[QY], h[QZ], h[QW] = 0.0, 0.0, 0.0, 1.0
    if resting:
        _draw_resting(h, model, q)
    rotation_of(h, R)
    j, m = 0, (0.0, 0.0, 0.0)
    for _ in range(TRIES):
        j = np.random.randint(0, model.points.shape[0])
        m = _world_normal(h, R, model.normals, j)
        if not resting or abs(m[2] - s[2]) < SAME_HEIGHT:
            break
    if resting:
        _turn_about_vertical(h, m, s, q)
    else:
        _turn_onto(h, m, s, q)
    rotation_of(h, R)
    x, y, z = model.points[j, 0] * h[SX], model.points[j, 1] * h[SY], model.points[j, 2] * h[SZ]
    h[TX] = scene.points[i, 0] - (R[0, 0] * x + R[0, 1] * y + R[0, 2] * z)
    h[TY] = scene.points[i, 1] - (R[1, 0] * x + R[1, 1] * y + R[1, 2] * z)
    h[TZ] = scene.points[i, 2] - (R[2, 0] * x + R[2, 1] * y + R[2, 2] * z)


@nb.njit(cache=True, inline='always')
def _worst_of(cell: Float64Array) -> int:
    """Return the row of the worst of the hypotheses (PER_CELL, 11) of a cell."""
    worst = 0
    for k in range(1, PER_CELL):
        if cell[k, SCORE] < cell[worst, SCORE]:
            worst = k
    return worst


@nb.njit(cache=True)
def score_if_hopeful(h: Float64Array, surface: Surface, n: int, field: Field,
                     weights: ScoreWeights, R: Float64Array, equations: Float64Array,
                     least: float) -> float:
    """Return the score of `h` from n points, or -inf if the first of them have little hope."""
    first = int(FIRST_SHARE * n)
    a = field_evidence(h, surface, 0, first, field, R, equations)
    if least > 0.0 and score_of(h, first, a, weights) < HOPEFUL * least:
        return -np.inf
    b = field_evidence(h, surface, first, n, field, R, equations)
    return score_of(h, n, (a[0] + b[0], a[1] + b[1], a[2] + b[2]), weights)


@nb.njit(cache=True)
def sample(seed: int, model: Model, scene: Surface, scene_cdf: Float64Array, field: Field,
           quick: Int8Array, weights: ScoreWeights, settings: DrawSettings) -> Float64Array:
    """
    Draw hypotheses of one model; return the best (keep, 11), with their scores, best first.

    Rows that were never filled have score -inf. The same seed gives the same result in any
    thread.

    :param scene_cdf: (n,) cumulative weights of the scene points.
    """
    np.random.seed(seed)
    origin = field.origin
    np_x = int(field.data.shape[0] * field.voxel / CELL_M) + 1
    np_y = int(field.data.shape[1] * field.voxel / CELL_M) + 1
    cells = np.full((np_x * np_y, PER_CELL, WIDTH + 1), -np.inf)
    surface = Surface(model.points, model.normals)
    h = np.empty(WIDTH)
    q, R, no_equations = np.empty(4), np.empty((3, 3)), np.empty((0, 0))
    for _ in range(settings.samples):
        i = np.searchsorted(scene_cdf, np.random.random() * scene_cdf[-1])
        i = min(i, scene.points.shape[0] - 1)
        draw_pose(h, model, scene, i, settings, q, R)
        # Most draws are hopeless: a few points in a small field, which fits the cache, tell.
        if (quick_score(h, model.points, settings.first_points, quick, field, R)
                < QUICK_MEAN * settings.first_points):
            continue
        x = min(np_x - 1, max(0, int((h[TX] - origin[0]) / CELL_M)))
        y = min(np_y - 1, max(0, int((h[TY] - origin[1]) / CELL_M)))
        cell = cells[x * np_y + y]
        worst = _worst_of(cell)
        reached = score_if_hopeful(h, surface, settings.points, field, weights, R, no_equations,
                                   cell[worst, SCORE])
        if reached > cell[worst, SCORE]:
            cell[worst, :WIDTH] = h
            cell[worst, SCORE] = reached
    flat = cells.reshape(-1, WIDTH + 1)
    order = np.argsort(-flat[:, SCORE])
    out = np.full((settings.keep, WIDTH + 1), -np.inf)
    for k in range(min(settings.keep, flat.shape[0])):
        out[k] = flat[order[k]]
    return out


@nb.njit(cache=True, parallel=True)
def sample_all(seeds: Int64Array, tables: ModelTables, scene: Surface, scene_cdf: Float64Array,
               field: Field, quick: Int8Array, weights: ScoreWeights, settings: DrawSettings,
               ) -> Float64Array:
    """
    Run `sample` for each of N meshes.

    :param seeds: (N,) int64; scene_cdf (N, n) float64 cumulative weights of the scene points.
    :param quick: (X, Y, Z) int8 from quick_field.
    :return: (N, keep, 11) float64.
    """
    out = np.empty((tables.points.shape[0], settings.keep, WIDTH + 1))
    for c in nb.prange(tables.points.shape[0]):
        model = Model(tables.points[c], tables.normals[c], tables.rest[c], tables.rest_cdf[c])
        out[c] = sample(seeds[c], model, scene, scene_cdf[c], field, quick, weights, settings)
    return out
