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
# Points of each part that are compared.
MOST_POINTS = 400
# Around it readings mix with those of the background or are missing. [pixels]
MARGIN_PX = 5


@dataclass(frozen=True, eq=False)
class _Part:
    """A connected part of one image that came nearer: its view, label, points and verdict."""

    view: int
    label: int
    points: Float64Array
    reaching: bool


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
    seeds = [part.points for part in parts if part.reaching]
    chosen: list[list[int]] = [[] for _ in views]
    if seeds:
        tree = KDTree(np.concatenate(seeds))
        for part in parts:
            near = part.reaching or np.mean(
                tree.query(part.points, distance_upper_bound=SAME_M)[0] < np.inf) >= SAME_SHARE
            if near:
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
    xyz = back_project(view.depth, view.camera)
    counts = np.bincount(labels.ravel())
    boxes = ndimage.find_objects(labels)
    for label in np.flatnonzero(counts >= FEWEST_PX):
        box = boxes[label - 1] if label else None
        if box is None:
            continue
        mine = labels[box] == label
        points = xyz[box][mine]
        inside = ((np.hypot(points[:, 0], points[:, 1]) < radius_m(config))
                  & (points[:, 2] < config.max_height_m))
        if inside.sum() < FEWEST_PX:
            continue
        cut = any(edge.start == 0 or edge.stop == n for edge, n in zip(box, labels.shape))
        low, high = np.quantile(points, [0.02, 0.98], axis=0)
        longest = float(np.linalg.norm(high - low))
        largest = config.accumulate.largest_object_m
        reaching = longest > largest or longest > largest / 2 and (
            cut or int((~inside).sum()) >= FEWEST_PX)
        parts.append(_Part(k, int(label), points[::max(1, len(points) // MOST_POINTS)], reaching))
    return parts
