# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The previous answer set against a new frame set: what goes on as it was, what is searched anew.

Objects that no change touches are held. The others are free, and stay in the pool together with
the runners-up that a change touches; new candidates are proposed where something has changed.
"""

from collections.abc import Sequence
from dataclasses import replace

from hooc_perception.core.arrays import BoolArray, Float32Array, Float64Array
from hooc_perception.core.frame.evidence import hypotheses_of
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.hypotheses.propose import effort_of, share_of
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.parsing.search import Search
from hooc_perception.core.types import Candidates, ParsedScene
import numpy as np
from scipy import ndimage

# An object is touched by a change if it covers this share of its pixels; a runner-up, if more.
TOUCHED, INVOLVED = 0.03, 0.2
# New candidates are looked for this far around a change, too. [pixels]
AROUND_PX = 4


def search_with(frame: Frame, before: ParsedScene, region: Sequence[BoolArray],
                config: ParseConfig, max_instances: int = 0) -> Search:
    """
    Return a Search on coarse pixels that starts from the previous answer.

    :param before: in the table frame.
    :param region: per view (H, W) bool, what has changed.
    """
    search = Search(frame.coarse, frame.models, config, max_instances)
    share = _share(frame, before.objects, region, config)
    search.start(before.objects, share < TOUCHED)
    rivals = before.runners_up
    search.add(rivals.take(_share(frame, rivals, region, config) >= INVOLVED))
    return search


def narrowed(config: ParseConfig, frame: Frame, region: Sequence[BoolArray], least: float,
             ) -> ParseConfig:
    """
    Return the parameters of a search over a share of the candidates.

    :param region: per view (H, W) bool, what is decided anew.
    :param least: least share.
    """
    foreground = sum(int(view.foreground.sum()) for view in frame.observation.views)
    effort = effort_of(sum(int(mask.sum()) for mask in region) / max(foreground, 1), least)
    return replace(config, kept=share_of(config.kept, effort),
                   finalists=share_of(config.finalists, effort))


def around(region: Sequence[BoolArray]) -> list[BoolArray]:
    """Return a region per view (H, W) bool with what lies around it."""
    return [np.asarray(ndimage.maximum_filter(mask, 2 * AROUND_PX + 1), bool) for mask in region]


def with_held(parsed: ParsedScene, before: ParsedScene, held: BoolArray, of_before: BoolArray,
              ) -> ParsedScene:
    """
    Return a scene whose held objects have the score and sigmas that they had.

    Sigmas of the other objects are NaN.

    :param held: (n,) bool, which objects of `parsed` were held; `of_before` (m,) bool, the same
        objects among those of `before`, in the same order.
    """
    def kept(now: Float32Array, then: Float32Array) -> Float32Array:
        both = now.copy()
        both[held] = then[of_before]
        return both

    nothing = np.full(len(held), np.nan, np.float32)
    sigma_t, sigma_r = (None if sigma is None else kept(nothing, sigma)
                        for sigma in (before.sigma_t, before.sigma_r))
    score = kept(parsed.objects.score, before.objects.score)
    return replace(parsed, objects=replace(parsed.objects, score=score), sigma_t=sigma_t,
                   sigma_r=sigma_r)


def _share(frame: Frame, objects: Candidates, region: Sequence[BoolArray], config: ParseConfig,
           ) -> Float64Array:
    """Return (n,) float64, the share of each object's pixels that lie in a region."""
    shapes = frame.shapes
    _, lists = frame.coarse.compare_pixels(hypotheses_of(objects, shapes), shapes.of(objects),
                                           config.pixels.weights())
    return frame.coarse.share_of_lists(lists, region)
