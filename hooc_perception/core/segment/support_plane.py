# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Find the support plane in depth images whose world frame is not that of a table.

Recorded sets of an unknown world and live cameras in the frame of a robot share this code.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hooc_perception.core.arrays import AnyArray, BoolArray, Float64Array
from hooc_perception.core.geometry import back_project, stage_rng, transform
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np
from scipy import ndimage
from scipy.spatial import ConvexHull, QhullError

# Depth is thinned to about this many points per scene; a plane needs no more.
MAX_POINTS = 40_000
TRIALS = 400
# Number of planes to try, largest first: a table may be smaller than the wall behind it.
MAX_PLANES = 3
MIN_SHARE, FEWEST_POINTS = 0.08, 50
# A point within this distance belongs to a plane: a calibration error plus noise that grows
# with the square of the distance (Khoshelham & Elberink 2012, structured light).
TOLERANCE_M, TOLERANCE_PER_M = 0.006, 0.004
# Height range of points on objects that stand on the table.
LOWEST_M, HIGHEST_M = 0.015, 0.5
MIN_STANDING_SHARE = 0.003
# Least cosine between a plane's normal and the images' upward direction; 0 seen from above.
MIN_UPRIGHT = 0.1
CELL_M = 0.02
# Cells along each side of the grid over the plane, at most.
MOST_CELLS = 2000


@dataclass(frozen=True)
class PlaneBounds:
    """
    Where the support plane may be in a source frame whose z axis points up.

    :ivar low_m, high_m: bounds of its height above z = 0, in the middle of its readings.
    :ivar tilt_rad: largest angle between its normal and the z axis.
    """

    low_m: float
    high_m: float
    tilt_rad: float

    def admit(self, normals: Float64Array, middle: Float64Array,
              offsets: Float64Array) -> BoolArray:
        """Return (n,) bool: which planes n . p + offset = 0 (n, 3), (n,) lie in the bounds."""
        up = np.abs(normals[:, 2])
        with np.errstate(divide='ignore', invalid='ignore'):
            z = -(normals[:, :2] @ middle[:2] + offsets) / normals[:, 2]
        return (up >= np.cos(self.tilt_rad)) & (z >= self.low_m) & (z <= self.high_m)


@dataclass(frozen=True, eq=False)
class SupportPlane:
    """
    A table frame estimated from depth: z up, origin below the centre of the objects on it.

    Its x axis points to the right in the first camera's image.

    :ivar T_table_source: (4, 4) float64, from the frame of the camera poses to the table frame.
    :ivar inlier_share: share of the measured points that lie on the plane.
    :ivar residual_m: RMS distance of those points from the plane.
    :ivar outline: (k, 2) float64 convex outline of the plane's largest connected piece, table
        frame, metres; empty where it is too small for one.
    """

    T_table_source: Float64Array
    inlier_share: float
    residual_m: float
    outline: Float64Array


def find_support_plane(views: Sequence[RectifiedView],
                       bounds: PlaneBounds | None = None) -> SupportPlane | None:
    """
    Return the SupportPlane of one frame set: RANSAC, then a least-squares fit to the inliers.

    The table is the largest plane that supports objects and whose normal points upwards: in the
    images, as a table's does for an upright camera and a wall's does not, or within `bounds`. If
    no plane meets both conditions, one is enough; bounds are always met. The same views give the
    same frame.

    :param views: the poses of their cameras define the source frame.
    :param bounds: None = nothing is known about the source frame, not even which way is up.
    :return: None if no plane contains at least MIN_SHARE of the points.
    """
    points, tolerance = measured_points(views)
    cameras = [view.camera for view in views]
    rng = stage_rng(0, 'table')
    left = np.ones(len(points), bool)
    best = None
    for _ in range(MAX_PLANES):
        if left.sum() < max(MIN_SHARE * len(points), FEWEST_POINTS):
            break
        normal, offset, inliers = _largest_plane(points, tolerance, left, rng, bounds)
        if inliers.sum() < MIN_SHARE * len(points):
            break
        left &= ~inliers
        normal, offset = _upwards(normal, offset, cameras, bounds)
        if bounds and not (bounds.admit(normal[None], points[inliers].mean(0),
                                        np.array([offset]))[0]
                           and _seen_from_above(normal, offset, cameras)):
            continue
        standing, outline = _standing(points, normal, offset, inliers)
        stands = standing.sum() >= MIN_STANDING_SHARE * len(points)
        upright = bounds is not None or normal @ _image_up(cameras) > MIN_UPRIGHT
        plane = (int(stands) + int(upright), int(inliers.sum()))
        if best is None or plane > best[0]:
            best = plane, normal, offset, inliers, standing, outline
    if best is None:
        return None
    _, normal, offset, inliers, standing, outline = best
    T = _frame(normal, offset, points[standing if standing.any() else inliers],
               cameras[0].T_world_camera)
    height = transform(T, points[inliers])[:, 2]
    return SupportPlane(T, float(inliers.mean()), float(np.sqrt(np.mean(height ** 2))),
                        transform(T, outline)[:, :2])


