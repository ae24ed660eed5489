# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a view shows a level surface at z = 0, and by which factor its depth misses it."""

from dataclasses import dataclass, replace

from hooc_perception.core.arrays import Float32Array, Float64Array
from hooc_perception.core.geometry import back_project, rays
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np

# A table needs this many readings among every STRIDE-th row and column; small images are read
# more densely.
STRIDE, ROWS, TABLE_READINGS = 4, 60, 100
# A plane through z = 0 that is not the table cuts any surface: the table is also level. Normals
# are taken over REACH strides to each side; noise turns those of a real table by up to 10 degrees.
REACH, LEVEL_DEG, MIN_LEVEL_SHARE = 2, 20.0, 0.3
# Units that depth is mistaken for: powers of ten, inches, and the fractions of a millimetre that
# depth cameras count in.
FACTORS = (1000.0, 100.0, 39.37, 25.4, 10.0, 8.0, 5.0, 4.0, 2.54, 2.0,
           0.5, 0.3937, 0.25, 0.2, 0.125, 0.1, 0.03937, 0.0254, 0.01, 0.001)
FACTOR_TOLERANCE, FACTOR_SHARE, FACTOR_BIAS = 0.05, 0.3, 0.02


@dataclass(frozen=True)
class TableSight:
    """
    What a view measures near the origin.

    :ivar near: (n, 3) float64 readings within the radius, world, metres.
    :ivar band: readings among them at z = 0.
    :ivar level: readings among those whose surface is level.
    :ivar tilt_deg: median angle between the surface at z = 0 and the level, NaN if unknown.
    """

    near: Float64Array
    band: int
    level: int
    tilt_deg: float

    @property
    def sees_table(self) -> bool:
        """Return whether enough level surface lies at z = 0."""
        return self.level >= max(TABLE_READINGS, MIN_LEVEL_SHARE * self.band)


def table_sight(view: RectifiedView, band_m: float, radius_m: float) -> TableSight:
    """
    Look for the table at z = 0.

    :param band_m: height around z = 0 that counts as table, metres.
    :param radius_m: horizontal distance from the origin within which to look, metres.
    """
    points = back_project(*_thinned(view))
    near = np.isfinite(points[..., 2]) & (np.hypot(points[..., 0], points[..., 1]) < radius_m)
    band = near & (np.abs(points[..., 2]) < band_m)
    cosine = _upright(points)
    with np.errstate(invalid='ignore'):
        level = band & (cosine > np.cos(np.radians(LEVEL_DEG)))
    known = cosine[band & np.isfinite(cosine)]
    tilt = float(np.degrees(np.arccos(np.median(known)))) if len(known) else np.nan
    return TableSight(points[near], int(band.sum()), int(level.sum()), tilt)


def depth_factor(view: RectifiedView, radius_m: float) -> float | None:
    """
    Return the number by which the depth must be multiplied to show the table at z = 0.

    The pixels of a flat table agree on this number, whatever stands on it; those of a table
    that is elsewhere do not.

    :return: one of FACTORS, None where the pixels agree on none of them.
    """
    depth, camera = _thinned(view)
    T = camera.T_world_camera
    directions = rays(camera.K, *depth.shape) @ T[:3, :3].T
    with np.errstate(divide='ignore', invalid='ignore'):
        plane = -T[2, 3] / directions[..., 2]
        hits = directions[..., :2] * plane[..., None] + T[:2, 3]
        useful = (plane > 0) & (np.hypot(hits[..., 0], hits[..., 1]) < radius_m) & (depth > 0)
        ratio = plane[useful] / depth[useful]
    if len(ratio) < TABLE_READINGS:
        return None
    shares = [float((np.abs(ratio / factor - 1) < FACTOR_TOLERANCE).mean()) for factor in FACTORS]
    best = int(np.argmax(shares))
    agreeing = ratio[np.abs(ratio / FACTORS[best] - 1) < FACTOR_TOLERANCE]
    # A table that lies elsewhere has a ratio, too, but hardly that of a unit.
    if shares[best] < FACTOR_SHARE or (
            abs(np.median(agreeing) / FACTORS[best] - 1) > FACTOR_BIAS):
        return None
    return FACTORS[best]


def _thinned(view: RectifiedView) -> tuple[Float32Array, Camera]:
    """Return every few rows and columns of a depth image, and the camera that they fit."""
    stride = int(np.clip(min(view.depth.shape) // ROWS, 1, STRIDE))
    K = view.camera.K.copy()
    K[:2] /= stride
    return view.depth[::stride, ::stride], replace(view.camera, K=K)


def _upright(points: Float64Array) -> Float64Array:
    """Return (H, W) |cosine| between the surface's normal and z, NaN where it is unknown."""
    cosine = np.full(points.shape[:2], np.nan)
    if min(cosine.shape) <= 2 * REACH:
        return cosine
    inner = slice(REACH, -REACH)
    across = points[inner, 2 * REACH:] - points[inner, :-2 * REACH]
    down = points[2 * REACH:, inner] - points[:-2 * REACH, inner]
    normal = np.cross(across, down)
    with np.errstate(invalid='ignore', divide='ignore'):
        cosine[inner, inner] = np.abs(normal[..., 2]) / np.linalg.norm(normal, axis=-1)
    return cosine
