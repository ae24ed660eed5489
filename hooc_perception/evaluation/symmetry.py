# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Rotations that leave a generic model as it is, from the axis orders of GenericModel."""

import functools

import numpy as np
from scipy.spatial.transform import Rotation

# A full turn in this many steps moves no point of a model by more than 0.01 of its diameter
# from the next step's: what BOP takes for a continuous symmetry (max_sym_disc_step).
CONTINUOUS_STEPS = 315
MAX_GROUP = 240


def _about(axis, angles):
    """Return (n, 3, 3) rotations by `angles` (n,) radians about model axis 0, 1 or 2."""
    vectors = np.zeros((len(angles), 3))
    vectors[:, axis] = angles
    return Rotation.from_rotvec(vectors).as_matrix()


def _closure(generators):
    """Return (n, 3, 3), the group that rotations generate, identity first; None if too large."""
    group = [np.eye(3)]
    fresh = list(group)
    while fresh:
        grown = []
        for element in fresh:
            for generator in generators:
                product = generator @ element
                if not any(np.abs(product - known).max() < 1e-6 for known in group):
                    group.append(product)
                    grown.append(product)
        if len(group) > MAX_GROUP:
            return None
        fresh = grown
    return np.array(group)


@functools.lru_cache(maxsize=256)
def _rotations(orders):
    continuous = [axis for axis in range(3) if orders[axis] == 0]
    if len(continuous) > 1:
        return _closure([_about(a, [np.pi / 2])[0] for a in range(3)])
    finite = [_about(axis, [2 * np.pi / orders[axis]])[0]
              for axis in range(3) if orders[axis] > 1]
    group = _closure(finite)
    if group is None:
        # Orders about two axes that no finite group has, measured on a rough mesh: each axis
        # for itself.
        group = np.concatenate([np.eye(3)[None], *(
            _about(axis, np.arange(1, orders[axis]) * 2 * np.pi / orders[axis])
            for axis in range(3) if orders[axis] > 1)])
    if not continuous:
        return group
    turns = _about(continuous[0], np.arange(CONTINUOUS_STEPS) * 2 * np.pi / CONTINUOUS_STEPS)
    flips = [f for f in group if f[continuous[0], continuous[0]] < -0.5][:1]
    return np.concatenate([turns, *[turns @ flip for flip in flips]])


def symmetry_rotations(symmetry):
    """
    Return (n, 3, 3) float64 rotations of the model onto itself, identity first.

    :param symmetry: (3,) integers as in GenericModel.symmetry: the order about each model
        axis, 1 none, 0 continuous. A continuous axis comes in CONTINUOUS_STEPS turns (BOP's
        discretisation); two of them mean a ball, for which only the 24 rotations of the cube
        are listed: use `is_ball` to treat it apart.
    """
    return _rotations(tuple(int(order) for order in symmetry))


def is_ball(symmetry):
    """Return whether every rotation leaves the model as it is."""
    return int(np.sum(np.asarray(symmetry) == 0)) > 1


def rotation_error(R_est, R_true, symmetry=(1, 1, 1)):
    """
    Return the least angle, radians, from R_true to R_est over the model's symmetries.

    A continuous axis is handled exactly: what remains is the angle between the axes.

    :param R_est: (3, 3) model to world, as `R_true`.
    :param symmetry: (3,) as in GenericModel.symmetry.
    """
    if is_ball(symmetry):
        return 0.0
    symmetry = np.asarray(symmetry)
    continuous = np.flatnonzero(symmetry == 0)
    if len(continuous):
        axis = int(continuous[0])
        cosine = float(np.dot(R_est[:, axis], R_true[:, axis]))
        if np.any(np.delete(symmetry, axis) % 2 == 0):
            cosine = abs(cosine)
        return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
    relative = np.einsum('ji,njk->nik', R_est, R_true @ symmetry_rotations(symmetry))
    trace = np.trace(relative, axis1=1, axis2=2)
    return float(np.arccos(np.clip((trace.max() - 1) / 2, -1.0, 1.0)))
