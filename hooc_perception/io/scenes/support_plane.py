# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Estimate the frame of the table from depth images whose world frame is unknown."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.core.geometry import pose_from_matrix, stage_rng, transform
from hooc_perception.core.types import DepthView
from hooc_perception.errors import HoocError
import numpy as np

# Depth is thinned to about this many points per scene; a plane needs no more.
MAX_POINTS = 40_000
TRIALS = 400
# Number of planes to try, largest first: a table may be smaller than the wall behind it.
MAX_PLANES = 3
MIN_SHARE = 0.08
# A point within this distance belongs to a plane: a calibration error plus noise that grows
# with the square of the distance (Khoshelham & Elberink 2012, structured light).
TOLERANCE_M, TOLERANCE_PER_M = 0.006, 0.004
# Height range of points on objects that stand on the table.
LOWEST_M, HIGHEST_M = 0.015, 0.5
MIN_STANDING_SHARE = 0.003
# Least cosine between a plane's normal and the images' upward direction; 0 seen from above.
MIN_UPRIGHT = 0.1
CELL_M = 0.02


@dataclass(frozen=True, eq=False)
class SupportPlane:
    """
    A table frame estimated from depth: z up, origin below the centre of the objects on it.

    Its x axis points to the right in the first camera's image.

    :ivar T_table_source: (4, 4) float64, from the frame of the files to the table frame.
    :ivar inlier_share: share of the measured points that lie on the plane.
    :ivar residual_m: RMS distance of those points from the plane.
    """

    T_table_source: Float64Array
    inlier_share: float
    residual_m: float

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for a results file."""
        translation, rotation = pose_from_matrix(self.T_table_source)
        return {'frame': 'table', 'estimated_from': 'dominant support plane',
                'table_from_source': {'translation': translation.tolist(),
                                      'rotation_xyzw': rotation.tolist()},
                'inlier_share': round(self.inlier_share, 4),
                'residual_m': round(self.residual_m, 5)}


def estimate_table_frame(views: Sequence[DepthView], scene_name: str) -> SupportPlane:
    """
    Return the SupportPlane of one scene: RANSAC, then a least-squares fit to the inliers.

    The table is the largest plane that supports objects and whose normal points upwards in the
    images, as a table's does for an upright camera and a wall's does not. If no plane meets
    both conditions, one is enough. The same views give the same frame.

    :param views: raw; the poses of their cameras define the source frame.
    :raises HoocError: if no plane contains at least MIN_SHARE of the points.
    """
    points, tolerance = _points(views)
    T_source_camera = views[0].camera.T_world_camera
    image_up = -np.mean([view.camera.T_world_camera[:3, 1] for view in views], axis=0)
    rng = stage_rng(0, 'table')
    left = np.ones(len(points), bool)
    best = None
    for _ in range(MAX_PLANES):
        if left.sum() < max(MIN_SHARE * len(points), 50):
            break
        normal, offset, inliers = _largest_plane(points, tolerance, left, rng)
        if inliers.sum() < MIN_SHARE * len(points):
            break
        left &= ~inliers
        if normal @ T_source_camera[:3, 3] + offset < 0:
            normal, offset = -normal, -offset
        standing = _standing(points, normal, offset, inliers)
        stands = standing.sum() >= MIN_STANDING_SHARE * len(points)
        plane = (int(stands) + int(normal @ image_up > MIN_UPRIGHT), int(inliers.sum()))
        if best is None or plane > best[0]:
            best = plane, normal, offset, inliers, standing
    if best is None:
        raise HoocError(f'scene {scene_name}: no support plane was found in the depth images, so '
                        'the table frame is unknown; give extrinsics in a table frame')
    _, normal, offset, inliers, standing = best
    T_table_source = _frame(normal, offset, points[standing if standing.any() else inliers],
                            T_source_camera)
    height = transform(T_table_source, points[inliers])[:, 2]
    return SupportPlane(T_table_source, float(inliers.mean()),
                        float(np.sqrt(np.mean(height ** 2))))


def _points(views: Sequence[DepthView]) -> tuple[Float64Array, Float64Array]:
    """Return measured points (n, 3) in the source frame and their plane tolerances (n,)."""
    readings = sum(int(np.isfinite(view.depth).sum()) for view in views)
    step = max(1, int(np.sqrt(readings / MAX_POINTS)))
    points, tolerance = [], []
    for view in views:
        camera, depth = view.camera, view.depth
        rows, cols = np.nonzero(np.isfinite(depth[::step, ::step]))
        if len(rows) == 0:
            continue
        z = depth[::step, ::step][rows, cols].astype(np.float64)
        pixels = np.stack([cols, rows], -1).astype(np.float64) * step
        # OpenCV's model has no skew.
        pixels[:, 0] -= camera.K[0, 1] * (pixels[:, 1] - camera.K[1, 2]) / camera.K[1, 1]
        rays = cv2.undistortPoints(pixels[:, None], camera.K, camera.D)[:, 0]
        points.append(transform(camera.T_world_camera,
                                np.column_stack([rays * z[:, None], z])))
        tolerance.append(TOLERANCE_M + TOLERANCE_PER_M * z ** 2)
    if not points:
        return np.zeros((0, 3)), np.zeros(0)
    return np.concatenate(points), np.concatenate(tolerance)


def _largest_plane(points: Float64Array, tolerance: Float64Array, candidates: BoolArray,
                   rng: np.random.Generator) -> tuple[Float64Array, float, BoolArray]:
    """Return (unit normal (3,), offset, inliers (n,) bool) of n . p + offset = 0."""
    index = np.flatnonzero(candidates)
    # A sample is enough to rank the planes; the fit then uses every point.
    sample = rng.choice(index, min(len(index), 4000), replace=False)
    corners = points[rng.choice(index, (TRIALS, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals, corners = normals[length > 1e-9], corners[length > 1e-9]
    if len(normals) == 0:
        return np.array([0.0, 0.0, 1.0]), 0.0, np.zeros(len(points), bool)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = -np.sum(normals * corners[:, 0], axis=1)
    hits = np.abs(points[sample] @ normals.T + offsets) < tolerance[sample, None]
    best = int(np.argmax(hits.sum(0)))
    normal, offset = normals[best], offsets[best]
    for _ in range(5):
        inliers = candidates & (np.abs(points @ normal + offset) < tolerance)
        if inliers.sum() < 3:
            break
        weight = tolerance[inliers] ** -2
        mean = np.average(points[inliers], axis=0, weights=weight)
        centred = points[inliers] - mean
        normal = np.linalg.eigh((centred * weight[:, None]).T @ centred)[1][:, 0]
        offset = -normal @ mean
    return normal, float(offset), candidates & (np.abs(points @ normal + offset) < tolerance)


def _standing(points: Float64Array, normal: Float64Array, offset: float,
              inliers: BoolArray) -> BoolArray:
    """Return (n,) bool: points above the plane's largest connected piece."""
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    flat = points @ np.stack([across, np.cross(normal, across)], 1)
    height = points @ normal + offset
    near = inliers | ((height > LOWEST_M) & (height < HIGHEST_M))
    low = np.quantile(flat[inliers], 0.01, axis=0) - 0.5
    high = np.minimum(np.quantile(flat[inliers], 0.99, axis=0) + 0.5, low + 2000 * CELL_M)
    near &= ((flat >= low) & (flat < high)).all(1)
    cells = ((flat - low) / CELL_M).astype(np.int64, casting='unsafe')
    cells = np.clip(cells, 0, 1999)
    grid = np.zeros(((high - low) / CELL_M).astype(int) + 2, np.uint8)
    on_plane = near & inliers
    grid[cells[on_plane, 0], cells[on_plane, 1]] = 255
    # Objects hide parts of the table: close these holes before finding connected pieces.
    grid = cv2.morphologyEx(grid, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(grid)
    if count < 2:
        return np.zeros(len(points), bool)
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    outline = cv2.convexHull(np.argwhere(pieces == largest)[:, ::-1].astype(np.int32))
    table = cv2.fillConvexPoly(np.zeros_like(grid), outline, 1)
    standing = near & (height > LOWEST_M) & (height < HIGHEST_M)
    standing[standing] = table[cells[standing, 0], cells[standing, 1]] > 0
    return standing


def _frame(normal: Float64Array, offset: float, points: Float64Array,
           T_source_camera: Float64Array) -> Float64Array:
    """Return T_table_source with the origin below the middle of the points' footprint."""
    z = normal
    right = T_source_camera[:3, 0]
    x = right - z * (right @ z)
    if np.linalg.norm(x) < 0.1:
        x = np.cross(T_source_camera[:3, 1], z)
    x /= np.linalg.norm(x)
    T_table_source = np.eye(4)
    T_table_source[:3, :3] = np.stack([x, np.cross(z, x), z])
    T_table_source[2, 3] = offset
    flat = transform(T_table_source, points)[:, :2]
    # Each cell counts once, so that neither tall nor near objects bias the middle.
    T_table_source[:2, 3] = -CELL_M * (np.unique(np.floor(flat / CELL_M), axis=0) + 0.5).mean(0)
    return T_table_source
