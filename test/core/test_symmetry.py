# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Symmetry groups and the rotation error over them."""

from types import SimpleNamespace

from hooc_perception.core.symmetry import (
    half_turns,
    is_ball,
    is_half_turned,
    rotation_error,
    symmetry_rotations,
)
from hooc_perception.core.types import Candidates
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


@pytest.mark.parametrize('orders, size', [
    ((1, 1, 1), 1), ((1, 1, 2), 2), ((2, 2, 2), 4), ((1, 1, 3), 3), ((2, 2, 4), 8),
    ((4, 4, 4), 24), ((2, 2, 6), 12)])
def test_finite_groups_have_their_known_size(orders, size):
    group = symmetry_rotations(orders)
    assert len(group) == size
    np.testing.assert_allclose(group[0], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(group), 1)


def test_box_group_maps_the_box_onto_itself():
    corners = np.array([[x, y, z] for x in (-3, 3) for y in (-2, 2) for z in (-1, 1.0)])
    for R in symmetry_rotations((2, 2, 2)):
        turned = corners @ R.T
        gap = np.linalg.norm(turned[:, None] - corners[None], axis=-1).min(1)
        assert gap.max() < 1e-9


def test_orders_without_a_finite_group_still_count_axis_by_axis():
    group = symmetry_rotations((6, 4, 1))
    assert len(group) == 1 + 5 + 3


def test_continuous_axis_with_flips_has_twice_the_steps():
    assert len(symmetry_rotations((2, 2, 0))) == 2 * len(symmetry_rotations((1, 1, 0)))


@pytest.mark.parametrize('orders', [(1, 1, 1), (2, 2, 2), (2, 2, 4), (1, 3, 1), (4, 4, 4)])
def test_rotation_error_is_the_least_over_the_group(orders):
    rng = np.random.default_rng(5)
    for R_est, R_true in zip(Rotation.random(20, rng), Rotation.random(20, rng)):
        expected = min((R_est.inv() * R_true * Rotation.from_matrix(S)).magnitude()
                       for S in symmetry_rotations(orders))
        assert rotation_error(R_est.as_matrix(), R_true.as_matrix(), orders) == pytest.approx(
            expected, abs=1e-6)


def test_turn_about_a_continuous_axis_costs_nothing_and_a_tilt_costs_itself():
    R = Rotation.random(None, np.random.default_rng(1))
    turned = R * Rotation.from_euler('z', 1.234)
    tilted = turned * Rotation.from_euler('x', 0.3)
    upside = R * Rotation.from_euler('x', np.pi)
    assert rotation_error(turned.as_matrix(), R.as_matrix(), (1, 1, 0)) == pytest.approx(
        0, abs=1e-6)
    assert rotation_error(tilted.as_matrix(), R.as_matrix(), (1, 1, 0)) == pytest.approx(0.3)
    assert rotation_error(upside.as_matrix(), R.as_matrix(), (1, 1, 0)) == pytest.approx(np.pi)
    assert rotation_error(upside.as_matrix(), R.as_matrix(), (2, 2, 0)) == pytest.approx(
        0, abs=1e-6)


def test_ball_has_no_rotation_error():
    R_est, R_true = Rotation.random(2, np.random.default_rng(2)).as_matrix()
    assert is_ball((0, 0, 0)) and not is_ball((1, 1, 0))
    assert rotation_error(R_est, R_true, (0, 0, 0)) == 0
    assert rotation_error(R_est, R_true, (1, 1, 1)) > 0.1


def test_half_turns_are_those_that_a_symmetry_does_not_hide():
    cup = SimpleNamespace(symmetry=np.array([1, 1, 0]))         # continuous about z
    spoon = SimpleNamespace(symmetry=np.array([1, 1, 1]))
    box = SimpleNamespace(symmetry=np.array([2, 2, 2]))
    q = Rotation.from_euler('xyz', [[0.3, 0.2, 0.1], [1.0, 0.5, 2.0], [0.1, 0.7, 0.3]]).as_quat()
    objects = Candidates(np.array([1, 2, 3], np.uint8), np.eye(3), q, np.ones((3, 3)),
                         np.array([.1, .2, .3], np.float32))
    # Families of one member each.
    models = tuple(SimpleNamespace(members=(shape,)) for shape in (cup, spoon, box))
    turned, rows = half_turns(objects, models)
    assert rows.tolist() == [0, 0, 1, 1, 1] and turned.category.tolist() == [1, 1, 2, 2, 2]
    np.testing.assert_array_equal(turned.translation, objects.translation[rows])
    apart = (Rotation.from_quat(turned.rotation_xyzw) * Rotation.from_quat(q[rows]).inv())
    np.testing.assert_allclose(apart.magnitude(), np.pi, atol=1e-6)
    none, rows = half_turns(objects.take(np.array([2])), models)
    assert len(none) == 0 and rows.shape == (0,) and none.rotation_xyzw.shape == (0, 4)


@pytest.mark.parametrize('degrees, turned', [
    ((0, 0, 180), True), ((180, 0, 0), True), ((20, 0, 180), True), ((0, 0, 100), False),
    ((0, 0, 89), False), ((0, 0, 0), False), ((40, 0, 180), False)])
def test_the_wrong_way_round_is_about_half_a_turn_off(degrees, turned):
    R_true = Rotation.from_quat(np.random.default_rng(3).normal(size=4)).as_matrix()
    R_est = R_true @ Rotation.from_euler('xyz', degrees, degrees=True).as_matrix()
    assert is_half_turned(R_est, R_true) == turned


def test_half_a_turn_that_a_symmetry_hides_is_not_the_wrong_way_round():
    R_true = Rotation.from_quat(np.random.default_rng(4).normal(size=4)).as_matrix()
    about_z, about_x = (R_true @ Rotation.from_rotvec(np.pi * np.eye(3)[axis]).as_matrix()
                        for axis in (2, 0))
    assert not is_half_turned(about_z, R_true, (1, 1, 2))
    assert is_half_turned(about_x, R_true, (1, 1, 2))
    assert not is_half_turned(about_z, R_true, (1, 1, 0))
    # A bottle upside down; a ball has no such thing.
    assert is_half_turned(about_x, R_true, (1, 1, 0))
    assert not is_half_turned(about_x, R_true, (0, 0, 0))
