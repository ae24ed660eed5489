# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Smooth patches against a plain flood fill, and on shapes whose faces are known."""

from types import SimpleNamespace

from hooc_perception.core.frame.patches import smooth_patches
import numpy as np
import pytest


def flooded(points, normals, radius, cosine, step):
    """Return labels by visiting neighbours one by one."""
    labels, fresh = np.full(len(points), -1), 0
    for seed in range(len(points)):
        if labels[seed] >= 0:
            continue
        labels[seed], queue = fresh, [seed]
        while queue:
            a = queue.pop()
            d = points - points[a]
            joined = ((np.linalg.norm(d, axis=1) <= radius) & (normals @ normals[a] > cosine)
                      & (np.abs(d @ normals[a]) + np.abs((d * normals).sum(1)) < step)
                      & (labels < 0))
            labels[joined] = fresh
            queue += np.flatnonzero(joined).tolist()
        fresh += 1
    return labels


def same_parts(a, b):
    """Return whether two labellings split things alike."""
    pairs = {*zip(a.tolist(), b.tolist())}
    return len(pairs) == len({*a.tolist()}) == len({*b.tolist()})


@pytest.mark.parametrize('limits', [(0.009, 0.94, 0.006), (0.015, 0.8, 0.004), (0.006, 0.6, 0.02)])
def test_patches_are_those_of_a_flood_fill(limits):
    rng = np.random.default_rng(2)
    points = rng.uniform(0, 0.06, (400, 3)) * [1, 1, 0.3]
    normals = rng.normal([0, 0, 2.0], 0.5, (400, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    labels = smooth_patches(SimpleNamespace(points=points, normals=normals), *limits)
    assert 3 < labels.max() < 390, 'all alike, or all different'
    assert same_parts(labels, flooded(points, normals, *limits))


def grid(u, v, normal, spacing=0.004, n=12):
    """Return (points, normals) of a square of points spanned by two axes."""
    i, j = np.meshgrid(np.arange(n) + 1, np.arange(n) + 1)
    points = spacing * (i.reshape(-1, 1) * np.array(u) + j.reshape(-1, 1) * np.array(v))
    return points, np.tile(np.array(normal, float), (len(points), 1))


def test_faces_of_an_edge_are_parted_and_each_is_whole():
    floor, wall = grid([1, 0, 0], [0, 1, 0], [0, 0, 1]), grid([0, 0, 1], [0, 1, 0], [1, 0, 0])
    points, normals = (np.concatenate(x) for x in zip(floor, wall))
    labels = smooth_patches(SimpleNamespace(points=points, normals=normals))
    assert same_parts(labels, np.repeat([0, 1], len(floor[0])))


def test_sheets_one_above_the_other_are_parted():
    low, normals = grid([1, 0, 0], [0, 1, 0], [0, 0, 1])
    points, normals = np.concatenate([low, low + [0, 0, 0.008]]), np.tile(normals, (2, 1))
    labels = smooth_patches(SimpleNamespace(points=points, normals=normals))
    assert same_parts(labels, np.repeat([0, 1], len(low)))


def test_a_ball_is_one_patch():
    k = np.arange(2000) + 0.5
    z, angle = 1 - 2 * k / 2000, np.pi * (1 + 5 ** 0.5) * k
    normals = np.column_stack([np.sqrt(1 - z * z) * np.cos(angle),
                               np.sqrt(1 - z * z) * np.sin(angle), z])
    labels = smooth_patches(SimpleNamespace(points=0.04 * normals, normals=normals))
    assert not labels.any()


@pytest.mark.parametrize('n', [0, 1])
def test_hardly_any_points(n):
    cloud = SimpleNamespace(points=np.zeros((n, 3)), normals=np.zeros((n, 3)))
    assert smooth_patches(cloud).tolist() == [0] * n
