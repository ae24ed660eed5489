# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Where the table is in the target frame: given, or found and then tracked.

The stages work in the table frame: z up, z = 0 on the table top, origin in the middle of the
workspace. Results are in the target frame, which is the frame of the camera poses.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.core.geometry import inverse, transform
from hooc_perception.core.segment.config import MOST_RADIUS_M, ObserveConfig
from hooc_perception.core.segment.level import fitted_plane, levelling, MAX_SLOPE
from hooc_perception.core.segment.regions import Region, workspace_of
from hooc_perception.core.segment.support_plane import (
    find_support_plane,
    measured_points,
    plane_outline,
    PlaneBounds,
)
from hooc_perception.core.types import RectifiedView
from hooc_perception.errors import HoocError
import numpy as np

# Points that are looked at to see whether the table is still there.
TRACK_POINTS = 15_000
# What the table has moved by is taken up beyond this; the cameras are levelled in any case.
SHIFT_M, TURN_RAD = 0.004, np.radians(0.4)
# The table is lost where so much less of its outline lies in its plane than when it was found.
LOST_SHARE = 0.5


@dataclass(frozen=True, eq=False)
class Table:
    """
    The support plane in the target frame.

    :ivar T_target_table: (4, 4) float64; None where the target frame is the table frame.
    :ivar outline: (k, 2) float64 convex outline of what was seen of it, table frame, metres;
        empty where too little was seen.
    :ivar residual_m: RMS distance of its readings from the plane; NaN where not measured.
    :ivar share: of the readings inside its outline, how many lie in its plane; NaN if unknown.
    """

    T_target_table: Float64Array | None = None
    outline: Float64Array = field(default_factory=lambda: np.zeros((0, 2)))
    residual_m: float = float('nan')
    share: float = float('nan')

    @property
    def T(self) -> Float64Array:
        """Return T_target_table (4, 4), the identity included."""
        return np.eye(4) if self.T_target_table is None else self.T_target_table

    @property
    def height_m(self) -> float:
        """Return the z of its origin in the target frame."""
        return float(self.T[2, 3])

    @property
    def tilt_rad(self) -> float:
        """Return the angle between its normal and the z axis of the target frame."""
        return float(np.arccos(np.clip(self.T[2, 2], -1, 1)))

    @property
    def corners(self) -> Float64Array:
        """Return the outline (k, 3) in the target frame."""
        return transform(self.T, np.column_stack([self.outline, np.zeros(len(self.outline))]))


def in_table_frame(views: Sequence[RectifiedView],
                   T_target_table: Float64Array | None) -> list[RectifiedView]:
    """Return views, posed in the target frame, with their cameras posed in the table frame."""
    if T_target_table is None:
        return list(views)
    T_table_target = inverse(T_target_table)
    return [replace(view, camera=replace(view.camera, T_world_camera=T_table_target
                                         @ view.camera.T_world_camera)) for view in views]


def radius_m(config: ObserveConfig) -> float:
    """
    Return the radius of the workspace around the origin of the table frame.

    :raises HoocError: where a workspace is larger than anything that cameras see.
    """
    own = workspace_of(config.workspace, config.ignore).radius_m
    if own is not None and own > MOST_RADIUS_M:
        raise HoocError(f'parameter workspace reaches {own:.3g} m from its middle, more than '
                        f'{MOST_RADIUS_M:g} m; its corners are in metres')
    return config.workspace_radius_m if own is None else own


def locate_table(views: Sequence[RectifiedView], config: ObserveConfig) -> Table:
    """
    Return the Table of one frame set, as `config.table` says.

    :param views: posed in the target frame.
    :raises HoocError: where it has to be found and is not there.
    """
    if config.table == 'fixed':
        return measured(Table(_fixed_pose(config)), views, config)
    bounded = config.table_tilt_deg < 180
    plane = find_support_plane(views, PlaneBounds(
        config.table_low_m, config.table_high_m,
        np.radians(config.table_tilt_deg)) if bounded else None)
    if plane is None:
        within = (f'between z = {config.table_low_m:g} m and {config.table_high_m:g} m of the '
                  f'target frame, tilted by at most {config.table_tilt_deg:g} degrees'
                  if bounded else 'in any direction')
        raise HoocError(f'no table is found {within}; check the camera poses and '
                        'observe.table_low_m, table_high_m and table_tilt_deg')
    T = inverse(plane.T_table_source)
    centre = workspace_of(config.workspace, config.ignore).centre
    if centre is not None:
        T = _recentred(T, centre)
    return measured(Table(T, residual_m=plane.residual_m), views, config)


