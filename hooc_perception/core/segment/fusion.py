# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fusion of repeated depth images of a scene, against noise, without what has moved."""

from collections import deque

import numpy as np

# Change is looked for in the means of blocks of so many pixels squared: they average the noise
# of pixels, and what flickers at edges is a small part of a block.
BLOCK = 8
# A block has changed from so many times the noise on, its neighbours with it from so many on.
STRONG, WEAK = 8.0, 2.0
# More than this is no noise, less than this nobody can tell from it. [m]
LEAST_M, MOST_M = 0.004, 0.05


def fuse_depth(stack, newest=None):
    """
    Return the median of repeated readings and how many there were.

    A pixel is read where at least half of the images read it: what only flickers is noise. With
    an even number of readings the nearer of the two in the middle counts, since their mean may
    lie on no surface.

    :param stack: (N, H, W) float32 metres, NaN = none, oldest first.
    :param newest: (H, W) integers: of each pixel only so many of the newest count; None = all.
    :return: (depth (H, W) float32, NaN = none; count (H, W) uint8 of readings).
    """
    stack = np.asarray(stack, np.float32)
    images = len(stack)
    if newest is not None:
        images = np.minimum(newest, len(stack))
        age = np.arange(len(stack) - 1, -1, -1)[:, None, None]
        stack = np.where(age < images, stack, np.float32(np.nan))
    count = np.isfinite(stack).sum(0)
    ordered = np.sort(stack, axis=0)        # NaN sorts to the end
    middle = np.maximum(count - 1, 0) // 2
    depth = np.take_along_axis(ordered, middle[None], 0)[0]
    depth[2 * count < images] = np.nan
    depth[count == 0] = np.nan
    return depth, np.minimum(count, 255).astype(np.uint8)


def block_means(depth):
    """
    Return the means of the readings in blocks, and the numbers of readings.

    :param depth: (H, W) metres, NaN = none.
    :return: (means (h, w) float32, NaN = fewer readings than in a quarter of a block; (h, w) int).
    """
    H, W = depth.shape
    padded = np.pad(depth, ((0, -H % BLOCK), (0, -W % BLOCK)), constant_values=np.nan)
    cells = padded.reshape(padded.shape[0] // BLOCK, BLOCK, -1, BLOCK)
    seen = np.isfinite(cells)
    readings = seen.sum((1, 3))
    means = np.where(seen, cells, 0).sum((1, 3)) / np.maximum(readings, 1)
    means[4 * readings < BLOCK * BLOCK] = np.nan
    return means.astype(np.float32), readings


class Fusion:
    """
    The last images of one camera; what changes begins anew, block by block.

    A block that differs from the images before shows the new image at once; where the next image
    differs as well, those before are forgotten. So an object that is moved or taken away is not
    shown by newer images, unless it rises hardly above the noise, and a block that flickers once
    loses nothing.
    """

    def __init__(self):
        """Begin without images."""
        self._images = deque()      # (depth, block means), oldest first
        # Of each block: how many of the newest images show what is there; whether the last one
        # differed from those before, and whether by its depth.
        self._newest = self._differs = self._shifted = None

    def __len__(self):
        """Return how many images there are."""
        return len(self._images)

    def forget(self):
        """Forget all images."""
        self._images.clear()

    def add(self, depth, frames):
        """
        Take in an image.

        :param depth: (H, W) float32 metres, NaN = none.
        :param frames: how many images to keep.
        """
        if self._images and self._images[-1][0].shape != depth.shape:
            self.forget()
        self._images = deque(self._images, maxlen=frames)
        means, readings = block_means(depth)
        if not self._images:
            self._differs = self._shifted = np.zeros(means.shape, bool)
            self._newest = np.ones(means.shape, int)
        else:
            before, _ = fuse_depth(np.stack([m for _, m in self._images]), self._newest)
            self._shifted = shifted_blocks(means, before)
            differs = self._shifted | np.isfinite(before) & (readings == 0)
            again = differs & self._differs
            self._differs = differs & ~again
            self._newest = np.where(again, 1, np.minimum(self._newest + 1, frames))
        self._images.append((depth, means))

    def fused(self):
        """Return what `fuse_depth` returns, of each block's images that show what is there."""
        newest = np.where(self._shifted, 1, self._newest)
        depth = np.stack([d for d, _ in self._images])
        newest = newest.repeat(BLOCK, 0).repeat(BLOCK, 1)[:depth.shape[1], :depth.shape[2]]
        return fuse_depth(depth, newest)


def shifted_blocks(means, before):
    """
    Return which blocks (h, w) lie at another depth than before, by the noise of the image itself.

    Noise grows with the square of the distance. What has changed is a small part of an image, or
    all of it: then MOST_M says so.

    :param means, before: (h, w) metres, NaN = none.
    """
    shift = np.abs(means - before)
    weight = np.minimum(means, before) ** 2
    known = np.isfinite(shift)
    if not known.any():
        return known
    noise = 1.48 * np.median(shift[known] / weight[known]) * weight
    strong = shift > np.clip(STRONG * noise, LEAST_M, MOST_M)
    around = np.pad(strong, 1)
    near = np.any([around[v:v + strong.shape[0], u:u + strong.shape[1]]
                   for v in range(3) for u in range(3)], axis=0)
    return strong | near & (shift > np.clip(WEAK * noise, LEAST_M / 2, MOST_M))
