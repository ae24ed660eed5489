# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The command writes poses that other commands take, or nothing."""

from dataclasses import replace
from types import SimpleNamespace

from hooc_perception.calibration.recordings import of_set
from hooc_perception.cli.main import main
from hooc_perception.cli.up import camera_poses
from hooc_perception.core.geometry import inverse
from hooc_perception.io.bags.writer import write_bag
from hooc_perception.io.scenes.camera_files import load_cameras
from hooc_perception.io.scenes.scene_set import load_scene_set, NewScene, write_scene_set
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh


@pytest.fixture(scope='module')
def true(tabletop):
    lens = np.array([1e-4, -1e-4, 0, 0, 0])
    return (replace(tabletop.camera('left', 20), D=lens), tabletop.camera('right', 75))


@pytest.fixture(scope='module')
def stated(tabletop, true):
    rng = np.random.default_rng(7)
    return tuple(tabletop.disturbed(camera, rng, 4, 0.04) for camera in true)


def written(folder, tabletop, true, stated, count=7, others=()):
    """Return the path of a scene set; `others` are cameras of further scenes."""
    def scenes():
        for k, views in enumerate(tabletop.scenes(true, stated, (1, 2, 3, 4), count)):
            yield NewScene(f's{k}', tuple(view.depth for view in views))
        for k, cameras in enumerate(others):
            views, = tabletop.scenes(true, cameras, (9,), count)
            yield NewScene(f't{k}', tuple(view.depth for view in views), cameras=cameras)
    return write_scene_set(folder, 'rig', {'box': trimesh.creation.box((0.1, 0.1, 0.1))}, stated,
                           scenes())


def right_in_left(cameras):
    """Return T_left_right (4, 4)."""
    left, right = (np.asarray(camera.T_world_camera) for camera in cameras)
    return inverse(left) @ right


def test_a_scene_set(tabletop, true, stated, tmp_path, capsys):
    path = written(tmp_path / 'set', tabletop, true, stated)
    out, picture = tmp_path / 'new' / 'cameras.yaml', tmp_path / 'new' / 'fused.png'
    assert main(['calibrate', str(path), '--out', str(out), '--picture', str(picture),
                 '--ros']) == 0
    found = load_cameras(out)
    mm, deg = tabletop.pose_error(right_in_left(true), right_in_left(found.values()))
    assert list(found) == ['left', 'right'] and mm < 5 and deg < 0.3
    assert np.array_equal(found['left'].K, true[0].K)
    assert np.array_equal(found['left'].D, true[0].D)
    printed = capsys.readouterr().out
    assert 'left + right' in printed and 'held out' in printed and 'not fitted to' in printed
    assert 'static_transform_publisher --x' in printed
    assert '--frame-id table --child-frame-id right_optical_frame' in printed
    assert 'extrinsics.left: [' in printed
    assert picture.stat().st_size > 10_000
    # What `hooc up --cameras` takes.
    poses = camera_poses(out)
    assert poses['right'][:3] == pytest.approx(found['right'].T_world_camera[:3, 3])


def test_scenes_whose_cameras_stand_elsewhere_are_left_out(tabletop, true, stated, tmp_path):
    path = written(tmp_path / 'set', tabletop, true, stated, others=[true])
    recording = of_set(load_scene_set(path))
    assert len(recording.frames) == 4 and '1 of 5 scenes' in str(recording.left_out)


def test_a_bare_table_writes_nothing(tabletop, true, stated, tmp_path, capsys):
    path = written(tmp_path / 'set', tabletop, true, stated, count=0)
    assert main(['calibrate', str(path), '--out', str(tmp_path / 'c.yaml')]) == 1
    assert 'cannot be observed' in capsys.readouterr().err
    assert not (tmp_path / 'c.yaml').exists()


def test_poses_are_written_in_the_frame_of_the_set(tabletop, true, tmp_path, capsys):
    """The world is not a table's: it is tilted, and the table lies 0.7 m above its origin."""
    T_world_table = np.eye(4)
    T_world_table[:3, :3] = Rotation.from_rotvec([0.3, 0.1, 0.5]).as_matrix()
    T_world_table[:3, 3] = 0.2, -0.4, 0.7
    elsewhere = tuple(replace(c, T_world_camera=T_world_table @ c.T_world_camera) for c in true)
    path = written(tmp_path / 'set', tabletop, true, elsewhere)
    text = (path / 'dataset.yaml').read_text()
    (path / 'dataset.yaml').write_text(text.replace('world_frame: table', 'world_frame: unknown'))
    out = tmp_path / 'cameras.yaml'
    assert main(['calibrate', str(path), '--out', str(out), '--ros']) == 0
    for before, after in zip(elsewhere, load_cameras(out).values()):
        mm, deg = tabletop.pose_error(before.T_world_camera, after.T_world_camera)
        assert mm < 5 and deg < 0.3
    assert '--frame-id world' in capsys.readouterr().out


def bag_of(folder, tabletop, true, stated, seed):
    views, = tabletop.scenes(true, stated, [seed])
    scene = SimpleNamespace(name=f's{seed}', cameras=stated, truth=None, world={},
                            depth_units=(0.001,) * 2, labels=lambda: None, depth=lambda: views)
    scene_set = SimpleNamespace(name='test', world_frame='table', category_names=('box',),
                                max_instances=1)
    return str(write_bag(scene, scene_set, folder, repeat=3))


def test_bags_of_one_rig(tabletop, true, stated, tmp_path, capsys):
    bags = [bag_of(tmp_path, tabletop, true, stated, seed) for seed in (1, 2, 3)]
    out = tmp_path / 'cameras.yaml'
    assert main(['calibrate', *bags, '--frames', '2', '--out', str(out)]) == 0
    assert '6 frame sets' in capsys.readouterr().out
    mm, deg = tabletop.pose_error(right_in_left(true), right_in_left(load_cameras(out).values()))
    assert mm < 5 and deg < 0.3
    other = bag_of(tmp_path, tabletop, true, true, 4)
    assert main(['calibrate', bags[0], other, '--out', str(tmp_path / 'no.yaml')]) == 1
    assert 'not one fixed rig' in capsys.readouterr().err and not (tmp_path / 'no.yaml').exists()
