# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Refuse scenes whose camera poses or depth units cannot be meant, with what seems to be meant."""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from hooc_perception.core.segment.checks import aim_trouble
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.rectify import undistorted
from hooc_perception.core.segment.table_sight import depth_factor, table_sight
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
import numpy as np

# Nearer and beyond the range of any depth camera that looks at a table.
NEAREST_M, FARTHEST_M = 0.05, 30.0
_FIX = 'correct depth_unit in dataset.yaml (or the unit of the extrinsics)'


def check_aim(cameras: Iterable[Camera], where: str | Path) -> None:
    """
    Raise HoocError where a camera does not look at the table.

    :param cameras: posed in the table's frame.
    :param where: file or scene, the beginning of the sentence.
    """
    for camera in cameras:
        if trouble := aim_trouble(camera):
            raise HoocError(f'{where}: camera {camera.name}: {trouble}')


def check_unit(views: Sequence[DepthView], depth_files: Sequence[Path | str],
               depth_units: Sequence[float], fix: str = _FIX) -> None:
    """
    Raise HoocError where most views would show the table, and none does, at another unit.

    :param views: raw, in the table's frame.
    :param depth_units: metres per count, as stated.
    :param fix: the end of the sentence.
    """
    config = ObserveConfig()
    straight = [undistorted(view) for view in views]
    if any(table_sight(view, config.table_band_m, config.workspace_radius_m).sees_table
           for view in straight):
        return
    factors = Counter(depth_factor(view, config.workspace_radius_m) for view in straight)
    factor, count = factors.most_common(1)[0]
    if factor and count > len(views) / 2:
        unit = depth_units[0]
        raise HoocError(f'{depth_files[0]}: the cameras would see the table at z = 0 if all depth '
                        f'were {factor:g} times as large, so its unit seems to be '
                        f'{factor * unit:g} m and not {unit:g} m; {fix}')


def check_distances(views: Sequence[DepthView], depth_files: Sequence[Path],
                    depth_units: Sequence[float]) -> None:
    """
    Raise HoocError where no depth camera could measure what the files of a scene say.

    :param views: raw, in any frame.
    :param depth_units: metres per count, as stated.
    """
    for view, file, unit in zip(views, depth_files, depth_units):
        median = float(np.nanmedian(view.depth[::4, ::4])) if np.isfinite(
            view.depth[::4, ::4]).any() else 1.0
        if not NEAREST_M <= median <= FARTHEST_M:
            raise HoocError(f'{file}: half of its readings lie within {median:.2g} m, so its unit '
                            f'is not {unit:g} m (depth_unit; in BOP depth_scale, in millimetres); '
                            'give the metres of one count, 0.001 for millimetres')
