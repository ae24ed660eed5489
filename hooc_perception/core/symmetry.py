# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Rotations that leave a generic model as it is, from the axis orders of GenericModel."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
import functools

from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

# A full turn in this many steps moves no point of a model by more than 0.01 of its diameter
# from the next step's: what BOP takes for a continuous symmetry (max_sym_disc_step).
CONTINUOUS_STEPS = 315
MAX_GROUP = 240
# Two sides are as good as equally scaled where they differ by less than this share: a turn
# then moves no surface by more than half of it times the radius.
SAME_SCALE = 0.1
# An estimate is the wrong way round if half a turn brings it this close to the truth.
HALF_TURN_SLACK_RAD = np.pi / 6
# A trace (1 + 2 cos) has to grow by more for a turn to count: a microradian, which is more than
# what handing a rotation on as a quaternion does to it.
MARGIN = 1e-12


def _about(axis: int, angles: npt.ArrayLike) -> Float64Array:
    """Return (n, 3, 3) rotations by `angles` (n,) radians about model axis 0, 1 or 2."""
    angles = np.asarray(angles, np.float64)
    vectors = np.zeros((len(angles), 3))
    vectors[:, axis] = angles
    return Rotation.from_rotvec(vectors).as_matrix()


def _closure(generators: Sequence[Float64Array]) -> Float64Array | None:
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
def _rotations(orders: tuple[int, ...]) -> Float64Array:
    continuous = [axis for axis in range(3) if orders[axis] == 0]
    if len(continuous) > 1:
        cube = _closure([_about(a, [np.pi / 2])[0] for a in range(3)])
        assert cube is not None     # 24 rotations
        return cube
    group = _finite(orders)
    if not continuous:
        return group
    turns = _about(continuous[0], np.arange(CONTINUOUS_STEPS) * 2 * np.pi / CONTINUOUS_STEPS)
    flips = [f for f in group if f[continuous[0], continuous[0]] < -0.5][:1]
    return np.concatenate([turns, *[turns @ flip for flip in flips]])


def _finite(orders: tuple[int, ...]) -> Float64Array:
    """Return (n, 3, 3), the group of the axes of finite order."""
    group = _closure([_about(axis, [2 * np.pi / orders[axis]])[0]
                      for axis in range(3) if orders[axis] > 1])
    if group is not None:
        return group
    # Orders about two axes that no finite group has, measured on a rough mesh: each axis
    # for itself.
    return np.concatenate([np.eye(3)[None], *(
        _about(axis, np.arange(1, orders[axis]) * 2 * np.pi / orders[axis])
        for axis in range(3) if orders[axis] > 1)])


def symmetry_rotations(symmetry: Sequence[int] | np.ndarray) -> Float64Array:
    """
    Return (n, 3, 3) float64 rotations of the model onto itself, identity first.

    :param symmetry: (3,) integers as in GenericModel.symmetry: the order about each model
        axis, 1 none, 0 continuous. A continuous axis comes in CONTINUOUS_STEPS turns (BOP's
        discretisation); two of them mean a ball, for which only the 24 rotations of the cube
        are listed: use `is_ball` to treat it apart.
    """
    return _rotations(tuple(int(order) for order in symmetry))


def is_ball(symmetry: npt.ArrayLike) -> bool:
    """Return whether every rotation leaves the model as it is."""
    return int(np.sum(np.asarray(symmetry) == 0)) > 1


def rotation_error(R_est: Float64Array, R_true: Float64Array,
                   symmetry: Sequence[int] | np.ndarray = (1, 1, 1)) -> float:
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


def is_half_turned(R_est: Float64Array, R_true: Float64Array,
                   symmetry: Sequence[int] | np.ndarray = (1, 1, 1)) -> bool:
    """
    Return whether an estimate lies the wrong way round: end for end, or upside down.

    It is off by more than a right angle, and half a turn about one axis of the model brings it
    within HALF_TURN_SLACK_RAD of the truth.

    :param R_est: (3, 3) model to world, as `R_true`.
    :param symmetry: (3,) as in GenericModel.symmetry; what looks the same is not turned.
    """
    if rotation_error(R_est, R_true, symmetry) <= np.pi / 2:
        return False
    return any(rotation_error(R_est @ _about(axis, [np.pi])[0], R_true, symmetry)
               < HALF_TURN_SLACK_RAD for axis in range(3))