def table_pose(views: Sequence[RectifiedView], config: ObserveConfig) -> Float64Array | None:
    """Return T_target_table (4, 4) of one frame set, None for the identity; see locate_table."""
    if config.table == 'fixed':
        return _fixed_pose(config)
    return locate_table(views, config).T_target_table


def measured(table: Table, views: Sequence[RectifiedView], config: ObserveConfig) -> Table:
    """Return a Table with its outline, and the share of readings there that are in its plane."""
    points, near = _seen(table, views, config)
    outline = plane_outline(points, near)
    share = float(near[_within(outline, points)].mean()) if len(outline) else np.nan
    return replace(table, outline=outline, share=share)


def tracked(table: Table, views: Sequence[RectifiedView], config: ObserveConfig) -> Table | None:
    """
    Return a found Table as the next frame set shows it: itself, or slightly moved.

    :param views: posed in the target frame.
    :return: None where it is no longer there.
    """
    points, near = _seen(table, views, config)
    inside = _within(table.outline, points)
    if not inside.any() or near[inside].mean() < LOST_SHARE * table.share:
        return None
    fit = fitted_plane(points[near], config.table_band_m)
    if fit is None:
        return None
    plane, sigma = fit
    slope = np.hypot(*plane[:2])
    if abs(plane[2]) > config.table_band_m or slope > MAX_SLOPE:
        return None
    if abs(plane[2]) < SHIFT_M and slope < TURN_RAD:
        return table
    T = table.T @ inverse(levelling(plane))
    return measured(replace(table, T_target_table=T, residual_m=sigma), views, config)


def next_table(table: Table | None, views: Sequence[RectifiedView],
               config: ObserveConfig) -> Table:
    """
    Return the Table of a frame set that follows another one with the same parameters.

    A table that is in place is kept to the bit, so that results do not move with it; one that
    has gone is looked for anew.

    :param table: of the frame set before; None = there was none.
    :param views: posed in the target frame.
    :raises HoocError: where it has to be found and is not there.
    """
    if table is not None and config.table == 'find':
        table = tracked(table, views, config)
    return locate_table(views, config) if table is None else table


class TableTracker:
    """
    Follows the table over frame sets.

    :ivar table: as last seen; None before the first, and where it is lost.
    """

    def __init__(self) -> None:
        self.table: Table | None = None
        self._config: ObserveConfig | None = None

    def update(self, views: Sequence[RectifiedView], config: ObserveConfig) -> Table:
        """
        Return the Table of the next frame set, see `next_table`.

        :param views: posed in the target frame.
        :raises HoocError: where it has to be found and is not there; it is looked for again in
            the next set.
        """
        if config != self._config:
            self.table, self._config = None, config
        # A table that is lost is not remembered.
        before, self.table = self.table, None
        self.table = next_table(before, views, config)
        return self.table


def _fixed_pose(config: ObserveConfig) -> Float64Array | None:
    """Return T_target_table where z = 0 of the target frame is the table top."""
    centre = workspace_of(config.workspace, config.ignore).centre
    if centre is None or not centre.any():
        return None
    T = np.eye(4)
    T[:2, 3] = centre
    return T


def _seen(table: Table, views: Sequence[RectifiedView],
          config: ObserveConfig) -> tuple[Float64Array, BoolArray]:
    """Return points (n, 3) of the workspace, table frame, and (n,) bool: near the plane."""
    points, _ = measured_points(in_table_frame(views, table.T_target_table), TRACK_POINTS)
    points = points[np.hypot(points[:, 0], points[:, 1]) < radius_m(config)]
    return points, np.abs(points[:, 2]) < config.table_band_m


def _within(outline: Float64Array, points: Float64Array) -> BoolArray:
    """Return (n,) bool: points (n, 3) above or below an outline (k, 2)."""
    return Region(outline).contains(points) if len(outline) else np.zeros(len(points), bool)


def _recentred(T_target_table: Float64Array, centre: Float64Array) -> Float64Array:
    """Return the table frame with its origin on the plane above or below (x, y) `centre`."""
    T = T_target_table.copy()
    normal = T[:3, 2]
    z = T[2, 3] - normal[:2] @ (centre - T[:2, 3]) / normal[2]
    T[:3, 3] = [*centre, z]
    return T
