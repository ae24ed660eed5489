# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A sequence becomes one bag, which gives back every frame set with its truth."""

from dataclasses import replace
import json

from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.files import iter_messages, topics
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.bags.scene_info import parsed_info
from hooc_perception.io.bags.sequences import frame_sets, recorded_sequence
from hooc_perception.io.bags.writer import (
    FIRST_STAMP_NS,
    INFO_TOPIC,
    LEAD_NS,
    write_bag,
    write_sequence,
)
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

NAMES = ['late', 'early', 'last']
EVENTS = {1: 'removed box', 2: 'arm in'}


@pytest.fixture(scope='module')
def scene_set(tmp_path_factory):
    """Return a set of two cameras with a sequence of three frame sets, the last not annotated."""
    rng = np.random.default_rng(3)
    T = np.diag([1.0, -1, -1, 1])
    T[2, 3] = 1.0
    K = np.array([[50.0, 0, 19.5], [0, 50, 14.5], [0, 0, 1]])
    cameras = tuple(Camera(name, 40, 30, K, np.zeros(5), T) for name in ('right', 'left'))
    box = TrueObject('box', np.zeros(3), np.array([0, 0, 0, 1.0]), np.full(3, 0.1), 0.5)
    path = write_scene_set(
        tmp_path_factory.mktemp('scenes') / 'set', 'small',
        {'box': trimesh.creation.box((0.1, 0.1, 0.1))}, cameras,
        [NewScene(name, tuple(rng.uniform(0.8, 1, (30, 40)) for _ in cameras), truth,
                  {'left': np.ones((30, 40), np.uint8)})
         for name, truth in zip(NAMES, ((box,), (), None))], 1)
    (path / 'sequences.yaml').write_text(yaml.safe_dump(
        [{'name': 's', 'period_s': 0.4, 'scenes': NAMES, 'events': EVENTS}]))
    return load_scene_set(path)


@pytest.fixture(scope='module', params=['mcap', 'sqlite3'])
def bag(request, scene_set, tmp_path_factory):
    """Return the bag of the sequence."""
    return write_sequence(scene_set.sequences[0], scene_set, tmp_path_factory.mktemp('bags'),
                          request.param)


def test_every_frame_set_comes_back(bag, scene_set):
    read = BagScene(bag)
    assert recorded_sequence(read) == scene_set.sequences[0]
    assert (read.name, read.truth, read.warnings) == ('s', None, ())
    found = frame_sets(read)
    assert [frame.name for frame in found] == NAMES
    # Out of order, too: nothing is remembered of the one before.
    for frame in (found[2], found[0], found[1]):
        scene = scene_set.scene(frame.name)
        for view, expected in zip(frame.depth(), scene.depth(), strict=True):
            np.testing.assert_array_equal(view.depth, expected.depth)
            assert view.camera.name == expected.camera.name
    assert [frame.truth and frame.truth[0].category for frame in found] == ['box', (), None]
    assert frame_sets(found[0]) == () and recorded_sequence(found[0]) is None
    np.testing.assert_array_equal(read.depth()[0].depth, found[0].depth()[0].depth)
    assert found[0].labels() is None


def test_the_frame_sets_are_a_period_apart(bag):
    stamps = {}
    for message in iter_messages(bag, {f'/hooc/{name}/depth/image_raw'
                                       for name in ('left', 'right')}):
        header = message.read(bag).header
        assert message.time_ns == header.stamp.sec * 10 ** 9 + header.stamp.nanosec
        stamps.setdefault(message.topic.name, []).append(message.time_ns)
    period = 4 * 10 ** 8
    assert list(stamps.values()) == [[FIRST_STAMP_NS + LEAD_NS + k * period
                                      for k in range(3)]] * 2
    assert topics(bag)['/tf_static'].count == 1


def test_other_bags_hold_no_sequence(scene_set, tmp_path):
    read = BagScene(write_bag(scene_set.scenes[0], scene_set, tmp_path, repeat=3))
    assert recorded_sequence(read) is None and frame_sets(read) == ()


def test_a_lost_image_is_named(bag):
    read = BagScene(bag)
    topic = '/hooc/left/depth/image_raw'
    read.topics = {**read.topics, topic: replace(read.topics[topic], count=2)}
    with pytest.raises(HoocError, match='left.*2 images.*s has 3 frame sets; convert'):
        frame_sets(read)


def test_an_empty_image_is_not_replaced_by_that_of_another_frame_set(scene_set, tmp_path,
                                                                    monkeypatch):
    bag = write_sequence(scene_set.sequences[0], scene_set, tmp_path)
    plain = BagScene._view

    def view(self, camera, topic, image):
        if image.header.stamp.nanosec == (LEAD_NS + 4 * 10 ** 8):
            raise HoocError('empty; record it again')
        return plain(self, camera, topic, image)
    monkeypatch.setattr(BagScene, '_view', view)
    first, second, third = frame_sets(BagScene(bag))
    assert len(first.depth()) == len(third.depth()) == 2
    with pytest.raises(HoocError, match='empty'):
        second.depth()


def test_cameras_that_move_are_refused(scene_set, tmp_path):
    scene = scene_set.scene('last')
    T = scene.cameras[0].T_world_camera.copy()
    T[0, 3] += 0.01
    moved = replace(scene, source_cameras=(replace(scene.cameras[0], T_world_camera=T),
                                           scene.cameras[1]))
    scenes = tuple(moved if s.name == 'last' else s for s in scene_set.scenes)
    with pytest.raises(HoocError, match='last are not those of late'):
        write_sequence(scene_set.sequences[0], replace(scene_set, scenes=scenes), tmp_path)
    assert not (tmp_path / 's').exists()


def test_a_broken_image_leaves_no_bag(scene_set, tmp_path):
    scenes = tuple(replace(s, depth_files=(tmp_path / 'gone.png',) * 2) if s.name == 'last' else s
                   for s in scene_set.scenes)
    with pytest.raises(HoocError, match='gone.png'):
        write_sequence(scene_set.sequences[0], replace(scene_set, scenes=scenes), tmp_path / 'out')
    assert not list((tmp_path / 'out').iterdir())


@pytest.mark.parametrize('change, words', [
    (lambda s: s.pop('period_s'), ('period_s', 'missing')),
    (lambda s: s.update(period_s=-1), ('period_s', '-1')),
    (lambda s: s.pop('frame_sets'), ('frame_sets', 'missing')),
    (lambda s: s['frame_sets'].append(3), ('frame_sets[3]',)),
    (lambda s: s['frame_sets'][0].pop('scene'), ('frame_sets', 'None')),
    (lambda s: s['frame_sets'][1].update(scene='late'), ('late', 'twice')),
    (lambda s: s['frame_sets'][0]['truth'][0].pop('size'), ('late truth[0]', 'size')),
    (lambda s: s.update(events={'3': 'arm in'}), ('events', '3')),
    (lambda s: s.update(events={'-1': 'arm in'}), ('events', '-1')),
    (lambda s: s.update(events={'1': 'lost'}), ('events: 1', 'lost')),
    (lambda s: s.update(events=[1]), ('events', 'list')),
])
def test_a_damaged_description_is_named(bag, change, words):
    message, = iter_messages(bag, {INFO_TOPIC})
    info = json.loads(message.read(bag).data)
    parsed_info(json.dumps(info), 'bag')
    change(info['sequence'])
    with pytest.raises(HoocError) as caught:
        parsed_info(json.dumps(info), 'bag')
    for word in ('bag', 'sequence', ';', *words):
        assert word in str(caught.value)
