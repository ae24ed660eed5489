# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Temporal fusion of depth images of one camera: less noise, without showing what has moved."""

from collections import deque

from hooc_perception.core.arrays import BoolArray, Float32Array, Int64Array, UInt8Array
import numpy as np

# Change is detected in the means of blocks of this many pixels squared: they average the noise
# of pixels, and flicker at depth edges is a small part of a block.
BLOCK = 8
# A block has changed if it differs by STRONG times the noise; its neighbours then need WEAK.
STRONG, WEAK = 8.0, 2.0
# Bounds of these thresholds: larger differences are never noise, smaller ones always. [m]
LEAST_M, MOST_M = 0.004, 0.05


def fuse_depth(stack: Float32Array,
               newest: Int64Array | None = None) -> tuple[Float32Array, UInt8Array]:
    """
    Return the median of repeated readings and how many there were.

    A pixel is valid if at least half of the images have a reading there; anything rarer is
    flicker. With an even number of readings the nearer of the two middle ones is taken, since
    their mean may lie on no surface.

    :param stack: (N, H, W) float32 metres, NaN = none, oldest first.
    :param newest: (H, W) integers, how many of the newest images count at each pixel; None =
        all of them.
    :return: (depth (H, W) float32, NaN = none; count (H, W) uint8 of readings).
    """
    stack = np.asarray(stack, np.float32)
    images: int | Int64Array = len(stack)
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


def block_means(depth: Float32Array) -> tuple[Float32Array, Int64Array]:
    """
    Return the mean of the readings in each block, and the number of readings.

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
    The last images of one camera; a block that changes starts over.

    A block that differs from the earlier images shows the new image at once. If the next image
    differs as well, the earlier ones are dropped. An object that is moved or removed therefore
    disappears immediately, unless it barely exceeds the noise, and a block that flickers once
    loses nothing.
    """

    def __init__(self) -> None:
        """Start without images."""
        self._images: deque[tuple[Float32Array, Float32Array]] = deque()
        # Per block (h, w): how many of the newest images show the present scene; whether the
        # last image differed from the earlier ones, and whether by its depth.
        self._newest: Int64Array = np.zeros((0, 0), int)
        self._differs: BoolArray = np.zeros((0, 0), bool)
        self._shifted: BoolArray = np.zeros((0, 0), bool)

    def __len__(self) -> int:
        """Return the number of images."""
        return len(self._images)

    def forget(self) -> None:
        """Drop all images."""
        self._images.clear()

    def add(self, depth: Float32Array, frames: int) -> None:
        """
        Add an image.

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

    def fused(self) -> tuple[Float32Array, UInt8Array]:
        """Return `fuse_depth` of those images, per block, that show the present scene."""
        newest = np.where(self._shifted, 1, self._newest)
        depth = np.stack([d for d, _ in self._images])
        newest = newest.repeat(BLOCK, 0).repeat(BLOCK, 1)[:depth.shape[1], :depth.shape[2]]
        return fuse_depth(depth, newest)


def shifted_blocks(means: Float32Array, before: Float32Array) -> BoolArray:
    """
    Return which blocks (h, w) have moved in depth, relative to the noise of the image itself.

    Noise grows with the square of the distance. Its level is the median over the image, because
    changes are a small part of it; if everything has changed, MOST_M detects it.

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
