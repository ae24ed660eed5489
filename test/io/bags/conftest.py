# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A small sound bag, and its messages, from which tests make bags of other kinds."""

from types import SimpleNamespace

from hooc_perception.core.geometry import rays
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.io.bags.files import iter_messages
from hooc_perception.io.bags.writer import write_bag
import numpy as np
import pytest
import trimesh


def camera_above(name, azimuth):
    """Return a Camera one metre away that looks down at the origin from `azimuth` (rad)."""
    eye = np.array([0.8 * np.cos(azimuth), 0.8 * np.sin(azimuth), 0.8])
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    T_world_camera = np.eye(4)
    T_world_camera[:3] = np.column_stack([right, np.cross(forward, right), forward, eye])
    K = np.array([[180, 0, 79.5], [0, 180, 59.5], [0, 0, 1.0]])
    return Camera(name, 160, 120, K, np.zeros(5), T_world_camera)


def depth_of(camera):
    """Return the (H, W) depth of a table with a box on it."""
    box = trimesh.creation.box((0.2, 0.15, 0.2))
    depth = render_depth([(box.vertices + [0, 0, 0.1], box.faces.astype(np.int32))], camera)[0]
    T = camera.T_world_camera
    table = -T[2, 3] / (rays(camera.K, camera.height, camera.width) @ T[2, :3])
    return np.where(table > 0, np.minimum(depth, table), np.nan).astype(np.float32)


@pytest.fixture(scope='session')
def sound_bag(tmp_path_factory):
    """Return the path of a bag that nothing is wrong with: two cameras, two frame sets."""
    cameras = tuple(camera_above(f'camera{i}', i * 2.1) for i in range(2))
    scene = SimpleNamespace(
        name='sound', cameras=cameras, truth=None, world={}, depth_units=(0.001,) * 2,
        labels=lambda: None, depth=lambda: tuple(DepthView(c, depth_of(c)) for c in cameras))
    scene_set = SimpleNamespace(name='test', world_frame='table', category_names=('box',),
                                max_instances=1)
    return write_bag(scene, scene_set, tmp_path_factory.mktemp('bags'), repeat=2)


@pytest.fixture(scope='session')
def sound_messages(sound_bag):
    """Return [(topic, type, time in ns, CDR)] of the sound bag."""
    return [(m.topic.name, m.topic.type_name, m.time_ns, m.data) for m in iter_messages(sound_bag)]
