# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Every error in a scene set gets one sentence that names file, field and fix."""

import struct
import zlib

import cv2
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
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


@pytest.fixture
def path(tmp_path):
    """Return a scene set without errors: two cameras, one scene, two categories."""
    K = np.array([[50.0, 0, 19.5], [0, 50, 14.5], [0, 0, 1]])
    T = np.diag([1.0, -1, -1, 1])
    T[2, 3] = 1
    cameras = tuple(Camera(name, 40, 30, K, np.zeros(5), T) for name in ('left', 'right'))
    meshes = {'ball': trimesh.creation.icosphere(1, 0.04), 'box': trimesh.creation.box((1, 1, 1))}
    truth = (TrueObject('ball', np.zeros(3), np.array([0, 0, 0, 1.0]), np.full(3, 0.08)),)
    depth = np.full((30, 40), 0.8)
    return write_scene_set(tmp_path / 'set', 'small', meshes, cameras,
                           [NewScene('one', (depth, depth), truth)])


def edit(file, change):
    """Let `change` alter the content of a YAML file in place."""
    content = yaml.safe_load(file.read_text())
    change(content)
    file.write_text(yaml.safe_dump(content))


def assert_sentence(error, *words):
    """Assert that a message is one sentence with a fix, and names everything it must."""
    text = str(error.value)
    assert '\n' not in text
    assert ';' in text, 'no fix'
    for word in words:
        assert word in text


def family(content, models):
    """Give the second category of a dataset.yaml a list of meshes."""
    content['categories'][1].pop('model')
    content['categories'][1]['models'] = models


DATASET = [
    (lambda d: d.update(format='hooc-scenes/2'), ('format', 'hooc-scenes/2', 'hooc-scenes/1')),
    (lambda d: d.pop('format'), ('format', 'missing')),
    (lambda d: d.pop('cameras'), ('cameras', 'missing')),
    (lambda d: d.update(cameras=[]), ('cameras',)),
    (lambda d: d.update(cameras='left'), ('cameras',)),
    (lambda d: d.update(cameras=['left', 'left']), ('cameras', 'left', 'twice')),
    (lambda d: d.update(cameras=['left', '../right']), ('cameras', '../right')),
    (lambda d: d.update(cameras=['left', '2nd']), ('cameras', '2nd')),
    (lambda d: d['categories'].extend({'name': name, 'model': 'models/box.ply'}
                                      for name in ('mug-1', 'mug.1')),
     ('dataset.yaml', 'mug-1', 'mug.1', 'objects/mug_1/poses', 'rename')),
    (lambda d: d.update(depth_unit=0), ('depth_unit',)),
    (lambda d: d.update(depth_unit='mm'), ('depth_unit', 'mm')),
    (lambda d: d.update(depth_unit=float('inf')), ('depth_unit',)),
    (lambda d: d.update(max_instances_per_category=-1), ('max_instances_per_category', '-1')),
    (lambda d: d.update(max_instances_per_category=True), ('max_instances_per_category',)),
    (lambda d: d.pop('categories'), ('categories', 'missing')),
    (lambda d: d.update(categories=[]), ('categories',)),
    (lambda d: d.update(categories=['ball']), ('categories[0]',)),
    (lambda d: d['categories'].append(dict(d['categories'][0])), ('categories', 'ball', 'twice')),
    (lambda d: d['categories'][1].pop('name'), ('categories[1]', 'name')),
    (lambda d: d['categories'][1].update(name='a/b'), ('categories[1]', 'name', 'a/b')),
    (lambda d: d['categories'][1].pop('model'), ('box', 'model', 'missing', 'models')),
    (lambda d: d['categories'][1].update(model='models/none.ply'), ('box', 'model', 'none.ply')),
    (lambda d: d['categories'][1].update(model='../../etc/passwd'), ('box', 'model', 'leaves')),
    (lambda d: d['categories'][1].update(model='/etc/passwd'), ('box', 'model', 'leaves')),
    (lambda d: d['categories'][1].update(model=5), ('box', 'model', '5')),
    (lambda d: d['categories'][1].update(models=['models/box.ply']),
     ('box', 'both model and models', 'keep one')),
    (lambda d: family(d, []), ('box', 'models', '0 entries')),
    (lambda d: family(d, 'models/box.ply'), ('box', 'models', 'list')),
    (lambda d: family(d, None), ('box', 'models', 'list')),
    (lambda d: family(d, ['models/box.ply', 'models/none.ply']), ('box', 'models', 'none.ply')),
    (lambda d: family(d, ['models/box.ply', 7]), ('box', 'models', '7')),
    (lambda d: family(d, ['models/box.ply', '../../etc/passwd']), ('box', 'models', 'leaves')),
    (lambda d: family(d, ['models/box.ply', 'models/ball.ply', 'models/box.ply']),
     ('box', 'models', 'models/box.ply', 'twice')),
    (lambda d: family(d, ['models/box.ply', 'models/../models/box.ply']),
     ('box', 'models', 'box.ply', 'same file')),
    (lambda d: family(d, ['models/box.ply'] * 101), ('box', 'models', '101 entries')),
    (lambda d: d['categories'][1].update(scale=0), ('box', 'scale')),
    (lambda d: d['categories'][1].update(scale=float('nan')), ('box', 'scale', 'nan')),
]


