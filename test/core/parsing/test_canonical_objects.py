# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Of orientations that look alike, always the same one."""

from hooc_perception.core.symmetry import canonical_objects, nearest_equivalent, symmetry_rotations
from hooc_perception.core.types import Candidates
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

ONE = np.ones(3)


def turns(n, seed=0):
    return Rotation.random(n, np.random.default_rng(seed)).as_matrix()


@pytest.mark.parametrize('orders', [(1, 1, 1), (1, 1, 2), (2, 2, 2), (2, 2, 4), (4, 4, 4),
                                    (2, 2, 6), (1, 3, 1), (0, 2, 2), (1, 1, 0), (0, 0, 0)])
def test_equivalent_orientations_become_one(orders):
    rng = np.random.default_rng(1)
    for R in turns(20):
        expected, _ = nearest_equivalent(R, ONE, orders)
        for _ in range(8):
            group = symmetry_rotations(orders)
            S = group[rng.integers(len(group))]
            if sum(n == 0 for n in orders) > 1:
                S = turns(1, rng.integers(10 ** 6))[0]
            again, scale = nearest_equivalent(R @ S, ONE, orders)
            np.testing.assert_allclose(again, expected, atol=1e-6)
            np.testing.assert_allclose(scale, ONE)


@pytest.mark.parametrize('orders', [(2, 2, 2), (2, 2, 4), (1, 1, 0), (2, 2, 0)])
def test_no_listed_symmetry_is_nearer(orders):
    for R, reference in zip(turns(20, 2), turns(20, 3)):
        best, _ = nearest_equivalent(R, ONE, orders, reference)
        least = Rotation.from_matrix(reference.T @ best).magnitude()
        others = Rotation.from_matrix(reference.T @ R @ symmetry_rotations(orders)).magnitude()
        assert least <= others.min() + 1e-9


def surface(orders):
    """Return points of a prism or cylinder with these symmetries and unit extents."""
    axis = [i for i in range(3) if orders[i] in (0, 4)][0]
    angle = np.arange(400) * 2 * np.pi / 400
    radius = 0.5 if orders[axis] == 0 else 0.5 / np.maximum(abs(np.cos(angle)), abs(np.sin(angle)))
    points = np.zeros((21, 400, 3))
    points[..., axis] = np.linspace(-0.5, 0.5, 21)[:, None]
    points[..., (axis + 1) % 3] = radius * np.cos(angle)
    points[..., (axis + 2) % 3] = radius * np.sin(angle)
    return points.reshape(-1, 3)


SCALES = pytest.mark.parametrize('scale', [(1, 1, 1), (1.3, 0.8, 1.1), (1, 1, 0.7), (0.7, 1, 1),
                                           (1.04, 1, 1.2)])


@pytest.mark.parametrize('orders', [(2, 2, 4), (2, 2, 0), (0, 2, 2)])
@SCALES
def test_the_scaled_surface_stays_where_it_is(orders, scale):
    points = surface(orders)
    for R in turns(10, 4):
        turned, other = nearest_equivalent(R, scale, orders)
        before, after = points * scale @ R.T, points * other @ turned.T
        # Sides that differ by 4 % count as alike: 2 % of half a side, and the sampling.
        assert cKDTree(before).query(after)[0].max() < 0.5 * 0.02 + 0.004


@SCALES
def test_a_stretched_ball_keeps_its_shape(scale):
    for R in turns(10, 5):
        turned, other = nearest_equivalent(R, scale, (0, 0, 0))
        before, after = R * np.square(scale) @ R.T, turned * np.square(other) @ turned.T
        np.testing.assert_allclose(after, before, atol=1e-9)


def test_a_stretched_ball_does_not_flip_where_its_sides_change_places():
    quarter = Rotation.from_euler('xyz', [0.1, -0.1, np.pi / 2 + 0.1]).as_matrix()
    turned, scale = nearest_equivalent(quarter, (1.3, 0.8, 1.1), (0, 0, 0))
    assert Rotation.from_matrix(turned).magnitude() < 0.3
    np.testing.assert_allclose(scale, (0.8, 1.3, 1.1))


def test_a_ball_is_never_turned():
    for R in turns(10, 7):
        turned, scale = nearest_equivalent(R, (1.03, 1, 0.98), (0, 0, 0))
        np.testing.assert_allclose(turned, np.eye(3), atol=1e-12)
        assert 0.98 <= scale.min() <= scale.max() <= 1.03


def test_a_quarter_turn_of_a_long_box_exchanges_its_sides():
    R, scale = Rotation.from_euler('z', 80, degrees=True).as_matrix(), (1.3, 0.8, 1.0)
    turned, other = nearest_equivalent(R, scale, (2, 2, 4))
    np.testing.assert_allclose(turned, Rotation.from_euler('z', -10, degrees=True).as_matrix(),
                               atol=1e-12)
    np.testing.assert_allclose(other, (0.8, 1.3, 1.0))


def test_what_is_canonical_keeps_its_bits(things):
    rng = np.random.default_rng(6)
    n = 60
    category = rng.integers(1, 4, n).astype(np.uint16)
    extents = np.array([things[c - 1].extents for c in category])
    given = Candidates(category, rng.normal(size=(n, 3)),
                       Rotation.random(n, rng).as_quat(),
                       (extents * rng.uniform(0.9, 1.1, (n, 3))).astype(np.float32),
                       np.ones(n, np.float32))
    once = canonical_objects(given, things)
    twice = canonical_objects(once, things)
    assert (once.rotation_xyzw != given.rotation_xyzw).any(1).sum() > n // 2
    assert once.rotation_xyzw.tobytes() == twice.rotation_xyzw.tobytes()
    assert once.size.tobytes() == twice.size.tobytes()
    assert once.translation.tobytes() == given.translation.tobytes()
