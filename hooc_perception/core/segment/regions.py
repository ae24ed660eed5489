# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Regions of the target frame in which to look for objects, or to ignore what stands there."""

from dataclasses import dataclass
from functools import lru_cache
import json
from typing import Any

from hooc_perception.core.arrays import AnyArray, BoolArray, Float64Array
from hooc_perception.errors import HoocError
import numpy as np

# Two corners are a box, more are a polygon.
BOX_CORNERS = 2
FORM = ('give the corners of a polygon, [[x, y], [x, y], [x, y], ...], or two opposite corners of '
        'a box, [[x, y, z], [x, y, z]] or [[x, y], [x, y]], in metres')


@dataclass(frozen=True, eq=False)
class Region:
    """
    A prism over a polygon.

    :ivar corners: (k, 2) float64 corners of the polygon in order, target frame, metres.
    :ivar low, high: bounds of z, metres; infinite where the region has none.
    """

    corners: Float64Array
    low: float = -np.inf
    high: float = np.inf

    def contains(self, points: AnyArray) -> BoolArray:
        """Return (n,) bool: which points (n, 3) lie inside; NaN does not."""
        x, y, z = points[:, 0], points[:, 1], points[:, 2]
        with np.errstate(invalid='ignore', divide='ignore'):
            inside = np.zeros(len(points), bool)
            # Even-odd rule: count the edges that a ray along x crosses.
            for a, b in zip(self.corners, np.roll(self.corners, -1, axis=0)):
                spans = (a[1] > y) != (b[1] > y)
                inside ^= spans & (x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]))
            return inside & (z >= self.low) & (z <= self.high)


@dataclass(frozen=True, eq=False)
class Workspace:
    """
    Where objects are looked for.

    :ivar region: None = everywhere within the workspace radius.
    :ivar ignored: regions in which nothing is an object.
    """

    region: Region | None
    ignored: tuple[Region, ...] = ()

    def contains(self, points: AnyArray) -> BoolArray:
        """Return (n,) bool: which points (n, 3) of the target frame may belong to objects."""
        inside = (np.ones(len(points), bool) if self.region is None
                  else self.region.contains(points))
        for region in self.ignored:
            inside &= ~region.contains(points)
        return inside

    @property
    def centre(self) -> Float64Array | None:
        """Return (2,) the middle of the region's bounding box, target frame; None without one."""
        if self.region is None:
            return None
        return (self.region.corners.min(0) + self.region.corners.max(0)) / 2

    @property
    def radius_m(self) -> float | None:
        """Return the distance from the centre to the farthest corner; None without a region."""
        centre = self.centre
        if self.region is None or centre is None:
            return None
        return float(np.linalg.norm(self.region.corners - centre, axis=1).max())


@lru_cache(maxsize=16)
def workspace_of(workspace: str, ignore: str) -> Workspace:
    """
    Return the Workspace of two parameters.

    :param workspace: JSON text of one region, empty = none.
    :param ignore: JSON text of a list of regions, empty = none.
    :raises HoocError: where a text is no region.
    """
    region = _region('workspace', _json('workspace', workspace)) if workspace.strip() else None
    ignored = _json('ignore', ignore) if ignore.strip() else []
    if not isinstance(ignored, list):
        raise HoocError(f'parameter ignore is {ignore!r}; give a list of regions')
    return Workspace(region, tuple(_region(f'ignore, region {k},', one)
                                   for k, one in enumerate(ignored, 1)))


def _json(name: str, text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        raise HoocError(f'parameter {name} is {text!r}; {FORM}') from None


def _region(name: str, value: Any) -> Region:
    """Return the Region of nested lists."""
    try:
        corners: AnyArray = np.array(value, np.float64)
    except (TypeError, ValueError):
        corners = np.zeros(0)
    if corners.ndim != 2 or not np.isfinite(corners).all() or len(corners) < BOX_CORNERS or (
            corners.shape[1] not in ((2, 3) if len(corners) == BOX_CORNERS else (2,))):
        raise HoocError(f'parameter {name} is {value!r}; {FORM}')
    if len(corners) > BOX_CORNERS:
        region = Region(corners)
    else:
        (x0, y0), (x1, y1) = corners.min(0)[:2], corners.max(0)[:2]
        z = corners[:, 2] if corners.shape[1] == 3 else (-np.inf, np.inf)
        region = Region(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]),
                        float(min(z)), float(max(z)))
    if _area(region.corners) <= 0 or region.low >= region.high:
        raise HoocError(f'parameter {name} is {value!r}, which encloses nothing; {FORM}')
    return region


def _area(corners: Float64Array) -> float:
    """Return the area of a polygon (k, 2) without crossings, square metres."""
    x, y = corners.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2
