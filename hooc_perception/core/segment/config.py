# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of stage 1."""

from dataclasses import dataclass

from hooc_perception.core.config import Config, group, param
from hooc_perception.core.segment.regions import workspace_of
from hooc_perception.errors import HoocError

MOST_RADIUS_M = 3.0


@dataclass(frozen=True)
class AccumulateConfig(Config):
    """How the readings of successive frame sets are put together; only `update` does so."""

    accumulate_frames: int = param(
        12, 'While a scene stands still, depth is averaged over as many frame sets; it starts '
        'again where something changes. 1 = every frame set by itself.', '', 1, 200, runtime=True)
    settle_frames: int = param(
        4, 'While a scene stands still, its views stay as they are. When so many frame sets in a '
        'row have shown no change, the readings of all of them make up new views, and what has '
        'changed before is decided again; 0 = never.', '', 0, 1000, runtime=True)
    largest_object_m: float = param(
        0.5, 'What comes into the scene and is longer than this is an arm or a hand, no object; '
        'so is what is half as long and reaches beyond the image or the workspace. It is set '
        'aside until it has gone.', 'm', 0.05, 3.0, runtime=True)
    full_share: float = param(
        0.4, 'If more than this share of the foreground has changed, nothing is taken over from '
        'the previous frame set.', '', 0.0, 1.0, runtime=True)


@dataclass(frozen=True)
class ObserveConfig(Config):
    """
    Parameters of stage 1: rectification, support plane, background subtraction.

    :ivar accumulate: of several frame sets.
    """

    max_depth_m: float = param(4.0, 'Readings beyond this depth are discarded.', 'm', 0.3, 20.0)
    table_band_m: float = param(
        0.025, 'Points within this height of z = 0 vote for the support plane; wide enough for '
        'a calibration error of a few millimetres and a degree.', 'm', 0.005, 0.1)
    workspace_radius_m: float = param(
        0.8, 'Only points within this horizontal distance of the world origin can be foreground '
        'or contribute to the plane fit; without effect where a workspace is given.', 'm',
        0.1, MOST_RADIUS_M)
    max_height_m: float = param(
        0.6, 'Points higher above the table than this are never foreground.', 'm', 0.05, 2)
    max_correction_m: float = param(
        0.02, 'A plane fit that would move the camera by more than this is rejected; the camera '
        'keeps its calibrated pose.', 'm', 0.0, 0.1)
    foreground_sigma: float = param(
        3.0, 'A point is foreground if its height exceeds this multiple of the table noise.',
        '', 1.0, 10.0)
    min_foreground_m: float = param(
        0.004, 'Smallest height above the table that counts as foreground.', 'm', 0.001, 0.05)
    uneven_m: float = param(
        0.12, 'Smallest lateral length over which the depth distortion of a flat table is '
        'compensated, so that objects lower than the distortion are still segmented; 0 = the '
        'table is assumed to be flat.', 'm', 0.0, 1.0)
    workspace: str = param(
        '', 'Where objects are looked for, in the target frame: corners of a polygon, '
        '"[[x, y], [x, y], [x, y]]", or two opposite corners of a box, "[[x, y, z], [x, y, z]]"; '
        'empty = the circle of workspace_radius_m.', 'm', runtime=True)
    ignore: str = param(
        '', 'A list of regions, each like workspace, in which nothing is an object: '
        '"[[[x, y], [x, y]], ...]".', 'm', runtime=True)
    table: str = param(
        'fixed', 'fixed: z = 0 of the target frame is the table top. find: the table is found and '
        'tracked, and the target frame may be any, such as base_link.',
        choices=('fixed', 'find'), runtime=True)
    table_low_m: float = param(
        -0.5, 'A table that has to be found is not below this z of the target frame.', 'm',
        -10.0, 10.0, runtime=True)
    table_high_m: float = param(
        1.5, 'A table that has to be found is not above this z of the target frame.', 'm',
        -10.0, 10.0, runtime=True)
    table_tilt_deg: float = param(
        10.0, 'Largest angle between the normal of a table that has to be found and the z axis '
        'of the target frame; 180 = z is not up (an optical frame), so the upper edges of the '
        'images tell which way is up, and neither bound of z applies.', 'deg', 0.0, 180.0,
        runtime=True)
    accumulate: AccumulateConfig = group(AccumulateConfig())

    def __post_init__(self) -> None:
        """Raise HoocError where a parameter is out of its range, or a region is none."""
        super().__post_init__()
        workspace_of(self.workspace, self.ignore)
        if self.table_low_m >= self.table_high_m:
            raise HoocError(f'parameter table_low_m is {self.table_low_m:g}, not below '
                            f'table_high_m, {self.table_high_m:g}; give a range of heights')
