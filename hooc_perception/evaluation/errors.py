# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Pose errors of one estimate against its truth: BOP's MSSD, MSPD and VSD.

Definitions: Hodan et al., "BOP Challenge 2019" and "BOP: Benchmark for 6D Object Pose
Estimation" (ECCV 2018). BOP's models have the true size; here estimate and truth are one
generic model at two sizes, so a pose is the affine map x -> R diag(size / extents) x + t of the
model, and a symmetry S acts on the model before the truth's scale does. With equal sizes every
error is BOP's own. Both are drawn as the generic mesh, whichever mesh of its category's family an
estimate was found with: the errors are those of its pose and size.
"""

from collections.abc import Sequence
from typing import Protocol

from hooc_perception.core.arrays import AnyArray, Float32Array, Float64Array, Int32Array
from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.core.memo import per_model
from hooc_perception.core.render import render_depth
from hooc_perception.core.symmetry import is_ball, symmetry_rotations
from hooc_perception.core.types import Camera, GenericModel, ObservedView, RectifiedView
import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import pdist

VSD_DELTA_M = 0.015
MAX_MSPD_POINTS = 1000


class Pose(Protocol):
    """
    An object's pose and size, estimated or true.

    :ivar translation: (3,) centre of the bounding box, world, metres.
    :ivar rotation_xyzw: (4,) unit quaternion, model axes to world.
    :ivar size: (3,) extents along the model axes, metres.
    """

    @property
    def translation(self) -> AnyArray:
        """Return (3,) the centre."""
        ...

    @property
    def rotation_xyzw(self) -> AnyArray:
        """Return (4,) the quaternion."""
        ...

    @property
    def size(self) -> AnyArray:
        """Return (3,) the extents."""
        ...


def affine(pose: Pose, model: GenericModel) -> tuple[Float64Array, Float64Array]:
    """Return (A (3, 3), t (3,)): world = A x + t for points x of the generic model."""
    T_world_model = matrix_from_pose(pose.translation, pose.rotation_xyzw)
    scale = np.asarray(pose.size, np.float64) / np.maximum(model.extents, 1e-9)
    return T_world_model[:3, :3] * scale, T_world_model[:3, 3]


def world_mesh(pose: Pose, model: GenericModel) -> tuple[Float64Array, Int32Array]:
    """Return (vertices (V, 3) float64 world, faces) of the model as posed and sized."""
    A, t = affine(pose, model)
    return model.vertices @ A.T + t, model.faces


@per_model
def hull(model: GenericModel) -> Float64Array:
    """Return (n, 3) the vertices of the model's convex hull."""
    try:
        return model.vertices[ConvexHull(model.vertices).vertices]
    except (QhullError, ValueError):  # a flat model
        return model.vertices


def diameter(pose: Pose, model: GenericModel) -> float:
    """Return the largest distance, metres, between two points of the model at this size."""
    points = hull(model) * (np.asarray(pose.size) / np.maximum(model.extents, 1e-9))
    return float(pdist(points).max())


def _symmetries(est: Pose, true: Pose, model: GenericModel) -> Float64Array:
    """Return the (n, 3, 3) symmetries to try; for a ball the one that maps true onto est."""
    if is_ball(model.symmetry):
        R_est = matrix_from_pose(est.translation, est.rotation_xyzw)[:3, :3]
        R_true = matrix_from_pose(true.translation, true.rotation_xyzw)[:3, :3]
        return (R_true.T @ R_est)[None]
    return symmetry_rotations(model.symmetry)


def mssd(est: Pose, true: Pose, model: GenericModel) -> float:
    """
    Return the Maximum Symmetry-Aware Surface Distance, metres.

    min over symmetries S of max over model points x of |est(x) - true(S x)|. The distance is
    convex in x, so the vertices of the convex hull suffice.
    """
    points = hull(model)
    (A_est, t_est), (A_true, t_true) = affine(est, model), affine(true, model)
    M = A_est - A_true @ _symmetries(est, true, model)
    gap = np.einsum('nij,pj->npi', M, points) + (t_est - t_true)
    return float(np.sqrt((gap ** 2).sum(-1).max(1).min()))


def mspd(est: Pose, true: Pose, model: GenericModel, camera: Camera) -> float:
    """
    Return the Maximum Symmetry-Aware Projection Distance in a rectified camera, pixels.

    Models of more than MAX_MSPD_POINTS vertices are thinned evenly. Infinite where a point of
    either lies behind the camera.
    """
    step = -(-len(model.vertices) // MAX_MSPD_POINTS)
    points = np.concatenate([hull(model), model.vertices[::step]])
    R, t = camera.T_world_camera[:3, :3], camera.T_world_camera[:3, 3]
    (A_est, t_est), (A_true, t_true) = affine(est, model), affine(true, model)

    def pixels(A: Float64Array, shift: Float64Array) -> Float64Array:
        """Return (..., 2) pixel coordinates, NaN where a point lies behind the camera."""
        in_camera = (points @ A.swapaxes(-1, -2) + shift - t) @ R
        z = in_camera[..., 2:]
        if (z <= 0).any():
            return np.full(in_camera.shape[:-1] + (2,), np.nan)
        return in_camera[..., :2] / z * [camera.K[0, 0], camera.K[1, 1]]

    gap = pixels(A_est, t_est) - pixels(A_true @ _symmetries(est, true, model), t_true)
    if np.isnan(gap).any():
        return float('inf')
    return float(np.sqrt((gap ** 2).sum(-1).max(1).min()))


def _distance(depth: Float32Array, camera: Camera) -> Float64Array:
    """Return the (H, W) distances from the camera centre for depths along its axis."""
    u, v = np.meshgrid(np.arange(depth.shape[1]), np.arange(depth.shape[0]))
    x, y = (u - camera.K[0, 2]) / camera.K[0, 0], (v - camera.K[1, 2]) / camera.K[1, 1]
    return depth * np.sqrt(x * x + y * y + 1)


def vsd(est: Pose, true: Pose, model: GenericModel, view: RectifiedView | ObservedView,
        taus: Sequence[float] | Float64Array, delta: float = VSD_DELTA_M) -> Float64Array:
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
