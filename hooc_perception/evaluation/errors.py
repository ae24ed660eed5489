# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Pose errors of one estimate against its truth: BOP's MSSD, MSPD and VSD.

Definitions: Hodan et al., "BOP Challenge 2019" and "BOP: Benchmark for 6D Object Pose
Estimation" (ECCV 2018). BOP's models have the true size; here estimate and truth are one
generic model at two sizes, so a pose is the affine map x -> R diag(size / extents) x + t of the
model, and a symmetry S acts on the model before the truth's scale does. With equal sizes every
error is BOP's own.
"""

import functools

from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.core.render import render_depth
from hooc_perception.core.symmetry import is_ball, symmetry_rotations
import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import pdist

VSD_DELTA_M = 0.015
MAX_MSPD_POINTS = 1000


def affine(pose, model):
    """Return (A (3, 3), t (3,)): world = A x + t for points x of the generic model."""
    T_world_model = matrix_from_pose(pose.translation, pose.rotation_xyzw)
    scale = np.asarray(pose.size, np.float64) / np.maximum(model.extents, 1e-9)
    return T_world_model[:3, :3] * scale, T_world_model[:3, 3]


def world_mesh(pose, model):
    """Return (vertices (V, 3) float64 world, faces) of the model as posed and sized."""
    A, t = affine(pose, model)
    return model.vertices @ A.T + t, model.faces


@functools.lru_cache(maxsize=256)
def _hull_of(key):
    vertices = key.model.vertices
    try:
        return vertices[ConvexHull(vertices).vertices]
    except (QhullError, ValueError):  # a flat model
        return vertices


class _ByIdentity:
    """Key of the hull cache: the arrays of a model cannot be hashed, the object can."""

    def __init__(self, model):
        self.model = model

    def __hash__(self):
        return id(self.model)

    def __eq__(self, other):
        return self.model is other.model


def hull(model):
    """Return (n, 3) the vertices of the model's convex hull."""
    return _hull_of(_ByIdentity(model))


def diameter(pose, model):
    """Return the largest distance, metres, between two points of the model at this size."""
    points = hull(model) * (np.asarray(pose.size) / np.maximum(model.extents, 1e-9))
    return float(pdist(points).max())


def _symmetries(est, true, model):
    """Return the (n, 3, 3) symmetries to try; a ball's are those that bring est onto true."""
    if is_ball(model.symmetry):
        R_est = matrix_from_pose(est.translation, est.rotation_xyzw)[:3, :3]
        R_true = matrix_from_pose(true.translation, true.rotation_xyzw)[:3, :3]
        return (R_true.T @ R_est)[None]
    return symmetry_rotations(model.symmetry)


def mssd(est, true, model):
    """
    Return the Maximum Symmetry-Aware Surface Distance, metres.

    min over symmetries S of max over model points x of |est(x) - true(S x)|. The distance is
    convex in x, so the vertices of the convex hull suffice.

    :param est: anything with translation (3,), rotation_xyzw (4,), size (3,), as `true`.
    """
    points = hull(model)
    (A_est, t_est), (A_true, t_true) = affine(est, model), affine(true, model)
    M = A_est - A_true @ _symmetries(est, true, model)
    gap = np.einsum('nij,pj->npi', M, points) + (t_est - t_true)
    return float(np.sqrt((gap ** 2).sum(-1).max(1).min()))


def mspd(est, true, model, camera):
    """
    Return the Maximum Symmetry-Aware Projection Distance in a rectified camera, pixels.

    Models of more than MAX_MSPD_POINTS vertices are thinned evenly. Infinite where a point of
    either lies behind the camera.
    """
    step = -(-len(model.vertices) // MAX_MSPD_POINTS)
    points = np.concatenate([hull(model), model.vertices[::step]])
    R, t = camera.T_world_camera[:3, :3], camera.T_world_camera[:3, 3]
    (A_est, t_est), (A_true, t_true) = affine(est, model), affine(true, model)

    def pixels(A, shift):
        in_camera = (points @ A.swapaxes(-1, -2) + shift - t) @ R
        z = in_camera[..., 2:]
        if (z <= 0).any():
            return np.full(in_camera.shape[:-1] + (2,), np.nan)
        return in_camera[..., :2] / z * [camera.K[0, 0], camera.K[1, 1]]

    gap = pixels(A_est, t_est) - pixels(A_true @ _symmetries(est, true, model), t_true)
    if np.isnan(gap).any():
        return float('inf')
    return float(np.sqrt((gap ** 2).sum(-1).max(1).min()))


def _distance(depth, camera):
    """Return the (H, W) distances from the camera's centre for depths along its axis."""
    u, v = np.meshgrid(np.arange(depth.shape[1]), np.arange(depth.shape[0]))
    x, y = (u - camera.K[0, 2]) / camera.K[0, 0], (v - camera.K[1, 2]) / camera.K[1, 1]
    return depth * np.sqrt(x * x + y * y + 1)


def vsd(est, true, model, view, taus, delta=VSD_DELTA_M):
    """
    Return (len(taus),) the Visible Surface Discrepancy for each tolerance, each in [0, 1].

    The BOP 2019 form: a missing reading counts as visible, the cost is a step, distances are
    divided by the diameter of the true object.

    :param view: RectifiedView or ObservedView, depth NaN = no reading.
    :param taus: tolerances as shares of the diameter.
    """
    camera = view.camera
    d_est, d_true = (_distance(render_depth([world_mesh(p, model)], camera)[0], camera)
                     for p in (est, true))
    measured = _distance(view.depth, camera)
    missing = ~np.isfinite(measured)
    on_est, on_true = np.isfinite(d_est), np.isfinite(d_true)
    with np.errstate(invalid='ignore'):
        seen_true = on_true & (missing | (d_true - measured <= delta))
        seen_est = on_est & (missing | (d_est - measured <= delta) | seen_true)
    both, union = seen_est & seen_true, int((seen_est | seen_true).sum())
    if union == 0:
        return np.ones(len(taus))
    apart = np.abs(d_est[both] - d_true[both]) / diameter(true, model)
    cost = (apart[None] >= np.asarray(taus)[:, None]).sum(1)
    return (cost + union - both.sum()) / union
