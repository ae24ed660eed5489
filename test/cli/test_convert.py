# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The command `hooc convert`, through the command line's own entry."""

from hooc_perception.cli.main import main
from hooc_perception.core.types import Camera
from hooc_perception.io.bags.reader import BagScene, topics
from hooc_perception.io.bags.sequences import frame_sets
from hooc_perception.io.scenes.camera_files import load_cameras
from hooc_perception.io.scenes.scene_set import NewScene, write_scene_set
import numpy as np
import pytest
from scipy.io import savemat
import trimesh
import yaml


@pytest.fixture
def scene_set(tmp_path):
    K = np.array([[50.0, 0, 19.5], [0, 50, 14.5], [0, 0, 1]])
    T = np.diag([1.0, -1, -1, 1])
    T[2, 3] = 0.8
    cameras = tuple(Camera(n, 40, 30, K, np.zeros(5), T) for n in ('left', 'right'))
    depth = np.full((30, 40), 0.8)
    return write_scene_set(tmp_path / 'set', 'small', {'box': trimesh.creation.box((1, 1, 1))},
                           cameras, [NewScene(n, (depth, depth)) for n in ('a', 'b', 'c')])


def calibration(path):
    path.parent.mkdir(exist_ok=True)
    savemat(path, {'fc': [600.0, 610], 'cc': [320.0, 240], 'kc': np.zeros(5), 'alpha_c': 0.0,
                   'nx': 640, 'ny': 480, 'omc_3': [np.pi, 0, 0], 'Tc_3': [0.0, 0, 900]})
    return path


def test_every_scene_becomes_a_bag(scene_set, tmp_path, capsys):
    assert main(['convert', str(scene_set), '--out', str(tmp_path / 'bags')]) == 0
    bags = sorted((tmp_path / 'bags').iterdir())
    assert [b.name for b in bags] == ['a', 'b', 'c']
    assert [BagScene(b).name for b in bags] == ['a', 'b', 'c']
    assert all((b / f'{b.name}.mcap').is_file() for b in bags)
    assert '3 bags' in capsys.readouterr().out


def test_chosen_scenes_storage_and_repetition(scene_set, tmp_path):
    out = tmp_path / 'bags'
    assert main(['convert', str(scene_set), '--out', str(out), '--scene', 'c', '--scene', 'a',
                 '--storage', 'sqlite3', '--repeat', '2', '--rate', '5']) == 0
    assert sorted(b.name for b in out.iterdir()) == ['a', 'c']
    assert (out / 'a' / 'a.db3').is_file()
    assert topics(out / 'a')['/hooc/left/depth/image_raw'].count == 2


def test_a_sequence_becomes_one_bag_and_other_scenes_one_each(scene_set, tmp_path, capsys):
    (scene_set / 'sequences.yaml').write_text(
        yaml.safe_dump([{'name': 's', 'period_s': 0.5, 'scenes': ['c', 'a']}]))
    out = tmp_path / 'bags'
    assert main(['convert', str(scene_set), '--out', str(out), '--repeat', '3']) == 0
    assert sorted(bag.name for bag in out.iterdir()) == ['b', 's']
    assert '2 bags' in capsys.readouterr().out
    assert [frame.name for frame in frame_sets(BagScene(out / 's'))] == ['c', 'a']
    assert topics(out / 'b')['/hooc/left/depth/image_raw'].count == 3
    # Chosen by its name it is a sequence, part of it is not.
    assert main(['convert', str(scene_set), '--out', str(out / 'new'), '--scene', 's']) == 0
    assert main(['convert', str(scene_set), '--out', str(out / 'new'), '--scene', 'c']) == 0
    assert sorted(bag.name for bag in (out / 'new').iterdir()) == ['c', 's']


def test_calibrations_become_cameras_yaml(tmp_path):
    files = [calibration(tmp_path / side / 'Calib_Results.mat') for side in ('left', 'right')]
    out = tmp_path / 'cameras.yaml'
    assert main(['convert', '--out', str(out), '--calibration', f'kinect1={files[0]}#3',
                 f'kinect2={files[1]}#3']) == 0
    cameras = load_cameras(out)
    assert list(cameras) == ['kinect1', 'kinect2']
    # The board lay 0.9 m before the camera, its face turned to it: so the camera hangs above.
    np.testing.assert_allclose(cameras['kinect1'].T_world_camera[:3, 3], [0, 0, 0.9], atol=1e-9)


@pytest.mark.parametrize('arguments, words', [
    (['nowhere'], ('nowhere', 'no such folder')),
    (['{set}', '--scene', 'x'], ('x', 'a, b, c')),
    (['{set}', '--repeat', '0'], ('repeat',)),
    ([], ('SET', '--calibration')),
    (['{set}', '--calibration', 'a=b.mat'], ('SET', '--calibration')),
    (['--calibration', 'a.mat'], ('a.mat', 'NAME=FILE')),
    (['--calibration', 'a=none.mat'], ('none.mat', 'missing')),
    (['--calibration', 'a=none.mat', '--unit', '0'], ('--unit',)),
])
def test_errors_are_one_line_and_exit_1(scene_set, tmp_path, capsys, arguments, words):
    arguments = [a.format(set=scene_set) for a in arguments]
    assert main(['convert', *arguments, '--out', str(tmp_path / 'out')]) == 1
    error = capsys.readouterr().err
    lines = [line for line in error.splitlines() if 'bag/s' not in line and line.strip()]
    assert len(lines) == 1
    for word in words:
        assert word in error
    assert not (tmp_path / 'out').exists()


def test_nothing_is_overwritten(scene_set, tmp_path, capsys):
    assert main(['convert', str(scene_set), '--out', str(tmp_path / 'bags')]) == 0
    assert main(['convert', str(scene_set), '--out', str(tmp_path / 'bags')]) == 1
    assert 'exists already' in capsys.readouterr().err
