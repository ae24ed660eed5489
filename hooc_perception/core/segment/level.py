# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Support plane per camera: a small pose correction that puts the visible table at z = 0."""

from dataclasses import replace

from hooc_perception.core.arrays import AnyArray, Float64Array
from hooc_perception.core.geometry import back_project
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np
from scipy.spatial.transform import Rotation

# A plane is fitted to at least and at most so many points of the table band.
FEWEST_POINTS, MOST_POINTS, FEWEST_INLIERS = 500, 20_000, 200
ROUNDS = 6
# Inliers are never narrower than this, and the noise is never believed to lie outside of these.
NARROWEST_M, LEAST_SIGMA_M, MOST_SIGMA_M = 0.002, 0.0005, 0.02
MAX_SLOPE = 0.05


def level(view: RectifiedView, config: ObserveConfig, radius_m: float) -> tuple[Camera, float]:
    """
    Fit the support plane that one camera sees and move the camera so that it lies at z = 0.

    Only height, roll and pitch can be observed from a plane; heading and position on the table
    stay as calibrated. A correction that is too large is rejected.

    :param radius_m: horizontal distance from the origin within which to look.
    :return: (camera, with the corrected pose; standard deviation of the heights of the table in
        metres, NaN if the view shows too little of it).
    """
    points = back_project(view.depth, view.camera).reshape(-1, 3)
    near = ((np.abs(points[:, 2]) < config.table_band_m)
            & (np.hypot(points[:, 0], points[:, 1]) < radius_m))
    if near.sum() < FEWEST_POINTS:
        return view.camera, np.nan
    fit = fitted_plane(points[near][::max(1, int(near.sum()) // MOST_POINTS)],
                        config.table_band_m)
    if fit is None:
        return view.camera, np.nan
    plane, sigma = fit
    if abs(plane[2]) > config.max_correction_m or np.hypot(*plane[:2]) > MAX_SLOPE:
        return view.camera, sigma
    T = levelling(plane)
    return replace(view.camera, T_world_camera=T @ view.camera.T_world_camera), sigma


def fitted_plane(points: Float64Array,
                  band_m: float) -> tuple[Float64Array, float] | None:
    """
    Fit z = a x + b y + c to points (n, 3) by least squares over a narrowing set of inliers.

    :return: ((3,) a, b, c; standard deviation of the inliers, metres), None without inliers.
    """
    A = np.column_stack([points[:, 0], points[:, 1], np.ones(len(points))])
    # The median is robust against low objects in the band; the fit then narrows around it.
    plane: AnyArray = np.array([0, 0, np.median(points[:, 2])])
    sigma = band_m / 3
    for _ in range(ROUNDS):
        residual = points[:, 2] - A @ plane
        keep = np.abs(residual) < max(2.0 * sigma, NARROWEST_M)
        if keep.sum() < FEWEST_INLIERS:
            return None
        plane = np.linalg.lstsq(A[keep], points[keep, 2], rcond=None)[0]
        residual = points[:, 2] - A @ plane
        # 1.4826 MAD is the standard deviation of a normal distribution; 1.2 makes up for the
        # tails that the inlier threshold cuts off.
        sigma = float(np.clip(1.4826 * np.median(np.abs(residual[keep])) * 1.2,
                              LEAST_SIGMA_M, MOST_SIGMA_M))
    return plane, sigma


def levelling(plane: Float64Array) -> Float64Array:
    """Return the (4, 4) transform that turns and lifts the plane z = a x + b y + c to z = 0."""
    normal = np.array([-plane[0], -plane[1], 1.0])
    normal /= np.linalg.norm(normal)
    T = np.eye(4)
    axis = np.cross(normal, [0, 0, 1.0])
    s = np.linalg.norm(axis)
    if s > 1e-12:
        T[:3, :3] = Rotation.from_rotvec(axis / s * np.arcsin(min(s, 1.0))).as_matrix()
    T[2, 3] = -plane[2]
    return T
