# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
What reaches into the scene: an arm, a hand, a head.

What carries an object is larger than objects are, and comes from outside of the images or of the
workspace. Such a thing is set aside until it has gone, as the robot's own links are
(segment/hidden.py): nobody looks for objects in it, and what it hides stays as it was.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import BoolArray, Float32Array, Float64Array, Int32Array
from hooc_perception.core.geometry import back_project
from hooc_perception.core.incremental.kernels.windows import at_edges
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.table import radius_m
from hooc_perception.core.types import RectifiedView
import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

# It is nearer than what was there before by this at least. [m]
NEARER_M = 0.02
# Depth steps that separate one thing from another, per metre of depth.
APART = 0.05
# Parts of fewer pixels are left as they are; so many must lie outside of the workspace.
FEWEST_PX = 20
# A part of a thing that another camera sees reaching in has this share of its points there.
SAME_SHARE, SAME_M = 0.3, 0.03
# A part that comes so close to the first or last row or column with readings is cut off there:
# closing leaves out the outermost ones.
CUT_PX = 2
# What another camera shows from end to end, as long as this share of what is cut off here, does
# not come from outside: it lies at the border of this image.
WHOLE_SHARE = 0.8
# Points of each part that are compared.
MOST_POINTS = 400
# Around it readings mix with those of the background or are missing. [pixels]
MARGIN_PX = 5


@dataclass(frozen=True, eq=False)
class _Part:
    """
    A connected part of one image that came nearer.

    :ivar view: number of the image, `label` that of the part in it.
    :ivar points: (n, 3) of it, table frame, metres.
    :ivar length_m: diagonal of the box around them.
    :ivar cut: whether it goes on beyond the image or the workspace.
    """

    view: int
    label: int
    points: Float64Array
    length_m: float
    cut: bool

    def lies_in(self, tree: KDTree) -> bool:
        """Return whether it is a part of what the points of a tree show."""
        distance, _ = tree.query(self.points, distance_upper_bound=SAME_M)
        return bool(np.mean(np.isfinite(distance)) >= SAME_SHARE)


def intruders(before: Sequence[Float32Array | None], views: Sequence[RectifiedView],
              changed: Sequence[BoolArray], config: ObserveConfig) -> list[BoolArray]:
    """
    Return, per view, which pixels (H, W) show something that reaches into the scene.

    :param before: (H, W) float32 metres each, what was there before; None = nothing is known.
    :param views: posed in the table frame.
    :param changed: (H, W) bool each, see `changed_pixels`.
    """
    labels, parts = [], []
    for k, (old, view, mask) in enumerate(zip(before, views, changed)):
        label = (np.zeros(view.depth.shape, np.int32) if old is None or not mask.any()
                 else _labels(old, view.depth, mask))
        labels.append(label)
        if label.any():
            parts += _parts(k, view, label, config)
    seeds = [part.points for part in parts
             if _reaches_in(part, parts, config.accumulate.largest_object_m)]
    chosen: list[list[int]] = [[] for _ in views]
    if seeds:
        tree = KDTree(np.concatenate(seeds))
        for part in parts:
            if part.lies_in(tree):
                chosen[part.view].append(part.label)
    size = 2 * MARGIN_PX + 1
    return [np.asarray(ndimage.maximum_filter(np.isin(label, rows), size), bool) if rows
            else np.zeros(label.shape, bool) for label, rows in zip(labels, chosen)]


def _labels(before: Float32Array, now: Float32Array, changed: BoolArray) -> Int32Array:
    """Return (H, W) int32 numbers of the connected parts that came nearer, 0 = none."""
    with np.errstate(invalid='ignore'):
        nearer = changed & np.isfinite(now) & ~(now > before - NEARER_M)
    nearer = np.asarray(ndimage.binary_closing(nearer, np.ones((3, 3), bool)), bool)
    labels = np.empty(now.shape, np.int32)
    ndimage.label(nearer & np.isfinite(now) & ~at_edges(now, APART), np.ones((3, 3), int),
                  output=labels)
    return labels


def _parts(k: int, view: RectifiedView, labels: Int32Array, config: ObserveConfig) -> list[_Part]:
    """Return the parts of one view that are large enough and not outside altogether."""
    parts = []
    xyz, reach_m = back_project(view.depth, view.camera), radius_m(config)
    counts = np.bincount(labels.ravel())
    borders = [np.flatnonzero(np.isfinite(view.depth).any(axis))[[0, -1]] for axis in (1, 0)]
    for label, box in enumerate(ndimage.find_objects(labels), 1):
        if counts[label] < FEWEST_PX:
            continue
        mine = labels[box] == label
        points = xyz[box][mine]
        inside = ((np.hypot(points[:, 0], points[:, 1]) < reach_m)
                  & (points[:, 2] < config.max_height_m))
        if inside.sum() < FEWEST_PX:
            continue
        cut = any(edge.start <= first + CUT_PX or edge.stop > last - CUT_PX
                  for edge, (first, last) in zip(box, borders))
        low, high = np.quantile(points, [0.02, 0.98], axis=0)
        parts.append(_Part(k, label, points[::max(1, len(points) // MOST_POINTS)],
                           float(np.linalg.norm(high - low)),
                           cut or int((~inside).sum()) >= FEWEST_PX))
    return parts


def _reaches_in(part: _Part, parts: Sequence[_Part], largest_m: float) -> bool:
    """Return whether a part is of an arm or the like: too long, or long and cut off."""
    if part.length_m > largest_m:
        return True
    if not part.cut or part.length_m <= largest_m / 2:
        return False
    tree = KDTree(part.points)
    return not any(other.lies_in(tree) for other in parts if other.view != part.view
                   and not other.cut and other.length_m > WHOLE_SHARE * part.length_m)