@pytest.mark.parametrize('change, words', DATASET, ids=['-'.join(w) for _, w in DATASET])
def test_dataset_yaml(path, change, words):
    edit(path / 'dataset.yaml', change)
    with pytest.raises(HoocError) as error:
        load_scene_set(path)
    assert_sentence(error, 'dataset.yaml', *words)


CAMERAS = [
    (lambda c: c.pop('right'), ('right', 'missing')),
    (lambda c: c['left'].pop('K'), ('left', 'K', 'missing')),
    (lambda c: c['left'].update(K=[50, 0, 20, 0, 50, 15, 0, 0]), ('left', 'K', '8')),
    (lambda c: c['left'].update(K=[50, 0, 20, 0, 0, 15, 0, 0, 1]), ('left', 'K', 'singular')),
    (lambda c: c['left'].update(K=[0] * 9), ('left', 'K', 'singular')),
    (lambda c: c['left'].update(K=[50, 0, 20, 0, float('nan'), 15, 0, 0, 1]),
     ('left', 'K', 'nan')),
    (lambda c: c['left'].update(K=[50, 9, 20, 0, 50, 15, 0, 0, 1]), ('left', 'K', 'skew')),
    (lambda c: c['left'].update(K=[50, 0, 2000, 0, 50, 15, 0, 0, 1]), ('left', 'K', '2000')),
    (lambda c: c['left'].update(K='identity'), ('left', 'K')),
    (lambda c: c['left'].update(width=0), ('left', 'width', '0')),
    (lambda c: c['left'].update(height=10 ** 9), ('left', 'height')),
    (lambda c: c['left'].update(height=3.5), ('left', 'height', '3.5')),
    (lambda c: c['left'].update(D=[0.1, 0.2]), ('left', 'D', '2')),
    (lambda c: c['left'].update(D=[0.1, 0, 0, 0, float('inf')]), ('left', 'D', 'inf')),
    (lambda c: c['left'].update(distortion_model='fisheye'), ('distortion_model', 'fisheye')),
    (lambda c: c['left'].pop('world_from_camera'), ('left', 'world_from_camera', 'missing')),
    (lambda c: c['left']['world_from_camera'].pop('translation'), ('translation', 'missing')),
    (lambda c: c['left']['world_from_camera'].update(translation=[0, 1]), ('translation', '2')),
    (lambda c: c['left']['world_from_camera'].update(rotation_xyzw=[0, 0, 0, 0]),
     ('rotation_xyzw', 'unit')),
    (lambda c: c['left']['world_from_camera'].update(rotation_xyzw=[1, 0, 0, 1]),
     ('rotation_xyzw', 'unit')),
    (lambda c: c.clear(), ('camera',)),
]


