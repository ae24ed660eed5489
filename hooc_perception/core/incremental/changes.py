# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Change detection between two depth images of one camera that stands still.

Depth is compared in the mean over a small window, relative to the noise of the image itself, so
that a knife on the table is noticed where no single pixel exceeds the noise. Depth edges flicker
by far more than noise and are left out.
"""

from collections.abc import Sequence
from dataclasses import replace

from hooc_perception.core.arrays import BoolArray, Float32Array
from hooc_perception.core.incremental.kernels.windows import at_edges, compare_windows
from hooc_perception.core.segment.foreground import large_parts
from hooc_perception.core.types import Camera, Observation, ObservedView
import numpy as np
from scipy import ndimage

# The share of a window that must have been measured twice.
LEAST_SHARE = 0.4
# Depth that differs by more than this within 3 x 3 pixels, per metre of depth, is an edge. Coarse
# images have larger steps: what is seen at up to 70 degrees to its normal is none in any of them.
EDGE, STEEPEST = 0.015, 2.74
# A window has changed if its mean differs by this multiple of the noise, which grows with the
# square of the distance; within these bounds. [m]
STRONG, LEAST_M, MOST_M = 7.0, 0.003, 0.03
# A single difference counts as no more than this: flying pixels are as rare as they are wrong.
CLIP_M = 0.05
# Of a window that was measured before and is not now, or the reverse, this share must be so.
APPEARED = 0.8
# Connected changes of fewer pixels are noise; so are all changes together, over all views.
FEWEST_CONNECTED_PX, FEWEST_PX = 12, 30
# Levelling moves a camera by fractions of a millimetre from frame set to frame set; more than this
# is another pose. [m; entries of the rotation matrix]
SAME_PLACE_M, SAME_TURN = 0.005, 0.005


def changed_pixels(before: Float32Array, now: Float32Array, focal_px: float) -> BoolArray:
    """
    Return which pixels (H, W) show something else than before.

    :param before, now: (H, W) float32 metres, NaN = none.
    :param focal_px: focal length of the camera.
    """
    before, now = (np.ascontiguousarray(depth, np.float32) for depth in (before, now))
    edge = max(EDGE, 2 * STEEPEST / focal_px)
    edges = at_edges(before, edge) | at_edges(now, edge)
    shift, share, appeared, gone = compare_windows(before, now, edges, CLIP_M)
    mean, enough = np.abs(shift) / np.maximum(share, 1e-6), share >= LEAST_SHARE
    square = np.fmin(before, now) ** 2
    sample = enough & np.isfinite(before) & np.isfinite(now)
    # Changes are a small part of an image: the median is the noise. [m at 1 m]
    noise = 1.48 * float(np.median(mean[sample] / square[sample])) if sample.any() else 0.0
    with np.errstate(invalid='ignore'):
        changed = enough & (mean > np.clip(STRONG * noise * square, LEAST_M, MOST_M))
    changed |= (appeared >= APPEARED) | (gone >= APPEARED)
    if not changed.any():
        return changed
    # The mean of a window spreads over its border: what differs there belongs to the change.
    changed = np.asarray(ndimage.binary_dilation(changed, np.ones((3, 3), bool)), bool)
    return large_parts(changed, FEWEST_CONNECTED_PX)


def changes(before: Observation, now: Observation) -> tuple[BoolArray, ...]:
    """
    Return, per view, which foreground pixels (H, W) of either observation have changed.

    Pixels that are not seen in either of them tell nothing, see `unseen`.

    :raises ValueError: where the views are not of the same cameras, see `comparable`.
    """
    if not comparable(before, now):
        raise ValueError('these are observations of different cameras')
    masks = []
    for a, b in zip(before.views, now.views):
        mask = changed_pixels(a.depth, b.depth, focal_px(b.camera))
        mask &= np.asarray(ndimage.binary_dilation(a.foreground | b.foreground), bool)
        masks.append(large_parts(mask & ~unseen(a) & ~unseen(b), FEWEST_CONNECTED_PX))
    return tuple(masks)


def unseen(view: ObservedView) -> BoolArray:
    """
    Return which pixels (H, W) of a view tell nothing.

    The robot or something else hides them, or the camera has dropped out.
    """
    if not np.isfinite(view.depth).any():
        return np.ones(view.depth.shape, bool)
    return np.zeros(view.depth.shape, bool) if view.hidden is None else view.hidden


def changed_share(before: Observation, now: Observation, masks: Sequence[BoolArray]) -> float:
    """Return the share of the foreground of both observations that has changed, 0 to 1."""
    total = sum(int((a.foreground | b.foreground).sum())
                for a, b in zip(before.views, now.views))
    # Masks reach a pixel beyond the foreground.
    return min(1.0, sum(int(mask.sum()) for mask in masks) / max(total, 1))


def comparable(before: Observation, now: Observation) -> bool:
    """Return whether two observations are of the same cameras in the same places."""
    return len(before.views) == len(now.views) and all(
        _same_view(a, b) for a, b in zip(before.views, now.views))


def focal_px(camera: Camera) -> float:
    """Return the focal length of a camera, the shorter one if there are two."""
    return float(min(camera.K[0, 0], camera.K[1, 1]))


def same_camera(before: Camera, now: Camera) -> bool:
    """Return whether a camera is the same and stands where it stood."""
    moved = np.abs(before.T_world_camera - now.T_world_camera)
    return ((before.name, before.width, before.height) == (now.name, now.width, now.height)
            and np.array_equal(before.K, now.K)
            and float(moved[:3, 3].max()) < SAME_PLACE_M
            and float(moved[:3, :3].max()) < SAME_TURN)


def _same_view(before: ObservedView, now: ObservedView) -> bool:
    """Return whether two views are of the same camera in the same place."""
    a, b = before.camera, now.camera
    if unseen(before).all() or unseen(now).all():
        # A camera that sees no table is not levelled: it seems to have moved.
        b = replace(b, T_world_camera=a.T_world_camera)
    return same_camera(a, b)
