# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The paper's multi-view decision forest: one per view, with tests in all views.

Basevi & Leonardis 2016, section 4, after Brachmann et al. 2014. The pixel's 3D point is projected
into every view; there it is the centre of a bounding region whose size falls with its depth in
that view. A test compares the depths at two offsets in one region, or at one offset and the
centre. Depths are whole millimetres, so that results are exact everywhere.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import (
    AnyArray,
    Float32Array,
    UInt8Array,
    UInt16Array,
)
from hooc_perception.core.classification.forest import DAMAGED, Forest
from hooc_perception.core.classification.kernels import pixel_forest as kernels
from hooc_perception.core.geometry import inverse
from hooc_perception.core.types import ObservedView
from hooc_perception.errors import HoocError
import numpy as np

FAR_MM = 4000


@dataclass(frozen=True)
class PixelForest:
    """
    The forest of one view.

    :ivar forest: `feature` of an inner node is the row of its test.
    :ivar test_view: (k,) uint8 view that a test reads.
    :ivar offsets: (k, 4) float32 du1 dv1 du2 dv2, metres at the point's depth; the last two
        are zero where the test compares with the centre.
    """

    forest: Forest
    test_view: UInt8Array
    offsets: Float32Array

    def predict(self, images: UInt16Array, centre: Float32Array) -> Float32Array:
        """
        Return (n, C) float32 probabilities of pixels.

        :param images: (V, H, W) uint16 from `depth_stack`; centre (n, V, 3) from `centres`.
        """
        return kernels.predict_pixels(
            kernels.Samples(images[None], np.zeros(len(centre), np.int32), centre),
            kernels.DepthTests(self.test_view, self.offsets, FAR_MM), self.forest.nodes,
            self.forest.roots, self.forest.distributions)

    def arrays(self, prefix: str) -> dict[str, AnyArray]:
        """Return the arrays as a dict whose keys start with `prefix`."""
        return {**self.forest.arrays(prefix), prefix + 'test_view': self.test_view,
                prefix + 'offsets': self.offsets}

    @staticmethod
    def from_arrays(arrays: Mapping[str, AnyArray], prefix: str,
                    n_views: int) -> 'PixelForest':
        """Return the PixelForest stored under `prefix`; raise HoocError if it is damaged."""
        forest = Forest.from_arrays(arrays, prefix)
        try:
            view = np.ascontiguousarray(arrays[prefix + 'test_view'], np.uint8)
            offsets = np.ascontiguousarray(arrays[prefix + 'offsets'], np.float32)
        except KeyError as missing:
            raise HoocError(f'the classifier has no array {missing}; train the model again')
        tests = len(view)
        if (offsets.shape != (tests, 4) or not np.isfinite(offsets).all()
                or forest.feature.max(initial=-1) >= tests or (view >= n_views).any()):
            raise HoocError(DAMAGED)
        return PixelForest(forest, view, offsets)


def depth_stack(views: Sequence[ObservedView]) -> UInt16Array:
    """
    Return (V, H, W) uint16 depth in mm of all views, as the tests read it.

    Pixels without a reading take the empty scene's depth, and FAR_MM where that is unknown
    too or the image ends.
    """
    h = max(v.depth.shape[0] for v in views)
    w = max(v.depth.shape[1] for v in views)
    out = np.full((len(views), h, w), FAR_MM, np.uint16)
    for i, view in enumerate(views):
        depth = np.where(np.isfinite(view.depth), view.depth, view.background)
        mm = np.nan_to_num(np.rint(depth * 1000.0), nan=FAR_MM)
        out[i, :depth.shape[0], :depth.shape[1]] = np.clip(mm, 0, FAR_MM)
    return out


def centres(points: AnyArray, views: Sequence[ObservedView]) -> Float32Array:
    """Return (n, V, 3) float32 rows (u, v, pixels per metre) of world points (n, 3)."""
    return kernels.centres(
        np.ascontiguousarray(points, np.float64),
        np.stack([np.asarray(v.camera.K, np.float64) for v in views]),
        np.stack([inverse(v.camera.T_world_camera) for v in views]))