@pytest.mark.parametrize('change, words', CAMERAS, ids=['-'.join(w) for _, w in CAMERAS])
def test_cameras_yaml(path, change, words):
    edit(path / 'cameras.yaml', change)
    with pytest.raises(HoocError) as error:
        load_scene_set(path)
    assert_sentence(error, 'cameras.yaml', *words)


TRUTH = [
    (lambda t: t.pop('objects'), ('objects', 'missing')),
    (lambda t: t.update(objects={}), ('objects',)),
    (lambda t: t['objects'][0].update(category='cup'), ('objects[0]', 'category', 'cup')),
    (lambda t: t['objects'][0].pop('category'), ('objects[0]', 'category', 'missing')),
    (lambda t: t['objects'][0].update(translation=[0, 0, float('nan')]), ('translation', 'nan')),
    (lambda t: t['objects'][0].update(translation=[0, 0, 5e3]), ('translation', 'metres')),
    (lambda t: t['objects'][0].update(rotation_xyzw=[0, 0, 0, 2]), ('rotation_xyzw', 'unit')),
    (lambda t: t['objects'][0].update(rotation_xyzw=[0, 0, 0, 0]), ('rotation_xyzw', 'unit')),
    (lambda t: t['objects'][0].update(size=[1, 1, 0]), ('size', 'positive')),
    (lambda t: t['objects'][0].pop('size'), ('size', 'missing')),
    (lambda t: t['objects'][0].update(surface_visibility=54), ('surface_visibility', '54')),
]


@pytest.mark.parametrize('change, words', TRUTH, ids=['-'.join(w) for _, w in TRUTH])
def test_ground_truth_yaml(path, change, words):
    edit(path / 'scenes' / 'one' / 'ground_truth.yaml', change)
    with pytest.raises(HoocError) as error:
        load_scene_set(path)
    assert_sentence(error, 'ground_truth.yaml', *words)


def png(pixels):
    return cv2.imencode('.png', pixels)[1].tobytes()


def declared_size(data, width, height):
    """Return a PNG whose header claims another size, checksum included."""
    header = b'IHDR' + struct.pack('>II', width, height) + data[24:29]
    return data[:12] + header + struct.pack('>I', zlib.crc32(header)) + data[33:]


