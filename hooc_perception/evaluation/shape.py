# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How far size and surface of the localized objects are from the truth."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.core.geometry import matrix_from_pose, stage_rng
from hooc_perception.core.memo import per_model
from hooc_perception.core.symmetry import nearest_equivalent
from hooc_perception.core.types import GenericModel
from hooc_perception.evaluation.errors import affine, Pose
from hooc_perception.evaluation.matching import PosedObject
from hooc_perception.evaluation.scores import SceneScore
import numpy as np
from scipy.spatial import KDTree
import trimesh

# Points on a surface; so many of them look for the nearest point of the other surface.
SAMPLES = 4000
QUERIES = 1000
# The nearest point is looked for on the triangles of so many nearest samples.
NEIGHBOURS = 4
# Sizes below count as this much, so that a flat object has a ratio.
LEAST_M = 1e-6


@dataclass(frozen=True)
class ShapeError:
    """
    Errors of size and surface of one localized object.

    :ivar truth: index of the true object in its scene.
    :ivar longest_log: natural logarithm of estimated over true longest side.
    :ivar axes_log: (x, y, z) the same for each axis of the model, up to its symmetry.
    :ivar surface_m: `surface_distance` to the truth.
    """

    category: str
    truth: int
    longest_log: float
    axes_log: tuple[float, float, float]
    surface_m: float


def shape_errors(score: SceneScore, estimates: Sequence[PosedObject],
                 truths: Sequence[PosedObject],
                 models: Mapping[str, GenericModel]) -> list[ShapeError]:
    """Return the ShapeErrors of the localized objects of a scene, in the order of `truths`."""
    out = []
    for o in score.objects:
        if o.localized and o.estimate is not None:
            est, true, model = estimates[o.estimate], truths[o.truth], models[o.category]
            longest, axes = size_logs(est, true, model)
            out.append(ShapeError(o.category, o.truth, longest, axes,
                                  surface_distance(est, true, model)))
    return out


def size_logs(est: Pose, true: Pose,
              model: GenericModel) -> tuple[float, tuple[float, float, float]]:
    """
    Return (longest_log, axes_log) as in ShapeError.

    Where a symmetry of the model exchanges two axes, those of the truth are exchanged if that
    turns it nearer to the estimate.
    """
    R_est, R_true = (matrix_from_pose(p.translation, p.rotation_xyzw)[:3, :3]
                     for p in (est, true))
    extents = np.maximum(model.extents, 1e-9)
    true_size = extents * nearest_equivalent(R_true, np.asarray(true.size) / extents,
                                             model.symmetry, R_est)[1]
    est_size, true_size = (np.maximum(size, LEAST_M) for size in (est.size, true_size))
    x, y, z = np.log(est_size / true_size).tolist()
    return float(np.log(est_size.max() / true_size.max())), (x, y, z)


@per_model
def _samples(model: GenericModel) -> tuple[Float64Array, Int64Array]:
    """Return (points (n, 3), faces (n,)), uniform on the surface of the generic model."""
    mesh = trimesh.Trimesh(model.vertices, model.faces, process=False)
    points, faces = trimesh.sample.sample_surface(mesh, SAMPLES, seed=stage_rng(0, 'surface'))[:2]
    return np.asarray(points, np.float64), np.asarray(faces, np.int64)


def _areas(corners: Float64Array) -> Float64Array:
    """Return the (n,) areas of triangles (n, 3, 3)."""
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0],
                                         corners[:, 2] - corners[:, 0]), axis=1)


def _placed(pose: Pose, model: GenericModel) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return the model's samples in the world: points, their triangles, weights by area."""
    points, faces = _samples(model)
    A, t = affine(pose, model)
    corners = model.vertices[model.faces[faces]]
    in_world = corners @ A.T + t
    return points @ A.T + t, in_world, _areas(in_world) / _areas(corners)


def surface_distance(est: Pose, true: Pose, model: GenericModel) -> float:
    """
    Return the mean distance, metres, between the surfaces of two placements of a generic model.

    The mean over either surface of the distance to the nearest point of the other, averaged
    over both directions. Nothing is matched to its own copy, so symmetries need no care.
    """
    a, b = _placed(est, model), _placed(true, model)
    return 0.5 * (_mean_gap(a, b) + _mean_gap(b, a))


def _mean_gap(one: tuple[Float64Array, ...], other: tuple[Float64Array, ...]) -> float:
    """Return the mean distance from the points of one `_placed` to the triangles of another."""
    points, weights = one[0][:QUERIES], one[2][:QUERIES]
    to_samples, near = KDTree(other[0]).query(points, NEIGHBOURS)
    corners = other[1][near].reshape(-1, 3, 3)
    queries = np.repeat(points, NEIGHBOURS, axis=0)
    closest = trimesh.triangles.closest_point(corners, queries)
    to_triangles = np.linalg.norm(closest - queries, axis=1).reshape(near.shape)
    # A sample lies on its triangle: where that is too thin to compute with, the sample counts.
    return float(np.average(np.fmin(to_triangles, to_samples).min(1), weights=weights))


def shape_summary(errors: Iterable[ShapeError]) -> dict[str, Any]:
    """
    Return {objects, longest_log, axes_log, surface_m}: a count and means over objects.

    Of the logarithms the absolute value counts; axes_log holds x, y and z. NaN without objects.
    """
    errors = tuple(errors)
    table = np.array([(abs(e.longest_log), *np.abs(e.axes_log), e.surface_m) for e in errors],
                     np.float64).reshape(-1, 5)
    longest, x, y, z, surface = (table.mean(0) if errors else np.full(5, np.nan)).tolist()
    return {'objects': len(errors), 'longest_log': longest, 'axes_log': [x, y, z],
            'surface_m': surface}
