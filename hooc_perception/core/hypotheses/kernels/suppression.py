# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Leave out hypotheses that say almost the same as better ones."""

import numba as nb
import numpy as np


@nb.njit(cache=True, error_model='numpy')
def first_unlike(H, reach, most):
    """
    Return the first `most` rows of hypotheses (m, 10) that are no near copies of one before.

    Copies lie within `reach` metres, and about agree in orientation and in size.
    """
    kept = np.empty(min(most, H.shape[0]), np.int64)
    n = 0
    for i in range(H.shape[0]):
        if n >= most:
            break
        copy = False
        for k in range(n):
            a, b = H[i], H[kept[k]]
            away = (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2
            if away >= reach * reach:
                continue
            cosine = abs(a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6])
            stretch = max(abs(np.log(a[7] / b[7])), abs(np.log(a[8] / b[8])),
                          abs(np.log(a[9] / b[9])))
            if cosine > 0.92 and stretch < 0.22:
                copy = True
                break
        if not copy:
            kept[n] = i
            n += 1
    return kept[:n]
