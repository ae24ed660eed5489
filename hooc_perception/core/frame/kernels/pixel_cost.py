# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The cost of one pixel: first sum of the joint energy (core/energy/joint.py, docs/method.md).

    E(S) = sum_i c_i(S) + ...

c_i is the cost of the object that is nearest at pixel i; where there is none, it is
1 - unknown p_0 for a foreground pixel, with p_0 the probability of something else (background),
and 0 for a table pixel. With z the rendered and d the measured depth and
e = (z - d) / tolerance_m, an object costs

    |e| + normal (1 - max(0, cos)) + category u     foreground, |e| < 1: AGREES
    1 + category / 2                                foreground, e >= 1: OCCLUDED
    (1 + free + category) / 2                       foreground, e <= -1: SEEN_THROUGH
    free min(1, |e|)                                table or room: SEEN_THROUGH

cos is the cosine between rendered and measured normal, u the unlikeliness of the category
(0 = certain, 1 = ruled out). The weights are a PixelWeights.
"""

from hooc_perception.core.frame.kernels.records import Context, PixelWeights, Views
import numba as nb
import numpy as np

# What a reading says of a rendered pixel.
AGREES, SEEN_THROUGH, OCCLUDED = 1, 2, 3
# Probability 0..255 as unlikeliness u: 1 at 2 % and less.
UNLIKELY = np.minimum(1.0, -np.log(np.maximum(np.arange(256) / 255.0, 0.002)) / 4.0)


@nb.njit(cache=True, inline='always')
def pixel_cost(z: float, d: float, foreground: bool, cosine: float, unlikely: float,
               weights: PixelWeights) -> tuple[float, int]:
    """Return (cost, state) of rendering depth z where d was measured; see the module."""
    e = (z - d) / weights.tolerance_m
    size = min(1.0, abs(e))
    if not foreground:
        return weights.free * size, SEEN_THROUGH
    if size >= 1.0:
        return ((1.0 if e > 0 else 0.5 + 0.5 * weights.free) + 0.5 * weights.category,
                OCCLUDED if e > 0 else SEEN_THROUGH)
    return (size + weights.normal * (1.0 - max(0.0, cosine))
            + weights.category * unlikely), AGREES


@nb.njit(cache=True, inline='always')
def shown_without(context: Context, i: int, me: int) -> tuple[float, float]:
    """Return (depth, cost) of what pixel i shows if member `me` is taken away."""
    if context.owner[i] == me:
        return context.next_depth[i], context.next_cost[i]
    return context.depth[i], context.cost[i]


@nb.njit(cache=True, inline='always')
def unlikeliness(views: Views, i: int, category: int) -> float:
    """Return u of a category at pixel i; 1 where the classifier says background."""
    row: int = views.p_row[i]
    if row < 0:
        return 1.0
    p: int = views.p[row, category]
    return UNLIKELY[p]
