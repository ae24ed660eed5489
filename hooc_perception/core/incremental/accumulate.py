# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Depth averaged over the frame sets of a scene that stands still.

Every pixel keeps the mean of the readings that agree. Where the image has changed (changes.py)
it starts again at once, so that nothing is smeared; a single reading that disagrees is outvoted
by those before it (Boyer & Moore 1991), so that flying pixels and flickering edges do not stay.
What reaches into the workspace from outside, an arm or a hand, is set aside (intruders.py): the
mean behind it stays as it was.
"""

from dataclasses import dataclass, replace

from hooc_perception.core.arrays import BoolArray, Float32Array, UInt8Array
from hooc_perception.core.incremental.changes import changed_pixels, focal_px, same_camera
from hooc_perception.core.incremental.kernels.windows import accumulate_pixels
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np

# Readings agree if they differ by no more than this multiple of the noise of a pixel, which grows
# with the square of the distance, within these bounds. [m]
AGREE, LEAST_M, MOST_M = 4.0, 0.004, 0.06


@dataclass(frozen=True, eq=False)
class Accumulated:
    """
    What one camera has seen of a scene.

    :ivar camera: of the images, as it was calibrated.
    :ivar depth: (H, W) float32 metres, the mean of the readings that agree; NaN = none.
    :ivar count: (H, W) uint8, how many there were.
    """

    camera: Camera
    depth: Float32Array
    count: UInt8Array

    @staticmethod
    def first(view: RectifiedView) -> 'Accumulated':
        """Return what one image alone shows."""
        return Accumulated(view.camera, view.depth, np.ones(view.depth.shape, np.uint8))

    def continues(self, view: RectifiedView) -> bool:
        """Return whether an image is of the same camera in the same place."""
        return same_camera(self.camera, view.camera)


def accumulate(before: Accumulated, view: RectifiedView, changed: BoolArray, aside: BoolArray,
               frames: int) -> Accumulated:
    """
    Return what a camera has seen after one more image.

    :param changed: (H, W) bool, pixels that start again, see `changed_pixels`.
    :param aside: (H, W) bool, pixels that do not count in this image.
    :param frames: most readings that a mean is taken of.
    """
    now = np.ascontiguousarray(view.depth, np.float32)
    sample = np.abs(now - before.depth)[::2, ::2] / before.depth[::2, ::2] ** 2
    known = np.isfinite(sample)
    noise = AGREE * 1.48 * float(np.median(sample[known])) if known.any() else 0.0
    depth, count = accumulate_pixels(before.depth, before.count, now, changed, aside, noise,
                                     LEAST_M, MOST_M, frames)
    return Accumulated(view.camera, depth, count)


def fused_view(accumulated: Accumulated, view: RectifiedView, aside: BoolArray) -> RectifiedView:
    """
    Return the latest image with the accumulated depth.

    :param aside: (H, W) bool, what is set aside in it: these pixels become `hidden`.
    """
    hidden = aside if view.hidden is None else aside | view.hidden
    if not hidden.any():
        return replace(view, depth=accumulated.depth)
    depth = accumulated.depth.copy()
    depth[hidden] = np.nan
    return replace(view, depth=depth, hidden=hidden)


def changed_in(before: Accumulated, view: RectifiedView) -> BoolArray:
    """Return which pixels (H, W) of an image show something else than what was accumulated."""
    changed = changed_pixels(before.depth, view.depth, focal_px(view.camera))
    return changed if view.hidden is None else changed & ~view.hidden
