# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 1: rectified depth images become an observation of what stands on the table.

A small pose correction per camera from the table that it sees (level.py), then the foreground
and the depth of the empty scene (foreground.py). Rectification itself comes before
(rectify.py).
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.segment.checks import table_troubles
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.foreground import against_table, Allowed
from hooc_perception.core.segment.level import LEAST_SIGMA_M, level, MOST_SIGMA_M
from hooc_perception.core.segment.regions import workspace_of
from hooc_perception.core.segment.table import in_table_frame, radius_m
from hooc_perception.core.types import Camera, Observation, ObservedView, RectifiedView
from hooc_perception.errors import HoocError
import numpy as np

# Noise of the table where no view shows enough of it.
DEFAULT_NOISE_M = 0.003


def observe(views: Sequence[RectifiedView], config: ObserveConfig = ObserveConfig(),
            T_target_table: Float64Array | None = None) -> Observation:
    """
    Level every camera on the table and separate foreground from background.

    :param views: in camera order, posed in the target frame. A view without any reading stands
        for a camera that has dropped out: it shows nothing and rules nothing out.
    :param T_target_table: (4, 4), see `table.locate_table`; None where z = 0 of the target frame
        is the table top.
    :return: Observation, in the table frame; pure and deterministic in its input.
    :raises HoocError: if no view holds any reading.
    """
    if not views:
        raise HoocError('there is no depth image to look at; give at least one camera')
    if not any(np.isfinite(view.depth).any() for view in views):
        if any(view.hidden is not None for view in views):
            raise HoocError('the robot hides every reading of the cameras; move it out of their '
                            'view, or lower robot_padding_m')
        raise HoocError(f'the depth image of camera {views[0].camera.name} holds no reading '
                        'at all (every pixel is 0 or NaN), nor does any other; check the '
                        'sensors and the unit')
    views, reach_m = in_table_frame(views, T_target_table), radius_m(config)
    troubles = table_troubles(views, config.table_band_m, reach_m)
    allowed = Allowed(workspace_of(config.workspace, config.ignore), T_target_table, reach_m)
    # numpy and scipy compute without the interpreter's lock: the views share the cores.
    with ThreadPoolExecutor(len(views)) as threads:
        fits = list(threads.map(lambda view: level(view, config, reach_m), views))
        known = [sigma for _, sigma in fits if np.isfinite(sigma)]
        noise_m = (float(np.clip(np.median(known), LEAST_SIGMA_M, MOST_SIGMA_M)) if known
                   else DEFAULT_NOISE_M)

        def segmented(view: RectifiedView, fit: tuple[Camera, float]) -> ObservedView:
            camera, sigma = fit
            seen = against_table(camera, view.depth, sigma if np.isfinite(sigma) else noise_m,
                                 config, allowed)
            return replace(seen, hidden=view.hidden)

        observed = tuple(threads.map(segmented, views, fits))
    return Observation(observed, noise_m, T_target_table, tuple(
        f'camera {name}: {trouble}' for name, trouble in troubles.items()))


def require_table(observation: Observation) -> Observation:
    """
    Return an observation if some camera sees the table; nothing sensible follows from others.

    :raises HoocError: one sentence on the first camera, where none sees it.
    """
    seeing = [view for view in observation.views if np.isfinite(view.depth).any()]
    if seeing and len(observation.troubles) == len(seeing):
        others = len(seeing) - 1
        raise HoocError(f'{observation.troubles[0]}'
                        + (f' (the other {others} cameras do not see the table either)'
                           if others > 1 else ' (nor does the other camera see the table)'
                           if others else ''))
    return observation
