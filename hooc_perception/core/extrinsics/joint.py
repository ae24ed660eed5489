# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Joint refinement of all cameras of a fixed rig, over all scenes, against the table."""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.extrinsics.solve import moved, Normal
from hooc_perception.core.extrinsics.surface import Matches, matches, Surface
from hooc_perception.core.geometry import transform
import numpy as np

# Distances within which a point looks for another surface, from coarse to fine, metres.
REACHES_M = (0.04, 0.02, 0.01, 0.01)
MOST_STEPS = 10
# Smaller steps end the work with a reach, metres and radians; a coarse reach needs less.
LEAST_STEP, LEAST_COARSE_STEP = 2e-5, 3e-4
# The table is looked for within this height of z = 0, metres.
TABLE_BAND_M = 0.015


def refine(surfaces: Sequence[Sequence[Surface]],
           poses: Sequence[Float64Array]) -> list[Float64Array]:
    """
    Return the poses that fit all cameras to each other and to the table, by Gauss-Newton.

    The table fixes height, roll and pitch; position and heading of the first camera stay.

    :param surfaces: per scene, one Surface per camera.
    :param poses: T_world_camera (4, 4) per camera, within the basin of the finest match.
    """
    poses = [T.copy() for T in poses]
    free = np.ones((len(poses), 6), bool)
    free[0] = [False, False, True, True, True, False]
    for k, reach in enumerate(REACHES_M):
        enough = LEAST_STEP if k == len(REACHES_M) - 1 else LEAST_COARSE_STEP
        for _ in range(MOST_STEPS):
            normal = Normal(np.array([T[:3, 3] for T in poses]))
            for i, j, m in pair_matches(surfaces, poses, reach):
                normal.add(m.points, m.normals, m.distance_m, i, j)
            for i, T in enumerate(poses):
                points = table_points([scene[i] for scene in surfaces], T)
                up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
                normal.add(points, up, points[:, 2], i)
            twists = normal.step(free)
            poses = [moved(T, twist) for T, twist in zip(poses, twists)]
            if np.abs(twists).max() < enough:
                break
    return poses


def pair_matches(surfaces: Sequence[Sequence[Surface]], poses: Sequence[Float64Array],
                 reach_m: float) -> list[tuple[int, int, Matches]]:
    """Return (camera of the points, camera of the surface, Matches) of all scenes and pairs."""
    found = []
    for i, T_i in enumerate(poses):
        for j, T_j in enumerate(poses):
            if i != j:
                parts = [matches(scene[j], T_j, scene[i], T_i, reach_m) for scene in surfaces]
                found.append((i, j, _joined(parts)))
    return found


def table_points(surfaces: Sequence[Surface], T_world_camera: Float64Array) -> Float64Array:
    """Return the drawn level points (n, 3) of one camera near z = 0, world."""
    level = np.concatenate([surface.level[:, :3] for surface in surfaces])
    points = transform(T_world_camera, level)
    return points[np.abs(points[:, 2]) < TABLE_BAND_M]


def _joined(parts: Sequence[Matches]) -> Matches:
    """Return the Matches of several scenes as one."""
    return Matches(np.concatenate([part.points for part in parts]),
                   np.concatenate([part.normals for part in parts]),
                   np.concatenate([part.distance_m for part in parts]),
                   np.concatenate([part.sloping for part in parts]),
                   sum(part.comparable for part in parts))