GOOD = png(np.full((30, 40), 800, np.uint16))
IMAGES = [
    (GOOD[:len(GOOD) // 2], 'truncated'),
    (GOOD[:-12], 'truncated'),
    (GOOD[:50] + bytes([GOOD[50] ^ 1]) + GOOD[51:], 'damaged'),
    (b'', 'not a PNG'),
    (b'\xff\xd8\xff\xe0' + b'\0' * 100, 'not a PNG'),
    (png(np.full((30, 40), 80, np.uint8)), '8-bit'),
    (png(np.full((30, 40, 3), 800, np.uint16)), 'colour'),
    (png(np.full((40, 30), 800, np.uint16)), '30 x 40'),
    (declared_size(GOOD, 10 ** 6, 10 ** 6), '1000000 x 1000000'),
    (png(np.zeros((30, 40), np.uint16)), 'every depth pixel is 0'),
]


@pytest.mark.parametrize('data, word', IMAGES, ids=[word for _, word in IMAGES])
def test_depth_images(path, data, word):
    (path / 'scenes' / 'one' / 'right.png').write_bytes(data)
    scene = load_scene_set(path).scenes[0]
    with pytest.raises(HoocError) as error:
        scene.depth()
    assert_sentence(error, 'one', 'right.png', word)


def test_labels_of_16_bits(path):
    file = path / 'scenes' / 'one' / 'left_labels.png'
    file.write_bytes(GOOD)
    with pytest.raises(HoocError) as error:
        load_scene_set(path).scenes[0].labels()
    assert_sentence(error, 'left_labels.png', '16-bit', '8-bit')


def test_missing_depth_image(path):
    (path / 'scenes' / 'one' / 'right.png').unlink()
    with pytest.raises(HoocError) as error:
        load_scene_set(path)
    assert_sentence(error, 'right.png', 'right', 'missing')


def test_empty_scenes_folder(path):
    for file in (path / 'scenes' / 'one').iterdir():
        file.unlink()
    (path / 'scenes' / 'one').rmdir()
    with pytest.raises(HoocError) as error:
        load_scene_set(path)
    assert_sentence(error, str(path / 'scenes'))


def test_no_cameras_anywhere(path):
    (path / 'cameras.yaml').unlink()
    with pytest.raises(HoocError) as error:
        load_scene_set(path)
    assert_sentence(error, 'cameras.yaml', 'missing')


def test_model_behind_a_link_that_leaves_the_set(path, tmp_path):
    (tmp_path / 'outside.ply').write_text('ply')
    (path / 'models' / 'link.ply').symlink_to(tmp_path / 'outside.ply')
    edit(path / 'dataset.yaml', lambda d: d['categories'][0].update(model='models/link.ply'))
    with pytest.raises(HoocError) as error:
        load_scene_set(path)
    assert_sentence(error, 'dataset.yaml', 'ball', 'model', 'leaves')


@pytest.mark.parametrize('text', [
    'format: [', 'a: !!python/object/apply:os.system [ls]', '- 1', '', '[' * 100_000, 'a: \x00',
    '\ufffe'], ids=['syntax', 'tag', 'list', 'empty', 'deep', 'zero', 'encoding'])
def test_dataset_yaml_that_is_none(path, text):
    (path / 'dataset.yaml').write_bytes(text.encode('utf-8'))
    with pytest.raises(HoocError) as error:
        load_scene_set(path)
    assert_sentence(error, 'dataset.yaml')


def test_huge_yaml_is_not_read(path, monkeypatch):
    monkeypatch.setattr('hooc_perception.io.scenes.files.MAX_YAML_BYTES', 100)
    with pytest.raises(HoocError) as error:
        load_scene_set(path)
    assert_sentence(error, 'dataset.yaml', 'limit')


@pytest.mark.parametrize('name', ['nowhere', ''])
def test_no_set_at_all(tmp_path, name):
    with pytest.raises(HoocError) as error:
        load_scene_set(tmp_path / name)
    assert_sentence(error, str(tmp_path))


def test_unknown_scene(path):
    with pytest.raises(HoocError) as error:
        load_scene_set(path).selected(['two'])
    assert_sentence(error, 'two', 'one')


def test_written_sets_are_checked(path, tmp_path):
    with pytest.raises(HoocError, match='in use'):
        write_scene_set(path, 'again', {}, (), [])
    K = np.array([[50.0, 0, 19.5], [0, 50, 14.5], [0, 0, 1]])
    camera = Camera('left', 40, 30, K, np.zeros(5), np.eye(4))
    with pytest.raises(HoocError, match='shape'):
        write_scene_set(tmp_path / 'a', 'a', {}, (camera,), [NewScene('s', (np.ones((3, 4)),))])
    with pytest.raises(HoocError, match='0 depth images'):
        write_scene_set(tmp_path / 'b', 'b', {}, (camera,), [NewScene('s', ())])
    with pytest.raises(HoocError, match='a/b'):
        write_scene_set(tmp_path / 'c', 'c', {'a/b': None}, (camera,), [])
    with pytest.raises(HoocError, match="'1-a' and '_1_a' would share"):
        write_scene_set(tmp_path / 'd', 'd', {'1-a': None, '_1_a': None}, (camera,), [])
    assert not (tmp_path / 'a' / 'dataset.yaml').exists()
