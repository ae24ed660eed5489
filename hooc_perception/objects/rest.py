# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stable resting poses of a model, one per distinguishable way of lying."""

from hooc_perception.core.arrays import Float64Array, Int32Array
from hooc_perception.objects.symmetry import equivalent_directions, is_ball
import numpy as np
from scipy.spatial.transform import Rotation
import trimesh

MAX_POSES = 12
# Poses whose up directions differ by less than this are one pose (facets of a curved surface).
MERGE_DEG = 12.0
# People place objects upright more often than they would fall that way.
UPRIGHT_PROBABILITY = 0.1
UPRIGHT_DEG = 2.0
MIN_PROBABILITY = 0.005
UP = np.array([0.0, 0.0, 1.0])


def resting_poses(solid: trimesh.Trimesh,
                  symmetry: Int32Array) -> tuple[Float64Array, Float64Array]:
    """
    Return (rest_rotations (R, 4) xyzw model to world, rest_probability (R,)), likeliest first.

    Quasi-static probabilities on the convex hull (Goldberg et al. 1999, as in trimesh), with the
    volume's centre of mass. Poses that differ by yaw, by a symmetry of the mesh, or by less than
    MERGE_DEG are merged. The model's own upright pose is always included, with
    UPRIGHT_PROBABILITY or more.

    :param solid: watertight.
    :param symmetry: (3,) int32 as in GenericModel.
    """
    if is_ball(symmetry):
        return np.array([[0.0, 0.0, 0.0, 1.0]]), np.ones(1)
    hull = solid.convex_hull
    T_world_model, mass = trimesh.poses.compute_stable_poses(
        hull, center_mass=solid.center_mass, sigma=0.0, n_samples=1, threshold=0.0)
    ups = T_world_model[:, 2, :3]
    directions, probability = _merged(ups, mass, symmetry)
    upright = _angles(UP, directions) <= UPRIGHT_DEG
    if upright.any():
        first = int(np.argmax(upright))
        directions[first] = UP
    else:
        first = len(directions)
        directions, probability = np.vstack([directions, UP]), np.append(probability, 0.0)
    keep = (probability >= MIN_PROBABILITY) | (np.arange(len(probability)) == first)
    others = np.where(keep, probability, 0.0)
    rise = UPRIGHT_PROBABILITY - others[first]
    if rise > 0:
        others *= (1 - UPRIGHT_PROBABILITY) / max(others.sum() - others[first], 1e-12)
        others[first] = UPRIGHT_PROBABILITY
    order = np.argsort(-others, kind='stable')
    order = order[keep[order]]
    if first not in order[:MAX_POSES]:
        order = np.append(order[:MAX_POSES - 1], first)
    order = order[:MAX_POSES]
    probability = others[order]
    return (np.array([_turn_up(d) for d in directions[order]]),
            probability / max(probability.sum(), 1.0))


def _merged(ups: Float64Array, mass: Float64Array,
            symmetry: Int32Array) -> tuple[Float64Array, Float64Array]:
    """Return (directions (n, 3), summed probability (n,)) of clusters of up directions."""
    order = np.argsort(-mass, kind='stable')
    directions, probability, alike = [], [], []
    for up, p in zip(ups[order], mass[order]):
        for i, group in enumerate(alike):
            if _angles(up, group).min() < MERGE_DEG:
                probability[i] += p
                break
        else:
            group = equivalent_directions(up, symmetry)
            # The most upright one represents all poses that look alike.
            directions.append(group[np.argmax(group[:, 2])])
            probability.append(p)
            alike.append(group)
    return np.array(directions), np.array(probability)


def _angles(direction: Float64Array, directions: Float64Array) -> Float64Array:
    """Return the angles (n,) in degrees between a unit vector and unit vectors (n, 3)."""
    return np.degrees(np.arccos(np.clip(directions @ direction, -1.0, 1.0)))


def _turn_up(direction: Float64Array) -> Float64Array:
    """Return the quaternion xyzw of the smallest rotation of a model direction to world up."""
    direction = direction / np.linalg.norm(direction)
    axis = np.cross(direction, UP)
    sine = np.linalg.norm(axis)
    if sine < 1e-9:
        return np.array([0.0, 0.0, 0.0, 1.0] if direction[2] > 0 else [1.0, 0.0, 0.0, 0.0])
    angle = np.arctan2(sine, direction[2])
    return Rotation.from_rotvec(axis / sine * angle).as_quat(canonical=True)
