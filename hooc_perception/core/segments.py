# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Split the fused cloud into smooth patches."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree


def smooth_patches(cloud, radius_m=0.009, smooth_cos=0.94, step_m=0.006):
    """
    Return (n,) int32 labels: points joined where neighbouring normals agree.

    :param radius_m: neighbours are at most this far apart.
    :param smooth_cos: least cosine of the angle between the normals of neighbours.
    :param step_m: neighbours may lie this far off each other's tangent planes, summed.
    """
    points, normals = cloud.points, cloud.normals
    n = len(points)
    if n < 2:
        return np.zeros(n, np.int32)
    pairs = cKDTree(points).query_pairs(radius_m, output_type='ndarray')
    a, b = pairs[:, 0], pairs[:, 1]
    step = points[b] - points[a]
    off = (np.abs(np.einsum('ij,ij->i', step, normals[a]))
           + np.abs(np.einsum('ij,ij->i', step, normals[b])))
    smooth = (np.einsum('ij,ij->i', normals[a], normals[b]) > smooth_cos) & (off < step_m)
    graph = coo_matrix((np.ones(smooth.sum(), np.int8), (a[smooth], b[smooth])), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int32)
