# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 1: depth images become views set against the empty table.

Undistortion, a small correction of every camera's pose from the table that it sees, the
depth of the empty scene, and the foreground: what stands on the table.
"""

from dataclasses import dataclass, replace

from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import back_project, canonical_pose, rays
from hooc_perception.core.segment.kernels.undistort import rectify_nearest
from hooc_perception.core.segment.uneven import uneven_table
from hooc_perception.core.types import Observation, ObservedView, RectifiedView
from hooc_perception.errors import HoocError
import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class ObserveConfig(Config):
    """Parameters of stage 1."""

    max_depth_m: float = param(4.0, 'Readings farther away count as none.', 'm', 0.3, 20.0)
    table_band_m: float = param(
        0.025, 'Points within this height of z = 0 vote for the table plane; wide enough for '
        'a calibration error of a few millimetres and a degree.', 'm', 0.005, 0.1)
    workspace_radius_m: float = param(
        0.8, 'Only what lies within this horizontal distance of the world origin can be an '
        'object or correct the plane.', 'm', 0.1, 3.0)
    max_height_m: float = param(0.6, 'Nothing higher above the table is an object.', 'm', 0.05, 2)
    max_correction_m: float = param(
        0.02, 'A plane correction larger than this is not trusted and left out.', 'm', 0.0, 0.1)
    foreground_sigma: float = param(
        3.0, 'A point is foreground from this multiple of the table noise on.', '', 1.0, 10.0)
    min_foreground_m: float = param(
        0.004, 'Smallest height above the table that is foreground.', 'm', 0.001, 0.05)
    uneven_m: float = param(
        0.12, 'Sensors bend a flat table by some millimetres, over lengths from this on; what '
        'stands out from its surroundings by less than the whole bend is foreground all the '
        'same. 0 = the table is taken for flat.', 'm', 0.0, 1.0)


def rectify(view, config=ObserveConfig()):
    """
    Undistort one raw depth image to the same intrinsics.

    Each rectified pixel takes the nearest raw pixel: interpolation would invent surfaces at
    depth edges. Depth along the optical axis does not change under undistortion.

    :param view: DepthView, `depth` (H, W) float32 metres with NaN = none.
    :return: RectifiedView whose camera has neither distortion nor skew.
    :raises HoocError: where the image and its calibration disagree in size.
    """
    camera = view.camera
    if view.depth.shape != (camera.height, camera.width):
        raise HoocError(
            f'the depth image of camera {camera.name} is {view.depth.shape[1]} x '
            f'{view.depth.shape[0]} pixels, but its calibration is for {camera.width} x '
            f'{camera.height}; record both at the same resolution')
    depth = _undistorted(view.depth, camera)
    depth[~(depth <= config.max_depth_m) | (depth <= 0)] = np.nan
    K = camera.K.copy()
    K[0, 1] = 0
    # The pose goes to other processes as a quaternion and must mean the same there.
    return RectifiedView(replace(camera, K=K, D=np.zeros(len(camera.D)),
                                 T_world_camera=canonical_pose(camera.T_world_camera)), depth)


def rectified_numbers(image, camera):
    """Return (H, W) uint8 of a raw image moved to where `rectify` moves its depth; else 0."""
    return np.nan_to_num(_undistorted(image, camera)).astype(np.uint8)


def _undistorted(image, camera):
    """Return (H, W) float32 of a raw image without the lens distortion and skew of its Camera."""
    d = np.zeros(8)
    d[:len(camera.D)] = camera.D[:8]
    return rectify_nearest(np.ascontiguousarray(image, np.float32),
                           np.ascontiguousarray(camera.K, np.float64), d)


def observe(views, config=ObserveConfig()):
    """
    Set rectified views against the empty table.

    :param views: sequence of RectifiedView in camera order; world z = 0 is the table top.
        A view without any reading stands for a camera that has dropped out: it shows nothing
        and rules nothing out.
    :return: Observation; pure and deterministic in its input.
    :raises HoocError: where no view holds any reading.
    """
    if not views:
        raise HoocError('there is no depth image to look at; give at least one camera')
    if not any(np.isfinite(view.depth).any() for view in views):
        raise HoocError(f'the depth image of camera {views[0].camera.name} holds no reading '
                        'at all (every pixel is 0 or NaN), nor does any other; check the '
                        'sensors and the unit')
    fits = [_level(view, config) for view in views]
    noise = [sigma for _, sigma in fits if np.isfinite(sigma)]
    noise_m = float(np.clip(np.median(noise), 0.0005, 0.02)) if noise else 0.003
    return Observation(tuple(_against_table(replace(view, camera=camera), sigma, noise_m, config)
                             for view, (camera, sigma) in zip(views, fits)), noise_m)


def _level(view, config):
    """Return the camera moved so that its table lies at z = 0, and the heights' sigma (m)."""
    points = back_project(view.depth, view.camera).reshape(-1, 3)
    near = ((np.abs(points[:, 2]) < config.table_band_m)
            & (np.hypot(points[:, 0], points[:, 1]) < config.workspace_radius_m))
    if near.sum() < 500:
        return view.camera, np.nan
    p = points[near][::max(1, int(near.sum()) // 20000)]
    A = np.column_stack([p[:, 0], p[:, 1], np.ones(len(p))])
    keep = np.ones(len(p), bool)
    # The median is robust against low objects in the band; the fit then narrows around it.
    coef, sigma = np.array([0, 0, np.median(p[:, 2])]), config.table_band_m / 3
    for _ in range(6):
        residual = p[:, 2] - A @ coef
        keep = np.abs(residual) < max(2.0 * sigma, 0.002)
        if keep.sum() < 200:
            return view.camera, np.nan
        coef = np.linalg.lstsq(A[keep], p[keep, 2], rcond=None)[0]
        residual = p[:, 2] - A @ coef
        sigma = float(np.clip(1.4826 * np.median(np.abs(residual[keep])) * 1.2, 0.0005, 0.02))
    if abs(coef[2]) > config.max_correction_m or np.hypot(*coef[:2]) > 0.05:
        return view.camera, sigma
    normal = np.array([-coef[0], -coef[1], 1.0])
    normal /= np.linalg.norm(normal)
    T = np.eye(4)
    axis = np.cross(normal, [0, 0, 1.0])
    s = np.linalg.norm(axis)
    if s > 1e-12:
        T[:3, :3] = Rotation.from_rotvec(axis / s * np.arcsin(min(s, 1.0))).as_matrix()
    T[2, 3] = -coef[2]
    return replace(view.camera, T_world_camera=T @ view.camera.T_world_camera), sigma


def _against_table(view, sigma, noise_m, config):
    """Return the ObservedView of one levelled, rectified view."""
    camera, depth = view.camera, view.depth
    T, (h, w) = camera.T_world_camera, depth.shape
    directions = rays(camera.K, h, w) @ T[:3, :3].T
    with np.errstate(divide='ignore', invalid='ignore'):
        plane = -T[2, 3] / directions[..., 2]
        plane[(directions[..., 2] >= 0) | (plane <= 0)] = np.nan
        points = directions * depth[..., None] + T[:3, 3]
        hit = directions[..., :2] * plane[..., None] + T[:2, 3]
    seen = np.isfinite(depth)
    sigma = noise_m if not np.isfinite(sigma) else sigma
    threshold = max(config.min_foreground_m, config.foreground_sigma * sigma)
    inside = np.hypot(hit[..., 0], hit[..., 1]) < 1.6 * config.workspace_radius_m
    behind = seen & (depth > plane + 0.05)
    table = np.isfinite(plane) & inside & ~_opened(behind)
    near = np.hypot(points[..., 0], points[..., 1]) < config.workspace_radius_m
    height = points[..., 2]
    above = height > threshold
    if config.uneven_m > 0:
        flat = seen & inside & (np.abs(height) < config.table_band_m)
        pixels = config.uneven_m * camera.K[0, 0] / np.median(depth[flat]) if flat.any() else 0
        base, local = uneven_table(height, flat & ~above, pixels)
        above |= height - base > max(config.min_foreground_m, config.foreground_sigma * local)
    foreground = seen & near & above & (height < config.max_height_m)
    foreground &= ~_tiny(foreground)
    # Off the table nothing is known of the empty scene but what is measured there.
    background = np.where(table, plane, np.where(seen & ~foreground, depth, np.nan))
    return ObservedView(camera, depth, background.astype(np.float32), foreground, table)


def _opened(mask):
    """Return the mask without specks: single pixels behind the table are noise."""
    return ndimage.binary_opening(mask, np.ones((3, 3), bool))


def _tiny(mask):
    """Return the pixels of connected parts of fewer than six pixels: flying pixels."""
    labels, n = ndimage.label(mask, np.ones((3, 3), int))
    return np.bincount(labels.ravel(), minlength=n + 1)[labels] < 6
