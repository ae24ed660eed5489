# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Sanity checks of cameras from one frame: readings, pose, table, calibration, rig.

Each check returns None, or one sentence that says what is wrong and how to fix it. The
ingestion node reports it while running, `hooc doctor` for a bag.
"""

from collections.abc import Sequence, Sized

from hooc_perception.core.arrays import Float32Array, Float64Array
from hooc_perception.core.segment.pose_reading import (
    LITTLE,
    pose_reading,
    WORKSPACE_M,
    workspace_share,
)
from hooc_perception.core.segment.table_sight import depth_factor, TABLE_READINGS, table_sight
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np

FARTHEST_CAMERA_M = 10.0
# Where most cameras stand: tells a wrong unit of the depth from one of the translation.
NEAREST_CAMERA_M, USUAL_CAMERA_M = 0.25, 4.0
# As a share of the focal length; more means that the numbers of the matrix are out of order.
MAX_SKEW = 0.05


def reading_trouble(depth: Float32Array) -> str | None:
    """Check that a depth image (H, W) in metres, NaN = none, holds any reading."""
    if np.isfinite(depth).any():
        return None
    return 'it holds no reading at all (every pixel is 0, NaN or infinite); check the sensor'


def pose_trouble(camera: Camera) -> str | None:
    """Check that a camera stands above the table, near it, and looks at it."""
    T = camera.T_world_camera
    away = float(np.linalg.norm(T[:3, 3]))
    if away > FARTHEST_CAMERA_M:
        return _misplaced(camera, f'it stands {away:.3g} m away from the table',
                          'extrinsics are in metres, and the origin of the target frame is on '
                          'the table')
    if T[2, 3] <= 0:
        return _misplaced(camera, f'its pose lies {-T[2, 3]:.2f} m below the table',
                          'the transform may be inverted (wanted: camera to world, z up)')
    corners = np.array([[u, v, 1.0] for u in (0, camera.width - 1) for v in (
        0, camera.height - 1)]) @ np.linalg.inv(camera.K).T @ T[:3, :3].T
    if (corners[:, 2] >= 0).all() and T[2, 2] >= 0:
        return _misplaced(camera, 'it looks up, away from the table',
                          'check that its extrinsics belong to the optical frame (x right, y '
                          'down, z forward)')
    return None


def aim_trouble(camera: Camera) -> str | None:
    """
    Check that a camera looks at the workspace, as far as its pose alone tells.

    A camera that is turned elsewhere is reported where a usual mistake explains it, or where it
    has no part of the workspace in view.
    """
    if trouble := pose_trouble(camera):
        return trouble
    share = workspace_share(camera)
    if share > LITTLE or share > 0 and not pose_reading(camera):
        return None
    return _misplaced(camera, f'it has {share:.0%} of the workspace in view, {WORKSPACE_M:g} m '
                      'around the origin of the table', 'check its extrinsics (optical frame: x '
                      'right, y down, z forward), and that the frame lies on the table')


def _misplaced(camera: Camera, what: str, fix: str) -> str:
    """Return the sentence on an implausible pose, with the mistake that explains it."""
    reading = pose_reading(camera)
    return f'{what}, but it would be right if {reading}' if reading else f'{what}; {fix}'


def table_trouble(view: RectifiedView, band_m: float, radius_m: float) -> str | None:
    """
    Check that a view shows the table where its pose says: a level surface at z = 0.

    :param band_m: height around z = 0 that counts as table, metres.
    :param radius_m: horizontal distance from the origin within which to look, metres.
    """
    sight = table_sight(view, band_m, radius_m)
    if sight.sees_table:
        return None
    factor = depth_factor(view, radius_m)
    if factor:
        away = float(np.linalg.norm(view.camera.T_world_camera[:3, 3]))
        what, times = (('depth', factor) if NEAREST_CAMERA_M < away < USUAL_CAMERA_M else
                       ('translation', 1 / factor))
        return (f'it would measure the table at z = 0 of the target frame if its {what} were '
                f'{times:g} times as large; check the unit of its {what}')
    if len(sight.near) < TABLE_READINGS:
        trouble = (f'it measures nothing within {radius_m:g} m of the origin of the target frame; '
                   'check its extrinsics, and that the frame lies on the table')
    elif sight.band >= TABLE_READINGS:
        trouble = ('what it measures at z = 0 of the target frame is not level (it is tilted by '
                   f'{sight.tilt_deg:.0f} degrees); check its extrinsics, and that z points up')
    else:
        heights = np.histogram(sight.near[:, 2], np.arange(-2.0, 2.0, 0.02))
        most = heights[1][heights[0].argmax()] + 0.01
        trouble = (f'it measures no table at z = 0 of the target frame (most readings lie at z = '
                   f'{most:.2f} m); check its extrinsics, and that z = 0 is the table top')
    if workspace_share(view.camera) < LITTLE and (reading := pose_reading(view.camera)):
        trouble += f' (its pose would be right if {reading})'
    return trouble


def table_troubles(views: Sequence[RectifiedView], band_m: float,
                   radius_m: float) -> dict[str, str]:
    """
    Return {camera: sentence} of the views that do not show the table; see `table_trouble`.

    Views without any reading, of cameras that have dropped out, are passed over.
    """
    return {view.camera.name: trouble for view in views if np.isfinite(view.depth).any()
            and (trouble := table_trouble(view, band_m, radius_m))}


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
