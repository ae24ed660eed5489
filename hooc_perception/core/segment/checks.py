# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Sanity checks of cameras from one frame: readings, pose, table, calibration, rig.

Each check returns None, or one sentence that says what is wrong and how to fix it. The
ingestion node reports it while running, `hooc doctor` for a bag.
"""

from collections.abc import Sequence, Sized
from dataclasses import replace

from hooc_perception.core.arrays import Float32Array, Float64Array
from hooc_perception.core.geometry import back_project
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np

FARTHEST_CAMERA_M = 10.0
# As a share of the focal length; more means that the numbers of the matrix are out of order.
MAX_SKEW = 0.05
# A table needs this many readings, counted in every STRIDE-th row and column.
STRIDE, TABLE_READINGS = 4, 100


def reading_trouble(depth: Float32Array) -> str | None:
    """Check that a depth image (H, W) in metres, NaN = none, holds any reading."""
    if np.isfinite(depth).any():
        return None
    return 'it holds no reading at all (every pixel is 0, NaN or infinite); check the sensor'


def pose_trouble(camera: Camera) -> str | None:
    """Check that a camera stands above the table, near it, and looks at it."""
    T = camera.T_world_camera
    away = float(np.linalg.norm(T[:3, 3]))
    if T[2, 3] <= 0:
        return (f'its pose lies {-T[2, 3]:.2f} m below the table; the transform may be inverted '
                '(wanted: camera to world, z up)')
    if away > FARTHEST_CAMERA_M:
        return (f'it stands {away:.3g} m away from the table; extrinsics are in metres, and the '
                'origin of the target frame is on the table')
    corners = np.array([[u, v, 1.0] for u in (0, camera.width - 1) for v in (
        0, camera.height - 1)]) @ np.linalg.inv(camera.K).T @ T[:3, :3].T
    if (corners[:, 2] >= 0).all() and T[2, 2] >= 0:
        return ('it looks up, away from the table; check that its extrinsics belong to the '
                'optical frame (x right, y down, z forward)')
    return None


def table_trouble(view: RectifiedView, band_m: float, radius_m: float) -> str | None:
    """
    Check that a view shows the table where its pose says.

    :param band_m: height around z = 0 that counts as table, metres.
    :param radius_m: horizontal distance from the origin within which to look, metres.
    """
    K = view.camera.K.copy()
    K[:2] /= STRIDE
    points = back_project(view.depth[::STRIDE, ::STRIDE],
                          replace(view.camera, K=K)).reshape(-1, 3)
    points = points[np.isfinite(points[:, 2])]
    near = points[np.hypot(points[:, 0], points[:, 1]) < radius_m]
    if (np.abs(near[:, 2]) < band_m).sum() >= TABLE_READINGS:
        return None
    if len(near) < TABLE_READINGS:
        return (f'it measures nothing within {radius_m:g} m of the origin of the target frame; '
                'check its extrinsics, and that the frame lies on the table')
    heights = np.histogram(near[:, 2], np.arange(-2.0, 2.0, 0.02))
    most = heights[1][heights[0].argmax()] + 0.01
    return (f'it measures no table at z = 0 of the target frame (most readings lie at z = '
            f'{most:.2f} m); check its extrinsics, and that z = 0 is the table top')


def skew_trouble(K: Float64Array) -> str | None:
    """Check that a camera matrix (3, 3) has no skew beyond what any sensor has."""
    if abs(K[0, 1]) <= MAX_SKEW * K[0, 0]:
        return None
    return (f'a skew of {K[0, 1]:g} pixels, more than {MAX_SKEW:g} of the focal length; '
            'check the order of its numbers or calibrate again')


def rig_size_trouble(cameras: Sized, trained: Sized) -> str | None:
    """Check that there are as many cameras as a view-bound model was trained for."""
    if len(cameras) == len(trained):
        return None
    return (f'the model was trained for {len(trained)} cameras, but there are {len(cameras)}; '
            'train again for this rig, or use the best profile')


def rig_trouble(cameras: Sequence[Camera], trained: Sequence[Camera], shift_m: float = 0.1,
                turn_deg: float = 10.0) -> str | None:
    """
    Check that the cameras of a scene stand where a view-bound model was trained for them.

    :param cameras, trained: in the same order.
    :param shift_m, turn_deg: largest difference of a pose that is accepted.
    """
    if trouble := rig_size_trouble(cameras, trained):
        return trouble
    for camera, known in zip(cameras, trained):
        T = np.linalg.inv(known.T_world_camera) @ camera.T_world_camera
        shift = float(np.linalg.norm(T[:3, 3]))
        turn = float(np.degrees(np.arccos(np.clip((np.trace(T[:3, :3]) - 1) / 2, -1, 1))))
        focal = camera.K[0, 0] / known.K[0, 0]
        if shift > shift_m or turn > turn_deg or not 0.9 < focal < 1.1:
            return (f'{camera.name} stands {shift:.2f} m and {turn:.0f} degrees away from where '
                    f'the model was trained for it (focal length x {focal:.2f}); train again '
                    'for this rig, use the best profile, or order the cameras as in training')
    return None


def same_calibration(a: Camera, b: Camera) -> bool:
    """Return whether two cameras have the same size, intrinsics, distortion and pose."""
    return ((a.width, a.height) == (b.width, b.height) and np.array_equal(a.K, b.K)
            and np.array_equal(a.D, b.D) and np.array_equal(a.T_world_camera, b.T_world_camera))
