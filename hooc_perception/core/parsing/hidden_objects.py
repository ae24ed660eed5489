# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Objects that the robot or an arm hides stay in the results, as they were last seen."""

from collections.abc import Sequence
from dataclasses import replace

from hooc_perception.core.arrays import AnyArray, Float32Array, Int64Array, UInt32Array
from hooc_perception.core.geometry import posed_vertices
from hooc_perception.core.parsing.tracking import TrackConfig
from hooc_perception.core.render import render_patch
from hooc_perception.core.types import (
    Candidates,
    GenericModel,
    Observation,
    ObservedView,
    ParsedScene,
)
import numpy as np

# An object is hidden if the robot covers at least this share of its pixels, over all views, ...
HIDDEN_SHARE = 0.25
# ... of an object that is still found, since nothing seen speaks against it, this share, ...
COVERED_SHARE = 0.75
# ... and the rest shows no more than this share of readings behind it: else it is gone.
THROUGH_SHARE, THROUGH_PX = 0.25, 10
# A reading is behind the object if it is farther than its surface by more than this.
THROUGH_M = 0.02


class HiddenObjects:
    """
    Add the objects of earlier results that are missing because the robot hides them.

    :param models: class id c is models[c - 1].
    :param max_instances: most objects per category, 0 = no limit.
    """

    def __init__(self, models: Sequence[GenericModel], config: TrackConfig = TrackConfig(),
                 max_instances: int = 0) -> None:
        self.models, self.config, self.max_instances = models, config, max_instances
        self._last: ParsedScene | None = None
        self._ids: UInt32Array = np.zeros(0, np.uint32)
        self._seen_ns: Int64Array = np.zeros(0, np.int64)     # when each was last seen
        self._stamp_ns = 0

    def forget(self) -> None:
        """Forget all objects."""
        self._last = None

    def update(self, stamp_ns: int, parsed: ParsedScene, ids: UInt32Array,
               observation: Observation) -> tuple[ParsedScene, UInt32Array]:
        """
        Return (ParsedScene, ids) with the hidden objects after those that were found.

        Hidden objects have their last pose, score and sigmas, a `hidden_s` above 0, and neither
        views nor visible pixels. A stamp before the last one forgets all objects.

        :param parsed: the result of a frame set, in the frame of `observation`.
        :param ids: (n,) ids of its objects.
        """
        if stamp_ns < self._stamp_ns or self.config.track_ttl_s == 0:
            self.forget()
        seen_ns = np.full(len(ids), stamp_ns, np.int64)
        if self._last is not None and any(view.hidden is not None for view in observation.views):
            seen_ns = self._last_seen(stamp_ns, parsed, ids, observation.views)
            lasting = stamp_ns - seen_ns <= self.config.keep_hidden_s * 1e9
            parsed, ids, seen_ns = parsed.take(lasting), ids[lasting], seen_ns[lasting]
            kept = self._kept(stamp_ns, parsed, ids, observation.views)
            if kept:
                parsed = _joined(parsed, self._last, kept)
                ids = np.concatenate([ids, self._ids[kept]])
                seen_ns = np.concatenate([seen_ns, self._seen_ns[kept]])
            if (seen_ns < stamp_ns).any():
                parsed = replace(parsed, hidden_s=((stamp_ns - seen_ns) * 1e-9).astype(np.float32))
        self._last, self._ids, self._seen_ns, self._stamp_ns = parsed, ids, seen_ns, stamp_ns
        return parsed, ids

    def _last_seen(self, stamp_ns: int, parsed: ParsedScene, ids: UInt32Array,
                   views: Sequence[ObservedView]) -> Int64Array:
        """Return (n,) int64 ns, when each found object was last seen: now, unless it is hidden."""
        seen_ns, objects = np.full(len(ids), stamp_ns, np.int64), parsed.objects
        for k, model in enumerate(objects.shapes(self.models)):
            before = np.flatnonzero(self._ids == ids[k])
            if len(before) and _is_hidden(objects, k, model, views, COVERED_SHARE):
                seen_ns[k] = self._seen_ns[before[0]]
        return seen_ns

    def _kept(self, stamp_ns: int, parsed: ParsedScene, ids: UInt32Array,
              views: Sequence[ObservedView]) -> list[int]:
        """Return the rows of the last result that are missing now because they are hidden."""
        assert self._last is not None
        last, kept = self._last.objects, []
        counts = np.bincount(parsed.objects.category, minlength=len(self.models) + 1)
        for k, model in enumerate(last.shapes(self.models)):
            category = int(last.category[k])
            if (self._ids[k] in ids
                    or stamp_ns - self._seen_ns[k] > self.config.keep_hidden_s * 1e9
                    or (self.max_instances and counts[category] >= self.max_instances)
                    or _is_taken(last.translation[k], last.size[k], parsed)):
                continue
            if _is_hidden(last, k, model, views, HIDDEN_SHARE):
                kept.append(k)
                counts[category] += 1
        return kept


def _is_taken(translation: AnyArray, size: AnyArray, parsed: ParsedScene) -> bool:
    """Return whether a found object stands where this one stood."""
    apart = np.linalg.norm(parsed.objects.translation - translation, axis=1)
    longest = np.minimum(parsed.objects.size.max(1, initial=0.0), size.max())
    return bool((apart < 0.5 * longest).any())


def _is_hidden(objects: Candidates, k: int, model: GenericModel, views: Sequence[ObservedView],
               share: float) -> bool:
    """Return whether a share of object `k` is hidden, and nobody sees through its place."""
    vertices = posed_vertices(model, objects.translation[k], objects.rotation_xyzw[k],
                              objects.size[k])
    total = hidden = through = 0
    for view in views:
        pixels, depth = render_patch(vertices, model.faces, view.camera)
        total += len(pixels)
        if view.hidden is not None:
            hidden += int(view.hidden.ravel()[pixels].sum())
        # No reading compares as false.
        through += int((view.depth.ravel()[pixels] > depth + THROUGH_M).sum())
    gone = through >= THROUGH_PX and through > THROUGH_SHARE * (total - hidden)
    return hidden > 0 and hidden >= share * total and not gone


def _joined(parsed: ParsedScene, last: ParsedScene, rows: list[int]) -> ParsedScene:
    """Return a ParsedScene followed by rows of an earlier one, which nobody sees now."""
    n = len(rows)

    def sigmas(now: Float32Array | None, before: Float32Array | None) -> Float32Array | None:
        if now is None:
            return None
        kept = np.full(n, np.nan, np.float32) if before is None else before[rows]
        return np.concatenate([now, kept])

    return replace(
        parsed, objects=parsed.objects.extended(last.objects.take(rows)),
        visible_ratio=np.append(parsed.visible_ratio, np.zeros(n, np.float32)),
        residual_m=np.append(parsed.residual_m, last.residual_m[rows]),
        energy_delta=np.append(parsed.energy_delta, last.energy_delta[rows]),
        n_views=np.append(parsed.n_views, np.zeros(n, np.uint8)),
        sigma_t=sigmas(parsed.sigma_t, last.sigma_t), sigma_r=sigmas(parsed.sigma_r, last.sigma_r))
