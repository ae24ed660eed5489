# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The tree of static transforms."""

from types import SimpleNamespace

from hooc_perception.core.geometry import inverse, matrix_from_pose
from hooc_perception.io.bags.frames import FrameTree
import numpy as np
from scipy.spatial.transform import Rotation


def stamped(parent, child, T):
    t, q = T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_quat()
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=parent), child_frame_id=child,
        transform=SimpleNamespace(translation=SimpleNamespace(x=t[0], y=t[1], z=t[2]),
                                  rotation=SimpleNamespace(x=q[0], y=q[1], z=q[2], w=q[3])))


def random_transforms(n):
    rng = np.random.default_rng(0)
    return [matrix_from_pose(rng.normal(size=3), Rotation.random(None, rng).as_quat())
            for _ in range(n)]


def test_siblings_are_connected_through_their_parent():
    T_w_a, T_a_b, T_w_c = random_transforms(3)
    tree = FrameTree()
    for parent, child, T in (('w', 'a', T_w_a), ('a', 'b', T_a_b), ('w', 'c', T_w_c)):
        tree.add(stamped(parent, child, T), '')
    np.testing.assert_allclose(tree.transform('c', 'b'), inverse(T_w_c) @ T_w_a @ T_a_b,
                               atol=1e-12)
    np.testing.assert_allclose(tree.transform('b', 'w'), inverse(T_w_a @ T_a_b), atol=1e-12)
    assert tree.root('b') == 'w'
    assert 'c' in tree and 'w' in tree and 'd' not in tree


def test_the_way_to_the_parent_is_exact():
    T, = random_transforms(1)
    tree = FrameTree()
    tree.add(stamped('table', 'camera', T), '')
    q = Rotation.from_matrix(T[:3, :3]).as_quat()
    np.testing.assert_array_equal(tree.transform('table', 'camera'),
                                  matrix_from_pose(T[:3, 3], q))


def test_strangers_and_circles():
    T, = random_transforms(1)
    tree = FrameTree()
    tree.add(stamped('a', 'b', T), '')
    tree.add(stamped('b', 'a', T), '')
    assert tree.transform('w', 'a') is None
    np.testing.assert_array_equal(tree.transform('x', 'x'), np.eye(4))
