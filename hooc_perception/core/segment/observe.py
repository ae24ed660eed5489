# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 1: rectified depth images become an observation of what stands on the table.

A small pose correction per camera from the table that it sees (level.py), then the foreground
and the depth of the empty scene (foreground.py). Rectification itself comes before
(rectify.py).
"""

from collections.abc import Sequence

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.foreground import against_table
from hooc_perception.core.segment.level import LEAST_SIGMA_M, level, MOST_SIGMA_M
from hooc_perception.core.types import Observation, RectifiedView
from hooc_perception.errors import HoocError
import numpy as np

# Noise of the table where no view shows enough of it.
DEFAULT_NOISE_M = 0.003


def observe(views: Sequence[RectifiedView],
            config: ObserveConfig = ObserveConfig()) -> Observation:
    """
    Level every camera on the table and separate foreground from background.

    :param views: in camera order; world z = 0 is the table top. A view without any reading
        stands for a camera that has dropped out: it shows nothing and rules nothing out.
    :return: Observation; pure and deterministic in its input.
    :raises HoocError: if no view holds any reading.
    """
    if not views:
        raise HoocError('there is no depth image to look at; give at least one camera')
    if not any(np.isfinite(view.depth).any() for view in views):
        raise HoocError(f'the depth image of camera {views[0].camera.name} holds no reading '
                        'at all (every pixel is 0 or NaN), nor does any other; check the '
                        'sensors and the unit')
    fits = [level(view, config) for view in views]
    known = [sigma for _, sigma in fits if np.isfinite(sigma)]
    noise_m = (float(np.clip(np.median(known), LEAST_SIGMA_M, MOST_SIGMA_M)) if known
               else DEFAULT_NOISE_M)
    return Observation(
        tuple(against_table(camera, view.depth, sigma if np.isfinite(sigma) else noise_m, config)
              for view, (camera, sigma) in zip(views, fits)), noise_m)
