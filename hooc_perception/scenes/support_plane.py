# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Find the table in depth images whose world frame is not known to be a table's."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class SupportPlane:
    """
    A table frame estimated from depth: z up, origin under the centre of what stands on it.

    :ivar T_table_source: (4, 4) float64, from the frame of the files to the table's.
    :ivar inlier_share: share of the measured points that lie on the plane.
    :ivar residual_m: RMS distance of those points from the plane.
    """

    T_table_source: np.ndarray
    inlier_share: float
    residual_m: float


def estimate_table_frame(views, scene_name):
    """Return the SupportPlane of a scene's raw depth views."""
    raise NotImplementedError
