# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The measured points of a scene, by camera and by what explains them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import AnyArray, Float64Array, UInt8Array
from hooc_perception.core.geometry import back_project
from hooc_perception.core.parsing.unexplained import Reason, TOLERANCE_M
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Observation
from hooc_perception.evaluation.report import pictures
from hooc_perception.evaluation.report.pictures import RGB
import numpy as np

# Points of the page: of one scene, and of all frame sets of a sequence together.
MAX_POINTS, MAX_SEQUENCE = 36_000, 400_000
# One point is kept in each cube of this size; twice the size of the table.
VOXELS_M = (0.002, 0.003, 0.004, 0.006, 0.008, 0.012, 0.016, 0.024, 0.032)
# Around all that stands: of the table, and below and above.
BORDER_M = (0.1, 0.1, 0.02)
# What is farther from every object is the room behind the table.
REACH_M = 0.5
TABLE_RGB = (150, 154, 160)
REASON_RGB = np.zeros((len(Reason), 3))
REASON_RGB[Reason.NOISE] = 255, 60, 60
REASON_RGB[Reason.RESIDUE] = 255, 160, 40
REASON_RGB[Reason.UNKNOWN] = 120, 120, 120
KINDS = ('table', 'explained', 'unexplained')


@dataclass(frozen=True)
class PointGroup:
    """
    Readings of one camera.

    :ivar kind: one of KINDS; explained points have the colour of their object, unexplained ones
        that of their Reason.
    :ivar points: (n, 3) float64 world metres.
    :ivar rgb: (n, 3) float64, 0-255.
    """

    camera: str
    kind: str
    points: Float64Array
    rgb: Float64Array


def seen_points(observation: Observation, meshes: Sequence[tuple[AnyArray, AnyArray]],
                colours: Sequence[RGB],
                reasons: Callable[[Float64Array], UInt8Array]) -> list[PointGroup]:
    """
    Return a PointGroup of every kind for every camera.

    :param meshes: posed objects, see `world_mesh`; `colours` one (r, g, b) each.
    :param reasons: returns a Reason for each of the points (n, 3) that no object explains.
    """
    groups = []
    for view in observation.views:
        points = back_project(view.depth, view.camera)
        depth, ids = render_depth(meshes, view.camera)
        with np.errstate(invalid='ignore'):
            explained = view.foreground & (np.abs(depth - view.depth) <= TOLERANCE_M)
        shade = 0.55 + 0.45 * pictures.hillshade(view.depth, view.camera)
        table = view.table & ~view.foreground & np.isfinite(view.depth)
        for kind, mask in zip(KINDS, (table, explained, view.foreground & ~explained)):
            rgb = np.full((mask.sum(), 3), TABLE_RGB, float)
            if kind == 'explained':
                rgb = np.array([*colours, (0, 0, 0)], float)[ids[mask]]
            elif kind == 'unexplained':
                rgb = REASON_RGB[reasons(points[mask])]
            groups.append(PointGroup(view.camera.name, kind, points[mask],
                                     rgb * shade[mask][:, None]))
    return groups


def extent_of(groups: Sequence[PointGroup],
              meshes: Sequence[tuple[AnyArray, AnyArray]]) -> tuple[Float64Array, Float64Array]:
    """
    Return ((3,) low, (3,) high), the corners of a box around all that stands, metres.

    Every mesh is inside. Points extend the box, up to REACH_M beyond the meshes, if there are
    any; the outermost hundredth does not count.
    """
    standing = np.concatenate([np.zeros((0, 3)),
                               *(g.points for g in groups if g.kind != 'table')])
    standing = standing[np.isfinite(standing).all(1)]
    posed = [v for v, _ in meshes if len(v) and np.isfinite(v).all()]
    if not len(standing) and not posed:
        return np.array([-0.4, -0.4, -0.05]), np.array([0.4, 0.4, 0.3])
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    if len(standing):
        low, high = np.percentile(standing, [1, 99], axis=0)
    if posed:
        first, last = (np.array([f(v, axis=0) for v in posed]) for f in (np.min, np.max))
        first, last = first.min(0), last.max(0)
        low = np.minimum(np.maximum(low, first - REACH_M), first)
        high = np.maximum(np.minimum(high, last + REACH_M), last)
    return low - BORDER_M, high + BORDER_M


def inside(groups: Sequence[PointGroup], low: AnyArray, high: AnyArray) -> list[PointGroup]:
    """Return the groups with their points in a box."""
    return [_taken(g, np.flatnonzero(((g.points >= low) & (g.points <= high)).all(1)))
            for g in groups]


def thinned(steps: Sequence[Sequence[PointGroup]]) -> tuple[list[list[PointGroup]], float]:
    """
    Return (the groups of every frame set with few enough points for a page, voxel size, m).

    In each cube of the voxel size, the first point of each camera and kind is kept.
    """
    limit = min(MAX_POINTS * len(steps), MAX_SEQUENCE)
    thin, voxel_m = list[list[PointGroup]](), 0.0
    for voxel_m in VOXELS_M:
        thin = [[_thin(g, voxel_m * (2 if g.kind == 'table' else 1)) for g in groups]
                for groups in steps]
        if sum(len(g.points) for groups in thin for g in groups) <= limit:
            break
    return thin, voxel_m


def _thin(group: PointGroup, voxel_m: float) -> PointGroup:
    """Return a group with one point in each cube."""
    cells = np.floor(group.points / voxel_m).astype(np.int64)
    # Cells of a box of points are far fewer than 2^20 along each axis.
    keys = (cells << np.array([0, 20, 40])).sum(1)
    return _taken(group, np.sort(np.unique(keys, return_index=True)[1]))


def _taken(group: PointGroup, rows: AnyArray) -> PointGroup:
    """Return some points of a group."""
    return PointGroup(group.camera, group.kind, group.points[rows], group.rgb[rows])
