# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
One object instead of two.

A box that is larger than the generic one is readily explained by two boxes side by side, and no
refinement of either leads from there to the single one.
"""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.core.kernels.pose import SCALE_LIMITS
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np
from scipy.spatial.transform import Rotation

CORNERS = np.array([[x, y, z] for x in (-.5, .5) for y in (-.5, .5) for z in (-.5, .5)])
TOUCHING_M = 0.03


def merged_pairs(objects: Candidates, models: Sequence[GenericModel],
                 ) -> tuple[Candidates, Int64Array]:
    """
    Return (Candidates, pairs): boxes around touching objects of one category.

    :param objects: Candidates; `models` tuple of GenericModel, class id c is models[c - 1].
    :return: for each touching pair two candidates, turned like the one and like the other, with
        sizes that a hypothesis may have; pairs (n, 2) int64 rows of `objects`.
    """
    R = Rotation.from_quat(objects.rotation_xyzw).as_matrix()
    rows, pairs = [], []
    for i in range(len(objects)):
        for j in np.flatnonzero(objects.category == objects.category[i]):
            box = None if j == i else _around(objects, R, i, int(j))
            if box is not None:
                rows.append((i, *box))
                pairs.append((i, j))
    if not rows:
        return Candidates.empty(), np.zeros((0, 2), np.int64)
    base = np.array([i for i, _, _ in rows])
    like = objects.take(base)
    extents = np.array([shape.extents for shape in like.shapes(models)])
    size = np.clip([s for _, _, s in rows], SCALE_LIMITS[0] * extents, SCALE_LIMITS[1] * extents)
    return Candidates(like.category, np.array([t for _, t, _ in rows]), like.rotation_xyzw, size,
                      like.score, like.member), np.array(pairs)


def _around(objects: Candidates, R: Float64Array, i: int, j: int,
            ) -> tuple[Float64Array, Float64Array] | None:
    """Return (centre, size) of the box turned like i around i and j, None if they are apart."""
    half = objects.size[i] / 2
    corners = CORNERS * objects.size[j] @ R[j].T + objects.translation[j] - objects.translation[i]
    corners = corners @ R[i]
    low, high = corners.min(0), corners.max(0)
    if max((low - half).max(), (-half - high).max()) > TOUCHING_M:
        return None
    low, high = np.minimum(low, -half), np.maximum(high, half)
    return R[i] @ (low + high) / 2 + objects.translation[i], high - low
