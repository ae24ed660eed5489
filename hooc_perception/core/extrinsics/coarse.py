# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Coarse registration of level cameras: place and heading on the table, by their height maps.

Once every camera is level, only (x, y, yaw) is left. All values within the reach of a bad
calibration are tried, so that no start value decides which object is matched with which.
"""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array
from hooc_perception.core.extrinsics.kernels.coarse import highest, shift_scores
from hooc_perception.core.extrinsics.surface import Surface
from hooc_perception.core.geometry import transform
import numpy as np
from scipy.spatial.transform import Rotation

# Two cameras, each turned by up to 5 degrees about itself, one metre away, and shifted by 5 cm.
REACH_M, REACH_DEG = 0.28, 11.0
# Cell and yaw step of the first search and of the one around its best.
CELLS_M, STEPS_DEG = (0.02, 0.01), (2.0, 0.5)
HALF_SIDE_M = 1.5
TOLERANCE_M = 0.015
# Points per scene: on objects, and on the table; scenes that the search reads.
OBJECT_POINTS, TABLE_POINTS, MOST_SCENES = 600, 300, 12


def place(surfaces: Sequence[Sequence[Surface]],
          poses: Sequence[Float64Array]) -> list[Float64Array]:
    """
    Return the poses after placing the cameras, best overlap first, on the first one's map.

    :param surfaces: per scene, one Surface per camera.
    :param poses: T_world_camera (4, 4) per camera, level: the table lies at z = 0.
    """
    step = max(1, len(surfaces) // MOST_SCENES)
    scenes = [[_cloud(s, T) for s, T in zip(scene, poses)] for scene in surfaces[::step]]
    moves = [np.eye(4) for _ in poses]
    done, left = [0], list(range(1, len(poses)))
    while left:
        tried = {i: _best_move([[transform(moves[j], scene[j]) for j in done]
                                for scene in scenes], [scene[i] for scene in scenes])
                 for i in left}
        best = max(left, key=lambda i: tried[i][0])
        moves[best] = tried[best][1]
        done.append(best)
        left.remove(best)
    return [T_move @ T for T_move, T in zip(moves, poses)]


def _best_move(onto: Sequence[Sequence[Float64Array]],
               clouds: Sequence[Float64Array]) -> tuple[float, Float64Array]:
    """Return (score per point, (4, 4) motion) that lays clouds (n, 3) onto others, per scene."""
    points, scene = _drawn(clouds)
    middle = points[:, :2].mean(axis=0) if len(points) else np.zeros(2)
    best, yaw, shift = 0.0, 0.0, np.zeros(2)
    reach_m, reach_deg = REACH_M, REACH_DEG
    for cell, step in zip(CELLS_M, STEPS_DEG):
        maps = np.stack([_height_map(near, cell) for near in onto])
        reach = round(reach_m / cell)
        # Nearest first: without any evidence a camera stays where it is.
        offsets = sorted(np.arange(-reach_deg, reach_deg + 1e-9, step), key=abs)
        best, start_yaw, start_shift = -np.inf, yaw, shift
        for turn in start_yaw + np.array(offsets):
            moved = _turned(points, middle, turn)
            moved[:, :2] += start_shift
            scores = shift_scores(maps, scene, _cells(moved, cell), moved[:, 2], reach,
                                  TOLERANCE_M)
            row, col = _nearest_best(scores)
            if scores[row, col] > best:
                best, yaw = float(scores[row, col]), float(turn)
                shift = start_shift + (np.array([col, row]) - reach) * cell
        reach_m, reach_deg = 2 * CELLS_M[0], STEPS_DEG[0]
    T = np.eye(4)
    T[:2, :2] = Rotation.from_rotvec([0, 0, np.radians(yaw)]).as_matrix()[:2, :2]
    T[:2, 3] = middle + shift - T[:2, :2] @ middle
    return best / max(len(points), 1), T


def _cloud(surface: Surface, T_world_camera: Float64Array) -> Float64Array:
    """Return the world points (n, 3) of a Surface that have a normal."""
    known = np.isfinite(surface.normals[..., 0])
    return transform(T_world_camera, surface.points[known].astype(np.float64))


def _drawn(clouds: Sequence[Float64Array]) -> tuple[Float64Array, Int32Array]:
    """Return points (n, 3) of all scenes, on objects and on the table, and their scene (n,)."""
    points, scene = [], []
    for k, cloud in enumerate(clouds):
        for part, most in ((cloud[cloud[:, 2] > TOLERANCE_M], OBJECT_POINTS),
                           (cloud[np.abs(cloud[:, 2]) <= TOLERANCE_M], TABLE_POINTS)):
            index = np.linspace(0, len(part) - 1, min(most, len(part))).astype(int)
            points.append(part[index])
            scene.append(np.full(len(index), k, np.int32))
    return np.concatenate(points), np.concatenate(scene)


def _height_map(clouds: Sequence[Float64Array], cell_m: float) -> Float32Array:
    """Return the (G, G) float32 map of the highest points per cell, NaN = unknown."""
    size = round(2 * HALF_SIDE_M / cell_m)
    heights = np.full(size * size, np.nan, np.float32)
    for cloud in clouds:
        cells = _cells(cloud, cell_m).astype(np.int64)
        inside = ((cells >= 0) & (cells < size)).all(axis=1)
        highest(cells[inside, 1] * size + cells[inside, 0], cloud[inside, 2], heights)
    return heights.reshape(size, size)


def _cells(points: Float64Array, cell_m: float) -> Int32Array:
    """Return the (n, 2) int32 cell (x, y) of each point."""
    return np.floor((points[:, :2] + HALF_SIDE_M) / cell_m).astype(np.int32)


def _turned(points: Float64Array, middle: Float64Array, yaw_deg: float) -> Float64Array:
    """Return points (n, 3) turned about the vertical through `middle` (2,)."""
    R = Rotation.from_rotvec([0, 0, np.radians(yaw_deg)]).as_matrix()
    centre = np.append(middle, 0.0)
    return (points - centre) @ R.T + centre


def _nearest_best(scores: Int32Array) -> tuple[int, int]:
    """Return (row, column) of the best score; of equal ones that of the smallest shift."""
    reach = len(scores) // 2
    rows, cols = np.nonzero(scores == scores.max())
    k = int(np.argmin((rows - reach) ** 2 + (cols - reach) ** 2))
    return int(rows[k]), int(cols[k])
