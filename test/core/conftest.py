# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Small rendered scenes for the tests of classification."""

from types import SimpleNamespace

from hooc_perception.core.observe import observe
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, RectifiedView
import numpy as np
import pytest

BOX_FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                      [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], np.int32)


def box(centre, size):
    """Return (vertices (8, 3), faces) of an upright box."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    return np.asarray(centre) + 0.5 * corners * size, BOX_FACES


def table():
    """Return a mesh of the table top, in tiles so that none reaches behind a camera."""
    edge = np.linspace(-0.6, 0.6, 7)
    vertices, faces = [], []
    for x0, x1 in zip(edge[:-1], edge[1:]):
        for y0, y1 in zip(edge[:-1], edge[1:]):
            n = len(vertices)
            vertices += [[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]]
            faces += [[n, n + 1, n + 2], [n, n + 2, n + 3]]
    return np.array(vertices, float), np.array(faces, np.int32)


def camera(name, azimuth, distance=1.0, elevation=0.7, width=160, height=130, focal=150.0):
    """Return a camera that looks at the origin."""
    position = distance * np.array([np.cos(azimuth) * np.cos(elevation),
                                    np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    z = -position / distance
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    T[:3, 3] = position
    K = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
    return Camera(name, width, height, K, np.zeros(5), T)


def rig(n=3, start=0.3):
    """Return n cameras around the table."""
    return tuple(camera(f'camera{i}', start + 2 * np.pi * i / n) for i in range(n))


def views_of(meshes, cameras):
    """Return (RectifiedView tuple, ids tuple) of noise-free depth; id -1 is the table."""
    views, ids = [], []
    for c in cameras:
        depth, index = render_depth([*meshes, table()], c)
        views.append(RectifiedView(c, np.where(np.isfinite(depth), depth, np.nan)))
        ids.append(np.where(index == len(meshes), -1, index))
    return tuple(views), tuple(ids)


def observed(meshes, cameras=None):
    """Return the Observation of meshes on the table."""
    return observe(views_of(meshes, cameras or rig())[0])


@pytest.fixture(scope='session')
def small():
    """Return the functions above: importlib mode lets test modules share nothing else."""
    return SimpleNamespace(box=box, rig=rig, views_of=views_of, observed=observed)
