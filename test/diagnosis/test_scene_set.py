# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc doctor SET`: what is wrong with files, meshes, poses and depth of a scene set."""

from hooc_perception.cli.main import main
from hooc_perception.diagnosis.finding import worst
from hooc_perception.diagnosis.scene_set import check_set
from hooc_perception.io.scenes.scene_set import NewScene, TrueObject, write_scene_set
import numpy as np
import pytest
import trimesh
import yaml


@pytest.fixture
def path(tmp_path, tabletop):
    """Return a set that nothing is wrong with."""
    cameras = [tabletop.camera('left', 20), tabletop.camera('right', 140)]
    views, = tabletop.scenes(cameras, cameras, [3])
    truth = (TrueObject('box', np.array([0.1, 0, 0.05]), np.array([0, 0, 0, 1.0]),
                        np.array([0.1, 0.1, 0.15])),)
    return write_scene_set(tmp_path / 'set', 'small', {'box': trimesh.creation.box((0.1,) * 3)},
                           cameras, [NewScene('one', tuple(v.depth for v in views), truth)])


def edit(file, change):
    content = yaml.safe_load(file.read_text())
    change(content)
    file.write_text(yaml.safe_dump(content))


def problems(path):
    """Return the findings that are not OK as one text, and the worst level."""
    findings = list(check_set(path))
    return ' '.join(f'{f.subject}: {f.text}' for f in findings if f.level != 'ok'), worst(findings)


def test_a_sound_set(path, capsys):
    assert problems(path) == ('', 'ok')
    assert main(['doctor', str(path)]) == 0
    assert 'everything is fine' in capsys.readouterr().out


@pytest.mark.parametrize('file, change, words', [
    ('dataset.yaml', lambda d: d.update(depth_unit=0.0001), ('one', '0.001 m and not 0.0001 m')),
    ('dataset.yaml', lambda d: d.update(dept_unit=0.001), ('depth_unit meant',)),
    ('dataset.yaml', lambda d: d['categories'][0].update(scale=0.001), ('box', 'scale: 1')),
    ('cameras.yaml', lambda d: d['left']['world_from_camera'].update(
        translation=[500, 400, 700]), ('left', 'millimetres'))])
def test_errors_are_those_of_the_other_commands(path, file, change, words):
    edit(path / file, change)
    text, level = problems(path)
    assert level == 'error' and all(word in text for word in words)


def test_a_scale_that_the_true_objects_contradict(path):
    edit(path / 'dataset.yaml', lambda d: d['categories'][0].update(scale=0.1))
    text, level = problems(path)
    assert level == 'warning' and '15 times as long as its mesh (0.01 m)' in text


def test_a_camera_that_does_not_see_the_table(path):
    edit(path / 'cameras.yaml', lambda d: d['right']['world_from_camera']['translation'].
         __setitem__(2, d['right']['world_from_camera']['translation'][2] + 0.15))
    text, level = problems(path)
    assert level == 'warning' and 'one: camera right: it measures no table' in text
    edit(path / 'cameras.yaml', lambda d: d['left']['world_from_camera']['translation'].
         __setitem__(2, d['left']['world_from_camera']['translation'][2] + 0.15))
    assert problems(path)[1] == 'error'


def test_a_set_without_scenes_can_still_be_checked(path, tmp_path):
    (path / 'scenes').rename(tmp_path / 'scenes')
    text, level = problems(path)
    assert level == 'warning' and 'can be trained on but not parsed' in text
