# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 1 over time: each frame set is observed with what the frame sets before it showed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.core.incremental.accumulate import (
    accumulate,
    Accumulated,
    changed_in,
    fused_view,
)
from hooc_perception.core.incremental.changes import changed_share, changes, comparable
from hooc_perception.core.incremental.intruders import intruders
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.table import in_table_frame
from hooc_perception.core.types import Observation, ObservedView, RectifiedView
import numpy as np


@dataclass(frozen=True, eq=False)
class Watched:
    """
    A frame set together with those before it.

    :ivar observation: of the accumulated depth.
    :ivar accumulated: one per camera; None for a camera that has not shown anything yet.
    :ivar fresh: whether nothing was taken over from earlier frame sets.
    """

    observation: Observation
    accumulated: tuple[Accumulated | None, ...]
    fresh: bool = True


def watch(views: Sequence[RectifiedView], before: Watched | None,
          config: ObserveConfig = ObserveConfig(), T_target_table: Float64Array | None = None,
          ) -> Watched:
    """
    Observe a frame set, see `observe`, with the readings of earlier ones.

    Where too much has changed (`full_share`), or where a camera was moved, only the frame set
    itself counts.

    :param before: what this function returned for the frame set before; None = the first.
    :raises HoocError: as `observe` does.
    """
    frames = config.accumulate.accumulate_frames
    if before is not None and frames > 1 and _continues(before, views):
        watched = _next(views, before, config, T_target_table)
        if not _is_other(before.observation, watched.observation, config):
            return watched
    return Watched(observe(views, config, T_target_table),
                   tuple(_first(view) for view in views))


def seen_so_far(before: Observation, now: Observation) -> Observation:
    """Return the latest observation with earlier views of what is hidden in it."""
    return replace(now, views=tuple(
        _uncovered(a, b) for a, b in zip(before.views, now.views)))


def _is_other(before: Observation, now: Observation, config: ObserveConfig) -> bool:
    """Return whether too much has changed for anything to be taken over."""
    return not comparable(before, now) or changed_share(
        before, now, changes(before, now)) > config.accumulate.full_share


def _continues(before: Watched, views: Sequence[RectifiedView]) -> bool:
    """Return whether a frame set is of the same cameras in the same places."""
    return len(before.accumulated) == len(views) and all(
        a is None or a.continues(view) for a, view in zip(before.accumulated, views))


def _next(views: Sequence[RectifiedView], before: Watched, config: ObserveConfig,
          T_target_table: Float64Array | None) -> Watched:
    """Return the frame set with the readings of earlier ones."""
    old = [a if np.isfinite(view.depth).any() else None
           for a, view in zip(before.accumulated, views)]
    changed = [np.zeros(view.depth.shape, bool) if a is None else changed_in(a, view)
               for a, view in zip(old, views)]
    aside = intruders([a and a.depth for a in old], in_table_frame(views, T_target_table),
                      changed, config)
    fused, accumulated = list(views), list(before.accumulated)
    for k, (a, view) in enumerate(zip(old, views)):
        if a is not None:
            unseen = aside[k] if view.hidden is None else aside[k] | view.hidden
            new = accumulate(a, view, changed[k], unseen, config.accumulate.accumulate_frames)
            fused[k], accumulated[k] = fused_view(new, view, aside[k]), new
        elif before.accumulated[k] is None:
            # A camera that has dropped out shows nothing; what it saw counts when it returns.
            accumulated[k] = _first(view)
    return Watched(observe(fused, config, T_target_table), tuple(accumulated), False)


def _first(view: RectifiedView) -> Accumulated | None:
    """Return what one image alone shows; None for a camera that has dropped out."""
    return Accumulated.first(view) if np.isfinite(view.depth).any() else None


def _uncovered(before: ObservedView, now: ObservedView) -> ObservedView:
    """Return a view in which hidden pixels show what was seen there before."""
    if now.hidden is None:
        return now
    hidden: BoolArray = np.zeros_like(now.hidden) if before.hidden is None else before.hidden
    return replace(now, depth=np.where(now.hidden, before.depth, now.depth),
                   foreground=np.where(now.hidden, before.foreground, now.foreground),
                   hidden=now.hidden & hidden)
