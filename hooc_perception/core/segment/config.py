# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of stage 1."""

from dataclasses import dataclass

from hooc_perception.core.config import Config, param


@dataclass(frozen=True)
class ObserveConfig(Config):
    """Parameters of stage 1: rectification, support plane, background subtraction."""

    max_depth_m: float = param(4.0, 'Readings beyond this depth are discarded.', 'm', 0.3, 20.0)
    table_band_m: float = param(
        0.025, 'Points within this height of z = 0 vote for the support plane; wide enough for '
        'a calibration error of a few millimetres and a degree.', 'm', 0.005, 0.1)
    workspace_radius_m: float = param(
        0.8, 'Only points within this horizontal distance of the world origin can be foreground '
        'or contribute to the plane fit.', 'm', 0.1, 3.0)
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
