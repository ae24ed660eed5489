# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Training opens nothing of a scene but camera files, whatever the set; audited by Python."""

import json
from pathlib import Path
import shutil
import sys

from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.core.types import Camera
from hooc_perception.io.scenes.nominal_table import nominal_cameras
from hooc_perception.io.scenes.scene_set import (
    load_scene_set,
    NewScene,
    TrueObject,
    write_scene_set,
)
from hooc_perception.synthesis.rigs import look_at
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

K = np.array([[70.0, 0, 39.5], [0, 70, 29.5], [0, 0, 1]])
opened = []
sys.addaudithook(lambda event, args: opened.append(args[0]) if event == 'open' else None)


def looking_at_origin(name, azimuth, elevation=0.7, distance=0.9):
    eye = distance * np.array([np.cos(azimuth) * np.cos(elevation),
                               np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    return Camera(name, 80, 60, K, np.zeros(5), look_at(eye, np.zeros(3)))


def moved(cameras, T):
    return [Camera(c.name, c.width, c.height, c.K, c.D, T @ c.T_world_camera) for c in cameras]


T_ODD = matrix_from_pose([0.3, 2, -0.7], Rotation.from_rotvec([1, 2, 3]).as_quat())


def test_a_ring_of_cameras_stands_around_the_table():
    ring = [looking_at_origin(f'c{i}', 2 * np.pi * i / 3 - np.pi / 2) for i in range(3)]
    for camera, expected in zip(nominal_cameras(moved(ring, T_ODD)), ring):
        np.testing.assert_allclose(camera.T_world_camera, expected.T_world_camera, atol=1e-9)
        np.testing.assert_array_equal(camera.K, expected.K)


@pytest.mark.parametrize('number', [1, 2])
def test_cameras_that_say_little_look_down_on_the_table(number):
    cameras = [Camera(f'c{i}', 80, 60, K, np.zeros(5),
                      matrix_from_pose([0.1 * i, 0, 0], [0, 0, 0, 1])) for i in range(number)]
    posed = nominal_cameras(moved(cameras, T_ODD))
    eye = np.mean([c.T_world_camera[:3, 3] for c in posed], axis=0)
    np.testing.assert_allclose(eye, 0.8 * np.sqrt([0, 0.5, 0.5]) * [1, -1, 1], atol=1e-9)


def files_of(folder, load):
    """Return the files below scenes that `load` opens, relative to the set."""
    del opened[:]
    load()
    seen = {Path(p).resolve() for p in opened if isinstance(p, (str, Path))}
    return sorted(str(p.relative_to(folder)) for p in seen
                  if any(p.is_relative_to(folder / part) for part in ('scenes', 'test')))


@pytest.mark.parametrize('world', ['table', 'unknown'])
@pytest.mark.parametrize('own', [False, True])
def test_of_a_scene_set_only_camera_files_are_opened(tmp_path, world, own):
    cameras = [looking_at_origin('left', 0.3), looking_at_origin('right', 2.4)]
    truth = TrueObject('box', np.zeros(3), np.array([0, 0, 0, 1.0]), np.full(3, 0.1))
    path = write_scene_set(tmp_path / 'set', 's', {'box': trimesh.creation.box((0.1, 0.1, 0.1))},
                           cameras, [NewScene('a', (np.ones((60, 80)),) * 2, (truth,))],
                           world_frame=world)
    if own:
        shutil.move(path / 'cameras.yaml', path / 'scenes' / 'a' / 'cameras.yaml')
    found = []
    names = files_of(path.resolve(), lambda: found.append(load_scene_set(path, False)))
    assert names == (['scenes/a/cameras.yaml'] if own else [])
    assert [c.name for c in found[0].cameras] == ['left', 'right'] and found[0].scenes == ()


@pytest.mark.parametrize('size', [None, (640, 480)])
def test_of_a_bop_dataset_only_its_cameras_are_opened(tmp_path, size):
    path = tmp_path / 'bop'
    folder = path / 'test' / '000002'
    (folder / 'depth').mkdir(parents=True)
    (folder / 'depth' / '000001.png').write_bytes(b'nobody looks')
    (folder / 'scene_gt.json').write_text('nobody looks')
    own = K.copy()
    own[:2] *= size[0] / 80 if size else 1.0
    (folder / 'scene_camera.json').write_text(json.dumps(
        {1: {'cam_K': own.ravel().tolist(), 'depth_scale': 0.1}}))
    (path / 'models').mkdir()
    trimesh.creation.box((100, 60, 40)).export(path / 'models' / 'obj_000001.ply')
    if size:
        (path / 'camera.json').write_text(json.dumps(dict(zip(('width', 'height'), size))))
    found = []
    names = files_of(path.resolve(), lambda: found.append(load_scene_set(path, False)))
    assert names == ['test/000002/scene_camera.json']
    camera, = found[0].cameras
    assert (camera.width, camera.height) == (size or (80, 60))
    assert camera.T_world_camera[2, 3] > 0.5
