# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A key that nobody reads, or one that stands twice, is an error in every file of a set."""

from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import files
from hooc_perception.io.scenes.camera_files import load_cameras
from hooc_perception.io.scenes.scene_set import (
    load_scene_set,
    NewScene,
    TrueObject,
    write_scene_set,
)
import numpy as np
import pytest
import trimesh
import yaml

UNKNOWN = {'objects': [{'name': 'shoe', 'translation': [0, 0, 0.05],
                        'rotation_xyzw': [0, 0, 0, 1], 'size': [0.3, 0.1, 0.1]}]}
SEQUENCES = [{'name': 's1', 'period_s': 0.5, 'scenes': ['one'], 'events': {0: 'placed ball'}}]


@pytest.fixture
def path(tmp_path):
    """Return a set with every file that the format knows."""
    K = np.array([[50.0, 0, 19.5], [0, 50, 14.5], [0, 0, 1]])
    T = np.diag([1.0, -1, -1, 1])
    T[2, 3] = 0.8
    camera = Camera('left', 40, 30, K, np.zeros(5), T)
    truth = (TrueObject('ball', np.zeros(3), np.array([0, 0, 0, 1.0]), np.full(3, 0.08), 0.5),)
    path = write_scene_set(
        tmp_path / 'set', 'small', {'ball': trimesh.creation.icosphere(1, 0.04)}, [camera],
        [NewScene('one', (np.full((30, 40), 0.8),), truth, cameras=(camera,))])
    scene = path / 'scenes' / 'one'
    (scene / 'labels.yaml').write_text('1: ball\n2: monitor\n')
    (scene / 'well_seen.yaml').write_text('left: [1]\n')
    (scene / 'unknown.yaml').write_text(yaml.safe_dump(UNKNOWN))
    (path / 'sequences.yaml').write_text(yaml.safe_dump(SEQUENCES))
    return path


def edit(file, change):
    """Let `change` alter the content of a YAML file in place."""
    content = yaml.safe_load(file.read_text())
    change(content)
    file.write_text(yaml.safe_dump(content))


def first(content):
    """Return the first object of a file's list."""
    return content['objects'][0]


def renamed(entry, old, new):
    """Rename a key."""
    entry[new] = entry.pop(old)


def test_documented_keys_and_own_notes_are_accepted(path):
    edit(path / 'dataset.yaml', lambda d: d.update(x_recorded_by='me'))
    edit(path / 'cameras.yaml', lambda d: d['left'].update(sensor='kinect_v2'))
    edit(path / 'scenes' / 'one' / 'ground_truth.yaml', lambda d: first(d).update(tag=14))
    assert load_scene_set(path).scenes[0].truth[0].category == 'ball'


@pytest.mark.parametrize('file, change, words', [
    ('dataset.yaml', lambda d: d.update(depth_units=0.0001), ('depth_units', 'depth_unit meant')),
    ('dataset.yaml', lambda d: renamed(d, 'world_frame', 'WorldFrame'), ('world_frame meant',)),
    ('dataset.yaml', lambda d: d.update(colour='red'), ('colour', 'known', 'x_colour')),
    ('dataset.yaml', lambda d: d['categories'][0].update(scales=1), ('[0]', 'scale meant')),
    ('dataset.yaml', lambda d: renamed(d['categories'][0], 'model', 'mesh'), ('model meant',)),
    ('cameras.yaml', lambda d: renamed(d['left'], 'D', 'd'), ('left', "'d'", 'D meant')),
    ('cameras.yaml', lambda d: renamed(d['left'], 'distortion_model', 'distortion_modle'),
     ('distortion_model meant',)),
    ('cameras.yaml', lambda d: renamed(d['left']['world_from_camera'], 'rotation_xyzw',
                                       'rotation_wxyz'), ('rotation_xyzw meant',)),
    ('cameras.yaml', lambda d: d['left']['world_from_camera'].update(unit='mm'), ('unit',)),
    ('scenes/one/cameras.yaml', lambda d: d['left'].update(lens=[1]), ('lens',)),
    ('scenes/one/ground_truth.yaml', lambda d: d.update(object=[]), ('object',)),
    ('scenes/one/ground_truth.yaml',
     lambda d: renamed(first(d), 'surface_visibility', 'surface_visiblity'),
     ('objects[0]', 'surface_visibility meant')),
    ('scenes/one/ground_truth.yaml', lambda d: first(d).update(category='bal'), ('ball meant',)),
    ('scenes/one/unknown.yaml', lambda d: first(d).update(sizes=[1]), ('unknown', 'sizes')),
    ('scenes/one/labels.yaml', lambda d: d.update({3: 'bal'}), ('label 3', 'ball meant')),
    ('scenes/one/labels.yaml', lambda d: d.update({300: 'ball'}), ('300',)),
    ('scenes/one/well_seen.yaml', lambda d: renamed(d, 'left', 'Left'), ('left meant',)),
    ('sequences.yaml', lambda d: renamed(d[0], 'period_s', 'period'), ('period_s meant',))])
def test_unknown_keys_are_refused_by_name(path, file, change, words):
    edit(path / file, change)
    with pytest.raises(HoocError) as caught:
        load_scene_set(path)
    assert ';' in str(caught.value) and '\n' not in str(caught.value)
    for word in (file.rpartition('/')[2], *words):
        assert word in str(caught.value)


@pytest.mark.parametrize('file, row', [
    ('dataset.yaml', 'name: other'), ('cameras.yaml', 'left: {width: 1}'),
    ('scenes/one/ground_truth.yaml', 'objects: []'), ('scenes/one/labels.yaml', '1: box'),
    ('scenes/one/unknown.yaml', 'objects: []'), ('scenes/one/well_seen.yaml', '"left": [2]')])
def test_keys_that_stand_twice_are_refused(path, file, row):
    file = path / file
    lines = file.read_text().rstrip('\n').split('\n')
    file.write_text('\n'.join([*lines, row, '']))
    with pytest.raises(HoocError, match=f'twice .* line {len(lines) + 1}; keep one'):
        load_scene_set(path)


def test_keys_that_stand_twice_further_in(path):
    text = (path / 'cameras.yaml').read_text()
    (path / 'cameras.yaml').write_text(text.replace('  height: 30', '  height: 30\n  height: 31'))
    with pytest.raises(HoocError, match="'height' stands twice"):
        load_cameras(path / 'cameras.yaml')


def test_merged_and_repeated_values_are_not_doubled_keys(tmp_path):
    file = tmp_path / 'a.yaml'
    file.write_text('a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\nc: *a\nd: [x, x, {x: x}]\n'
                    '? [1, 2]\n: e\n')
    with pytest.raises(HoocError, match='not valid YAML'):
        files.read_yaml(file)                       # PyYAML knows no lists as keys
    file.write_text(file.read_text().partition('?')[0])
    assert files.read_yaml(file)['b'] == {'x': 1, 'y': 3}
