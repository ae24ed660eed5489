# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Class probabilities of a frame set that shows the same as the one before."""

from hooc_perception.core.types import Observation, PixelProbabilities
import numpy as np
from scipy import ndimage


def carried(before: PixelProbabilities, observation: Observation) -> PixelProbabilities:
    """
    Return the probabilities of the foreground of an observation that has not changed.

    Noise moves the border of the foreground by a pixel here and there: a pixel that had none
    takes those of the nearest one that had some in its view, or is background where none had.

    :param before: of an earlier observation by the same cameras.
    """
    camera, uv, p = [], [], []
    background = np.zeros(before.p.shape[1], np.uint8)
    background[0] = 255
    for index, view in enumerate(observation.views):
        mine = np.flatnonzero(before.camera == index)
        row = np.full(view.depth.shape, -1)
        row[before.uv[mine, 1], before.uv[mine, 0]] = mine
        v, u = np.nonzero(view.foreground & np.isfinite(view.depth))
        rows = row[v, u]
        if len(mine) and (rows < 0).any():
            nearest = np.asarray(ndimage.distance_transform_edt(
                row < 0, return_distances=False, return_indices=True))
            rows = row[nearest[0, v, u], nearest[1, v, u]]
        camera.append(np.full(len(u), index, np.uint8))
        uv.append(np.column_stack([u, v]).astype(np.uint16))
        p.append(np.where(rows[:, None] >= 0, before.p[np.maximum(rows, 0)], background)
                 if len(before.p) else np.tile(background, (len(u), 1)))
    return PixelProbabilities(np.concatenate(camera), np.concatenate(uv), np.concatenate(p))
