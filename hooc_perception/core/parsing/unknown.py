# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Things of no category: what stands on the table and no object of the answer explains.

The foreground that the objects leave is clustered; each cluster that is large enough to be a
thing gets an oriented box on the support plane. A heap may be one cluster.
"""

from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import posed_meshes
from hooc_perception.core.parsing.groups import grouped, near_surfaces
from hooc_perception.core.parsing.unexplained import TOLERANCE_M
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Candidates, Observation, UnknownObjects
import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

# Of a point of the cloud, the share of pixels that must be open.
OPEN_SHARE = 0.5
# A thing has so many cells and this extent; less is noise or the rest of an object.
FEWEST_CELLS, LONGEST_M, HEIGHT_M = 30, 0.04, 0.012
# The lowest point of a thing that stands on the table: what is lower is hidden or bent away.
STANDS_M = 0.05


def find_unknown(frame: Frame, objects: Candidates) -> UnknownObjects:
    """
    Return the UnknownObjects that a Frame shows beside the objects of an answer.

    :param objects: of the answer, in the table frame.
    """
    cloud = frame.cloud
    if not len(cloud.points):
        return UnknownObjects.empty()
    left = np.flatnonzero(_open(frame, objects))
    left = left[~near_surfaces(cloud.points[left], objects, frame.models)]
    if not len(left):
        return UnknownObjects.empty()
    member, group = grouped(cloud.points[left])
    boxes, scores, hulls = [], [], []
    for k in range(group.max() + 1):
        mine = left[group == k]
        points = cloud.points[mine]
        box = _box(points)
        if box is None or len(np.unique(member[group == k])) < FEWEST_CELLS:
            continue
        boxes.append(box)
        scores.append(float(cloud.p[mine, 0].mean()))
        hulls.append(_hull(points, box))
    if not boxes:
        return UnknownObjects.empty()
    translation, rotation, size = (np.array(column) for column in zip(*boxes))
    return UnknownObjects(translation, rotation, size.astype(np.float32),
                          np.array(scores, np.float32), tuple(hulls))


def _open(frame: Frame, objects: Candidates) -> BoolArray:
    """Return (n,) bool: the points of the cloud that no object explains."""
    observation: Observation = frame.observation
    meshes = posed_meshes(objects, frame.models)
    n = len(frame.cloud.points)
    total, left = np.zeros(n), np.zeros(n)
    for view, row in zip(observation.views, frame.cloud.row):
        composed, _ = render_depth(meshes, view.camera)
        seen = row >= 0
        unexplained = ~(np.abs(composed - view.depth) <= TOLERANCE_M)
        total += np.bincount(row[seen], minlength=n)
        left += np.bincount(row[seen], weights=unexplained[seen], minlength=n)
    return left > OPEN_SHARE * np.maximum(total, 1)


def _box(points: Float64Array) -> tuple[Float64Array, Float64Array, Float64Array] | None:
    """
    Return (translation, rotation_xyzw, size) of the upright box of least area around points.

    None where they are too small for a thing.
    """
    flat = points[:, :2]
    try:
        hull = flat[ConvexHull(flat).vertices]
    except QhullError:
        return None
    # The box of least area has a side along an edge of the hull (Freeman & Shapira 1975).
    edges = np.roll(hull, -1, axis=0) - hull
    best, yaw = np.inf, 0.0
    for angle in np.arctan2(edges[:, 1], edges[:, 0]):
        sides = np.ptp(hull @ _turn(angle), axis=0)
        if sides.prod() < best:
            best, yaw = float(sides.prod()), float(angle)
    turned = hull @ _turn(yaw)
    low, high = turned.min(0), turned.max(0)
    bottom, top = np.quantile(points[:, 2], [0.02, 0.98])
    if bottom < STANDS_M:
        bottom = 0.0
    size = np.array([*(high - low), top - bottom])
    if size.max() < LONGEST_M or top < HEIGHT_M:
        return None
    middle = _turn(yaw) @ ((low + high) / 2)
    return (np.array([*middle, (top + bottom) / 2]),
            Rotation.from_euler('z', yaw).as_quat(canonical=True), size)


def _turn(yaw: float) -> Float64Array:
    """Return the (2, 2) rotation by `yaw`; points (n, 2) @ it are turned back."""
    return np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])


def _hull(points: Float64Array,
          box: tuple[Float64Array, Float64Array, Float64Array]) -> Float64Array:
    """Return the corners (k, 3) of the convex hull of points and their shadow on the bottom."""
    bottom = box[0][2] - box[2][2] / 2
    foot = points.copy()
    foot[:, 2] = bottom
    both = np.concatenate([points, foot])
    return both[ConvexHull(both, qhull_options='QJ').vertices]
