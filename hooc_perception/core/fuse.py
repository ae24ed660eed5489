# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fusion of repeated depth images of a scene that does not move, against noise."""

import numpy as np

# Readings that change by more than this in more than MOVED_SHARE of the pixels mean that
# something moved; noise of a Kinect at edges does so in a quarter of that share.
MOVED_M = 0.05
MOVED_SHARE = 0.01


def fuse_depth(stack):
    """
    Return the median of repeated readings and how many there were.

    A pixel is read where at least half of the images read it: what only flickers is noise. With
    an even number of readings the nearer of the two in the middle counts, since their mean may
    lie on no surface.

    :param stack: (N, H, W) float32 metres, NaN = none.
    :return: (depth (H, W) float32, NaN = none; count (H, W) uint8 of readings).
    """
    stack = np.asarray(stack, np.float32)
    count = np.isfinite(stack).sum(0)
    ordered = np.sort(stack, axis=0)        # NaN sorts to the end
    middle = np.maximum(count - 1, 0) // 2
    depth = np.take_along_axis(ordered, middle[None], 0)[0]
    depth[2 * count < len(stack)] = np.nan
    depth[count == 0] = np.nan
    return depth, np.minimum(count, 255).astype(np.uint8)


def has_moved(depth, before):
    """
    Return whether an image shows another scene than the one before.

    :param depth, before: (H, W) metres, NaN = none.
    """
    both = np.isfinite(depth) & np.isfinite(before)
    if not both.any():
        return False
    return bool((np.abs(depth - before)[both] > MOVED_M).mean() > MOVED_SHARE)