def half_turns(objects: Candidates, models: Sequence[GenericModel],
               ) -> tuple[Candidates, Int64Array]:
    """
    Return (Candidates, rows): objects turned by half a turn about each axis of their models.

    Axes about which that is a symmetry are left out.

    :param models: tuple of GenericModel; class id c is models[c - 1].
    :return: the turned objects, and the row (n,) int64 of `objects` that each comes from.
    """
    rows, turned = [], []
    shapes = objects.shapes(models)
    for i, rotation in enumerate(Rotation.from_quat(objects.rotation_xyzw)):
        symmetry = np.asarray(shapes[i].symmetry)
        if is_ball(symmetry):
            continue
        for axis in np.flatnonzero(symmetry % 2 == 1):
            rows.append(i)
            turned.append((rotation * Rotation.from_rotvec(np.pi * np.eye(3)[axis])).as_quat())
    rows = np.array(rows, np.int64)
    return replace(objects.take(rows), rotation_xyzw=np.array(turned).reshape(-1, 4)), rows


def nearest_equivalent(R: Float64Array, scale: npt.ArrayLike,
                       symmetry: Sequence[int] | np.ndarray,
                       R_reference: Float64Array | None = None,
                       ) -> tuple[Float64Array, Float64Array]:
    """
    Return (R', scale') that pose the model alike and are turned least from a reference.

    A scaled model has fewer symmetries than its generic one: a bowl that is longer than wide is
    only the same after half a turn. Where a quarter turn exchanges two sides, their scales
    change places with them.

    :param R: (3, 3) model to world.
    :param scale: (3,) size relative to the generic model, along the model's axes.
    :param symmetry: (3,) as in GenericModel.symmetry.
    :param R_reference: (3, 3), None = the world's axes.
    :return: R and scale themselves, to the last bit, where no other pose is nearer.
    """
    scale = np.asarray(scale, np.float64)
    M = R if R_reference is None else R_reference.T @ R
    best, nearness = None, np.trace(M) + MARGIN
    for S in _turns(M, scale, tuple(int(order) for order in symmetry)):
        trace = np.trace(M @ S)
        if trace > nearness:
            best, nearness = S, trace + MARGIN
    if best is None:
        return R, scale
    return R @ best, np.einsum('ji,j,ji->i', best, scale, best)


def canonical_objects(objects: Candidates, models: Sequence[GenericModel],
                      references: Sequence[Float64Array | None] | None = None) -> Candidates:
    """
    Return Candidates that look the same, each turned least from a reference.

    Of all orientations that a symmetric model cannot tell apart, this picks one; see
    `nearest_equivalent`. What needs no turn keeps its numbers to the last bit.

    :param models: tuple of GenericModel; class id c is models[c - 1].
    :param references: one (3, 3) or None an object; None = the world's axes for all.
    """
    rotation, size = objects.rotation_xyzw.copy(), objects.size.copy()
    for i, model in enumerate(objects.shapes(models)):
        R = Rotation.from_quat(rotation[i]).as_matrix()
        extents = np.maximum(model.extents, 1e-9)
        turned, scale = nearest_equivalent(R, size[i] / extents, model.symmetry,
                                           None if references is None else references[i])
        if turned is not R:
            rotation[i] = Rotation.from_matrix(turned).as_quat(canonical=True)
            size[i] = scale * extents
    return replace(objects, rotation_xyzw=rotation, size=size)


def _turns(M: Float64Array, scale: Float64Array, orders: tuple[int, ...],
           ) -> Iterator[Float64Array]:
    """
    Yield the symmetries of a scaled model among which the one nearest to a reference is.

    :param M: (3, 3) rotation from the model to the reference.
    """
    continuous = [axis for axis in range(3) if orders[axis] == 0]
    if len(continuous) > 1:
        if _alike(scale):
            yield M.T
            return
        # An ellipsoid: quarter turns exchange its sides.
        orders, continuous = (4, 4, 4), []
    if not continuous:
        yield from (S for S in _rotations(orders) if _fits(S, scale))
        return
    axis = continuous[0]
    a, b = (axis + 1) % 3, (axis + 2) % 3
    for flip in (f for f in _finite(tuple(n or 1 for n in orders)) if _fits(f, scale)):
        if _alike(np.delete(scale, axis)):
            # The turn about the axis that brings M @ turn @ flip nearest to the identity: the
            # trace is A cos + B sin + C.
            N = flip @ M
            angle = np.arctan2(N[a, b] - N[b, a], N[a, a] + N[b, b])
            yield _about(axis, [angle])[0] @ flip
        else:
            yield from (turn @ flip for turn in _about(axis, np.arange(4) * np.pi / 2))


def _alike(scale: Float64Array) -> bool:
    """Return whether scales differ by no more than SAME_SCALE."""
    return bool(scale.max() - scale.min() <= SAME_SCALE * scale.max())


def _fits(S: Float64Array, scale: Float64Array) -> bool:
    """Return whether a scaled model still is the same after the turn S of the generic one."""
    turned = S.T @ np.diag(scale) @ S
    off = np.abs(turned - np.diag(np.diag(turned)))
    return bool(off.max() <= 0.5 * SAME_SCALE * scale.max())
