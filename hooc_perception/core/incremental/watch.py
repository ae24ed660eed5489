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
from hooc_perception.core.incremental.changes import (
    changed_share,
    changes,
    comparable,
    FEWEST_PX,
    unseen,
)
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

    :ivar observation: of the accumulated depth; while nothing changes, the same object.
    :ivar accumulated: one per camera; None for a camera that has not shown anything yet.
    :ivar fresh: whether nothing was taken over from earlier frame sets.
    :ivar calm: how many frame sets in a row have shown no change.
    """

    observation: Observation
    accumulated: tuple[Accumulated | None, ...]
    fresh: bool = True
    calm: int = 0


def watch(views: Sequence[RectifiedView], before: Watched | None,
          config: ObserveConfig = ObserveConfig(), T_target_table: Float64Array | None = None,
          ) -> Watched:
    """
    Observe a frame set, see `observe`, with the readings of earlier ones.

    While nothing changes, the observation stays as it is; after `settle_frames` it is made anew,
    and then whenever `accumulate_frames` have passed. Where too much has changed (`full_share`),
    or where a camera was moved, only the frame set itself counts.

    :param before: what this function returned for the frame set before; None = the first.
    :raises HoocError: as `observe` does.
    """
    frames = config.accumulate.accumulate_frames
    if before is not None and frames > 1 and _continues(before, views):
        watched = _next(views, before, config, T_target_table)
        if (watched.observation is before.observation
                or not _is_other(before.observation, watched.observation, config)):
            return watched
    return Watched(observe(views, config, T_target_table),
                   tuple(_first(view) for view in views))


def seen_so_far(before: Observation, now: Observation) -> Observation:
    """Return the latest observation with earlier views of what is not seen in it."""
    return replace(now, views=tuple(
        _uncovered(a, b) for a, b in zip(before.views, now.views)))


def _is_other(before: Observation, now: Observation, config: ObserveConfig) -> bool:
    """Return whether too much has changed for anything to be taken over."""
    return not comparable(before, now) or changed_share(
        before, now, changes(before, now)) > config.accumulate.full_share


def _continues(before: Watched, views: Sequence[RectifiedView]) -> bool:
    """Return whether a frame set is of the same cameras in the same places, in the same sizes."""
    return len(before.accumulated) == len(views) and all(
        seen.depth.shape == view.depth.shape and (a is None or a.continues(view))
        for seen, a, view in zip(before.observation.views, before.accumulated, views))


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
    calm = before.calm + 1 if _is_still(views, before, changed, aside, T_target_table) else 0
    accumulates = config.accumulate
    if calm and calm != accumulates.settle_frames and calm % accumulates.accumulate_frames:
        return replace(before, accumulated=tuple(accumulated), calm=calm, fresh=False)
    return Watched(observe(fused, config, T_target_table), tuple(accumulated), False, calm)


def _is_still(views: Sequence[RectifiedView], before: Watched, changed: Sequence[BoolArray],
              aside: Sequence[BoolArray], T_target_table: Float64Array | None) -> bool:
    """Return whether a frame set shows what the last observation shows, with other noise."""
    if not np.array_equal(_matrix(before.observation.T_target_table), _matrix(T_target_table)):
        return False
    pixels = 0
    for seen, view, mask, away in zip(before.observation.views, views, changed, aside):
        # Behind the table readings come and go.
        pixels += int((mask & (seen.table | seen.foreground)).sum())
        if pixels >= FEWEST_PX or away.any() or view.hidden is not None:
            return False
        if seen.hidden is not None or (
                np.isfinite(seen.depth).any() != np.isfinite(view.depth).any()):
            return False
    return True


def _matrix(T: Float64Array | None) -> Float64Array:
    return np.eye(4) if T is None else T


def _first(view: RectifiedView) -> Accumulated | None:
    """Return what one image alone shows; None for a camera that has dropped out."""
    return Accumulated.first(view) if np.isfinite(view.depth).any() else None


def _uncovered(before: ObservedView, now: ObservedView) -> ObservedView:
    """Return a view in which pixels that are not seen show what was seen there before."""
    away = unseen(now)
    if not away.any():
        return now
    camera = before.camera if away.all() else now.camera
    return replace(now, camera=camera, depth=np.where(away, before.depth, now.depth),
                   foreground=np.where(away, before.foreground, now.foreground),
                   hidden=away & unseen(before))
