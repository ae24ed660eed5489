# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Background subtraction: which pixels of a levelled view show something on the table.

The empty scene is computed from the camera's pose, not recorded: the table plane where the ray
meets the table, and the measurement itself elsewhere.
"""

from dataclasses import dataclass

from hooc_perception.core.arrays import BoolArray, Float32Array, Float64Array
from hooc_perception.core.geometry import rays, transform
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.regions import Workspace
from hooc_perception.core.segment.uneven import uneven_table
from hooc_perception.core.types import Camera, ObservedView
import numpy as np
from scipy import ndimage

# The table may reach beyond the workspace by this factor.
TABLE_REACH = 1.6
# A reading so far behind the plane shows that the table has ended.
BEHIND_M = 0.05
# Connected parts of fewer pixels are flying pixels.
FEWEST_PIXELS = 6


@dataclass(frozen=True, eq=False)
class Allowed:
    """
    Where foreground may be.

    :ivar workspace: in the target frame.
    :ivar T_target_table: (4, 4); None = the identity.
    :ivar radius_m: largest horizontal distance from the origin of the table frame.
    """

    workspace: Workspace
    T_target_table: Float64Array | None
    radius_m: float

    def __call__(self, points: Float64Array, pixels: BoolArray) -> BoolArray:
        """
        Return those of the `pixels` (H, W) whose points lie in the workspace.

        :param points: (H, W, 3) table frame.
        """
        if self.workspace.region is None and not self.workspace.ignored:
            return pixels
        chosen = points[pixels]
        T = self.T_target_table
        inside = pixels.copy()
        inside[pixels] = self.workspace.contains(chosen if T is None else transform(T, chosen))
        return inside


def against_table(camera: Camera, depth: Float32Array, sigma_m: float, config: ObserveConfig,
                  allowed: Allowed) -> ObservedView:
    """
    Segment the foreground of one levelled view and add the depth of the empty scene.

    :param camera: its pose puts the table at z = 0, see `level`.
    :param depth: (H, W) float32 metres, rectified, NaN = none.
    :param sigma_m: standard deviation of the heights of the table, metres.
    :param allowed: where foreground may be.
    """
    directions = _world_rays(camera, depth.shape)
    plane = _plane_depth(camera, directions)
    T = camera.T_world_camera
    with np.errstate(invalid='ignore'):
        points = directions * depth[..., None] + T[:3, 3]
        hit = directions[..., :2] * plane[..., None] + T[:2, 3]
    seen = np.isfinite(depth)
    inside = np.hypot(hit[..., 0], hit[..., 1]) < TABLE_REACH * allowed.radius_m
    behind = seen & (depth > plane + BEHIND_M)
    table = np.isfinite(plane) & inside & ~_opened(behind)
    near = np.hypot(points[..., 0], points[..., 1]) < allowed.radius_m
    height = points[..., 2]
    above = height > _threshold(sigma_m, config)
    if config.uneven_m > 0:
        flat = seen & inside & (np.abs(height) < config.table_band_m)
        pixels = config.uneven_m * camera.K[0, 0] / np.median(depth[flat]) if flat.any() else 0
        base, local_sigma = uneven_table(height, flat & ~above, pixels)
        above |= height - base > _threshold(local_sigma, config)
    foreground = seen & near & above & (height < config.max_height_m)
    foreground = allowed(points, foreground)
    foreground = large_parts(foreground, FEWEST_PIXELS)
    return _with_background(camera, depth, foreground, table, plane)


def observed_view(camera: Camera, depth: Float32Array, foreground: BoolArray,
                  table: BoolArray) -> ObservedView:
    """
    Rebuild an ObservedView from what cannot be computed: its depth, pose and masks.

    Equal to the view that `observe` returned to the last bit, in any process, if the arguments
    are those of that view.

    :param camera: rectified and levelled; `T_world_camera` exact float64.
    :param depth: (H, W) float32 metres, NaN = none; foreground, table: (H, W) bool.
    """
    plane = _plane_depth(camera, _world_rays(camera, depth.shape))
    return _with_background(camera, depth, foreground, table, plane)


def _with_background(camera: Camera, depth: Float32Array, foreground: BoolArray,
                     table: BoolArray, plane: Float64Array) -> ObservedView:
    """Return the ObservedView, its background from the depth of the table `plane` (H, W)."""
    # Off the table, the empty scene is known only where it is measured.
    elsewhere = np.where(np.isfinite(depth) & ~foreground, depth, np.nan)
    background = np.where(table, plane, elsewhere)
    return ObservedView(camera, depth, background.astype(np.float32), foreground, table)


def _world_rays(camera: Camera, shape: tuple[int, ...]) -> Float64Array:
    """Return (H, W, 3) directions through the pixels in the world frame, 1 m deep."""
    return rays(camera.K, *shape) @ camera.T_world_camera[:3, :3].T


def _plane_depth(camera: Camera, directions: Float64Array) -> Float64Array:
    """Return (H, W) metres: the depth of z = 0 at every pixel, NaN where its ray misses it."""
    with np.errstate(divide='ignore', invalid='ignore'):
        plane = -camera.T_world_camera[2, 3] / directions[..., 2]
        plane[(directions[..., 2] >= 0) | (plane <= 0)] = np.nan
    return plane


def _threshold(sigma_m: float, config: ObserveConfig) -> float:
    """Return the height in metres above which a point is foreground."""
    return max(config.min_foreground_m, config.foreground_sigma * sigma_m)


def _opened(mask: BoolArray) -> BoolArray:
    """Return the mask without specks: single pixels behind the table are noise."""
    return np.asarray(ndimage.binary_opening(mask, np.ones((3, 3), bool)), bool)


def large_parts(mask: BoolArray, fewest_px: int) -> BoolArray:
    """Return the pixels (H, W) of connected parts of so many pixels; smaller ones are noise."""
    if not mask.any():
        return mask
    labels = np.empty(mask.shape, np.int32)
    ndimage.label(mask, np.ones((3, 3), int), output=labels)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return sizes[labels] >= fewest_px