def measured_points(views: Sequence[RectifiedView],
                    most: int = MAX_POINTS) -> tuple[Float64Array, Float64Array]:
    """
    Return measured points (n, 3) of the world frame and their tolerances (n,) as to a plane.

    :param most: about how many points to return.
    """
    readings = sum(int(np.isfinite(view.depth).sum()) for view in views)
    step = max(1, int(np.sqrt(readings / most)))
    points, tolerance = [np.zeros((0, 3))], [np.zeros(0)]
    for view in views:
        depth = view.depth[::step, ::step]
        K = view.camera.K.copy()
        K[:2] /= step
        cloud = back_project(depth, replace(view.camera, K=K)).reshape(-1, 3)
        seen = np.isfinite(cloud[:, 2])
        points.append(cloud[seen])
        tolerance.append(TOLERANCE_M + TOLERANCE_PER_M * depth.ravel()[seen].astype(float) ** 2)
    return np.concatenate(points), np.concatenate(tolerance)


def plane_outline(points: Float64Array, on_plane: BoolArray) -> Float64Array:
    """
    Return the convex outline of the largest connected piece of a plane.

    :param points: (n, 3) in the table frame; `on_plane` (n,) bool.
    :return: (k, 2) corners in order, table frame, metres; (0, 2) where there is too little.
    """
    if not on_plane.any():
        return np.zeros((0, 2))
    piece = _largest_piece(points[:, :2], on_plane)
    return np.zeros((0, 2)) if piece is None else piece[1]


def _image_up(cameras: Sequence[Camera]) -> Float64Array:
    """Return (3,) the mean upward direction of the images."""
    return -np.mean([camera.T_world_camera[:3, 1] for camera in cameras], axis=0)


def _upwards(normal: Float64Array, offset: float, cameras: Sequence[Camera],
             bounds: PlaneBounds | None) -> tuple[Float64Array, float]:
    """Return the plane with its normal up: along z within bounds, else towards the camera."""
    up = normal[2] if bounds else normal @ cameras[0].T_world_camera[:3, 3] + offset
    return (normal, offset) if up >= 0 else (-normal, -offset)


def _seen_from_above(normal: Float64Array, offset: float, cameras: Sequence[Camera]) -> bool:
    """Return whether all cameras are above a plane: a ceiling is no table."""
    return all(normal @ camera.T_world_camera[:3, 3] + offset > 0 for camera in cameras)


def _largest_plane(points: Float64Array, tolerance: Float64Array, candidates: BoolArray,
                   rng: np.random.Generator, bounds: PlaneBounds | None
                   ) -> tuple[Float64Array, float, BoolArray]:
    """Return (unit normal (3,), offset, inliers (n,) bool) of n . p + offset = 0."""
    index = np.flatnonzero(candidates)
    # A sample is enough to rank the planes; the fit then uses every point.
    sample = rng.choice(index, min(len(index), 4000), replace=False)
    corners = points[rng.choice(index, (TRIALS, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals, corners = normals[length > 1e-9], corners[length > 1e-9]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = -np.sum(normals * corners[:, 0], axis=1)
    if bounds is not None:
        within = bounds.admit(normals, corners[:, 0].mean(0), offsets)
        normals, offsets = normals[within], offsets[within]
    if len(normals) == 0:
        return np.array([0.0, 0.0, 1.0]), 0.0, np.zeros(len(points), bool)
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
              inliers: BoolArray) -> tuple[BoolArray, Float64Array]:
    """Return (n,) bool: points above the plane's largest piece; (k, 3) the outline of that."""
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    axes: AnyArray = np.stack([across, np.cross(normal, across)], 1)
    flat = points @ axes
    height = points @ normal + offset
    piece = _largest_piece(flat, inliers)
    if piece is None:
        return np.zeros(len(points), bool), np.zeros((0, 3))
    halfplanes, outline = piece
    standing = (height > LOWEST_M) & (height < HIGHEST_M)
    standing[standing] = (flat[standing] @ halfplanes[:, :2].T + halfplanes[:, 2]
                          <= CELL_M / 2).all(1)
    return standing, outline @ axes.T - normal * offset


def _largest_piece(flat: Float64Array,
                   inliers: BoolArray) -> tuple[Float64Array, Float64Array] | None:
    """
    Return the convex hull of the largest connected piece of a plane.

    :param flat: (n, 2) points in the plane, metres.
    :return: ((m, 3) half-planes a x + b y + c <= 0; (k, 2) corners), None where it is too small.
    """
    low = np.quantile(flat[inliers], 0.01, axis=0) - 0.5
    high = np.minimum(np.quantile(flat[inliers], 0.99, axis=0) + 0.5, low + MOST_CELLS * CELL_M)
    near = inliers & ((flat >= low) & (flat < high)).all(1)
    grid = np.zeros(((high - low) / CELL_M).astype(int) + 2, bool)
    cells = ((flat[near] - low) / CELL_M).astype(np.int64)
    grid[cells[:, 0], cells[:, 1]] = True
    # Objects hide parts of the table: close these holes before finding connected pieces.
    grid = ndimage.binary_closing(grid, np.ones((5, 5), bool))
    labels = np.empty(grid.shape, np.int32)
    if not ndimage.label(grid, np.ones((3, 3), int), output=labels):
        return None
    largest = 1 + int(np.argmax(np.bincount(labels.ravel())[1:]))
    try:
        hull = ConvexHull((np.argwhere(labels == largest) + 0.5) * CELL_M + low)
    except QhullError:
        return None     # a single row of cells
    return hull.equations, hull.points[hull.vertices]


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
