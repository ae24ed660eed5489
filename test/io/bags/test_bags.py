# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bags that we write: read back here, by rosbags alone and by a foreign MCAP reader."""

import json
import sqlite3

from hooc_perception.core.geometry import canonical_pose, pose_from_matrix
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene, iter_messages, topics
from hooc_perception.io.bags.writer import write_bag
from hooc_perception.io.scenes.scene_set import (
    load_scene_set,
    NewScene,
    TrueObject,
    write_scene_set,
)
from mcap.reader import make_reader
import numpy as np
import pytest
from rosbags.interfaces import QosDurability
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_typestore, Stores
from scipy.spatial.transform import Rotation
import trimesh

HEIGHT, WIDTH = 30, 40
PER_CAMERA = ('depth/camera_info', 'depth/image_raw', 'extrinsics')


def camera(name, rng, D, model='plumb_bob'):
    K = np.array([[50.0, 0, 19.5], [0, 51.0, 14.5], [0, 0, 1]])
    T_world_camera = np.eye(4)
    down = Rotation.from_euler('x', 180, degrees=True)
    T_world_camera[:3, :3] = (down * Rotation.from_rotvec(0.1 * rng.normal(size=3))).as_matrix()
    T_world_camera[:3, 3] = 0.1 * rng.normal(size=3) + [0, 0, 1]
    return Camera(name, WIDTH, HEIGHT, K, np.array(D), T_world_camera, model)


def make_set(path, depth_unit=0.001):
    rng = np.random.default_rng(5)
    cameras = (camera('right', rng, [0.1, -0.2, 0.001, 0.002, 0.05]),
               camera('left', rng, [0.1, -0.2, 1e-3, 2e-3, 0.05, 0.3, 0.1, 0.2],
                      'rational_polynomial'))
    meshes = {'ball': trimesh.creation.icosphere(1, 0.04), 'box': trimesh.creation.box((1, 1, 1))}
    truth = (TrueObject('box', rng.normal(size=3), Rotation.random(None, rng).as_quat(),
                        np.array([0.1, 0.2, 0.06]), 0.5),)
    depth = [np.where(rng.random((HEIGHT, WIDTH)) < 0.1, np.nan,
                      rng.uniform(0.5, 3, (HEIGHT, WIDTH))) for _ in cameras]
    labels = {'left': rng.integers(0, 4, (HEIGHT, WIDTH)).astype(np.uint8)}
    write_scene_set(path, 'small', meshes, cameras, [
        NewScene('10_1', tuple(depth), truth, labels), NewScene('bare', tuple(depth))],
        max_instances=1, depth_unit=depth_unit)
    return load_scene_set(path)


@pytest.fixture(scope='module')
def scene_set(tmp_path_factory):
    return make_set(tmp_path_factory.mktemp('scenes') / 'set')


@pytest.fixture(scope='module', params=['mcap', 'sqlite3'])
def bag(request, scene_set, tmp_path_factory):
    out = tmp_path_factory.mktemp('bags')
    return write_bag(scene_set.scenes[0], scene_set, out, request.param, repeat=3, rate=20)


def test_a_bag_gives_back_its_scene(bag, scene_set):
    scene, read = scene_set.scenes[0], BagScene(bag)
    assert read.name == '10_1'
    assert [c.name for c in read.cameras] == ['right', 'left']
    for view, expected in zip(read.views(), scene.depth()):
        np.testing.assert_array_equal(view.depth, expected.depth)
        np.testing.assert_array_equal(view.camera.K, expected.camera.K)
        np.testing.assert_array_equal(view.camera.D, expected.camera.D)
        assert view.camera.distortion_model == expected.camera.distortion_model
        np.testing.assert_array_equal(canonical_pose(view.camera.T_world_camera),
                                      canonical_pose(expected.camera.T_world_camera))
    assert {k: v.tolist() for k, v in read.labels().items()} == {
        k: v.tolist() for k, v in scene.labels().items()}
    true, = read.truth
    assert (true.category, true.surface_visibility) == ('box', 0.5)
    np.testing.assert_array_equal(true.rotation_xyzw, scene.truth[0].rotation_xyzw)
    assert read.world == {}
    info = read.info
    assert (info['dataset'], info['max_instances'], info['world_frame']) == ('small', 1, 'table')
    assert info['categories'] == ['ball', 'box']


def test_single_files_are_read_too(bag):
    file, = (f for f in bag.iterdir() if f.suffix in ('.mcap', '.db3'))
    assert [c.name for c in BagScene(file).cameras] == ['right', 'left']


def test_a_scene_without_truth_and_labels(scene_set, tmp_path):
    read = BagScene(write_bag(scene_set.scenes[1], scene_set, tmp_path))
    assert read.truth is None
    assert read.labels() is None


def test_other_units_are_not_rounded(tmp_path):
    scene_set = make_set(tmp_path / 'set', depth_unit=0.00025)
    read = BagScene(write_bag(scene_set.scenes[0], scene_set, tmp_path))
    for view, expected in zip(read.views(), scene_set.scenes[0].depth()):
        np.testing.assert_array_equal(view.depth, expected.depth)


def test_topics_types_and_qos(bag):
    found = topics(bag)
    expected = {f'/hooc/{c}/{t}' for c in ('left', 'right') for t in PER_CAMERA}
    assert set(found) == expected | {'/tf_static', '/hooc/scene_info',
                                     '/hooc/left/instance_labels'}
    latched = {name for name, topic in found.items() if topic.latched}
    assert latched == {name for name in found if '/depth/' not in name}
    assert all(topic.reliable for topic in found.values())
    assert found['/hooc/left/depth/image_raw'].count == 3
    assert found['/hooc/left/extrinsics'].count == 1
    with Reader(bag) as reader:
        profiles = {c.topic: c.ext.offered_qos_profiles for c in reader.connections}
    assert profiles['/tf_static'][0].durability == QosDurability.TRANSIENT_LOCAL
    assert profiles['/hooc/left/depth/image_raw'][0].durability == QosDurability.VOLATILE


def test_messages_come_in_time_and_at_the_rate(bag):
    times = {}
    for message in iter_messages(bag):
        times.setdefault(message.topic.name, []).append(message.time_ns)
        content = message.read(bag)
        if message.topic.name.endswith('image_raw'):
            stamp = content.header.stamp
            assert stamp.sec * 10 ** 9 + stamp.nanosec == message.time_ns
            assert content.header.frame_id.endswith('_depth_optical_frame')
    assert np.diff(times['/hooc/left/depth/image_raw']).tolist() == [50_000_000] * 2
    assert times['/hooc/left/depth/image_raw'] == times['/hooc/right/depth/image_raw']
    assert times['/hooc/scene_info'][0] < times['/hooc/left/depth/image_raw'][0]


def test_chosen_topics_only(bag):
    names = {m.topic.name for m in iter_messages(bag, {'/tf_static'})}
    assert names == {'/tf_static'}
    assert list(iter_messages(bag, set())) == []


def test_transforms_are_those_of_the_cameras(bag, scene_set):
    frames = {}
    for message in iter_messages(bag, {'/tf_static'}):
        for stamped in message.read(bag).transforms:
            t, q = stamped.transform.translation, stamped.transform.rotation
            assert stamped.header.frame_id == 'table'
            frames[stamped.child_frame_id] = [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
    for c in scene_set.cameras:
        expected = np.concatenate(pose_from_matrix(c.T_world_camera))
        np.testing.assert_array_equal(frames[f'{c.name}_depth_optical_frame'], expected)


def test_same_scene_same_bytes(scene_set, tmp_path):
    first, second = (write_bag(scene_set.scenes[0], scene_set, tmp_path / name)
                     for name in ('a', 'b'))
    assert (first / '10_1.mcap').read_bytes() == (second / '10_1.mcap').read_bytes()


def test_a_foreign_mcap_reader_opens_it(scene_set, tmp_path):
    bag = write_bag(scene_set.scenes[0], scene_set, tmp_path, repeat=2)
    types = get_typestore(Stores.ROS2_JAZZY)
    with open(bag / '10_1.mcap', 'rb') as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == 'ros2'
        summary = reader.get_summary()
        schemas = {c.topic: summary.schemas[c.schema_id] for c in summary.channels.values()}
        assert schemas['/hooc/left/depth/image_raw'].name == 'sensor_msgs/msg/Image'
        assert schemas['/hooc/left/depth/image_raw'].encoding == 'ros2msg'
        assert b'uint32 step' in schemas['/hooc/left/depth/image_raw'].data
        assert {c.message_encoding for c in summary.channels.values()} == {'cdr'}
        assert summary.statistics.message_count == 4 + 1 + 2 * 2 * 2
        messages = [(c.topic, m.data) for _, c, m in reader.iter_messages()]
    images = [data for topic, data in messages if topic == '/hooc/left/depth/image_raw']
    image = types.deserialize_cdr(images[0], 'sensor_msgs/msg/Image')
    assert (image.encoding, image.width, image.height) == ('16UC1', WIDTH, HEIGHT)
    counts = image.data.view('<u2').reshape(HEIGHT, WIDTH)
    expected = scene_set.scenes[0].depth()[1].depth
    np.testing.assert_allclose(np.where(counts, counts / 1000, np.nan), expected, atol=1e-6)
    text, = (data for topic, data in messages if topic == '/hooc/scene_info')
    info = json.loads(types.deserialize_cdr(text, 'std_msgs/msg/String').data)
    assert info['truth'][0]['category'] == 'box'


def test_a_foreign_sqlite_reader_opens_it(scene_set, tmp_path):
    bag = write_bag(scene_set.scenes[0], scene_set, tmp_path, 'sqlite3')
    with sqlite3.connect(bag / '10_1.db3') as connection:
        rows = dict(connection.execute('select name, type from topics'))
        count, = connection.execute('select count(*) from messages').fetchone()
    assert rows['/hooc/left/depth/camera_info'] == 'sensor_msgs/msg/CameraInfo'
    assert count == 4 + 1 + 2 * 2


@pytest.mark.parametrize('arguments, word', [
    ({'storage': 'zip'}, 'zip'), ({'repeat': 0}, 'repeat'), ({'rate': 0.0}, 'rate'),
    ({'rate': float('nan')}, 'rate')])
def test_bad_arguments(scene_set, tmp_path, arguments, word):
    with pytest.raises(HoocError, match=word):
        write_bag(scene_set.scenes[0], scene_set, tmp_path, **arguments)
    assert list(tmp_path.iterdir()) == []


def test_an_existing_bag_is_kept(scene_set, tmp_path):
    bag = write_bag(scene_set.scenes[0], scene_set, tmp_path)
    before = (bag / '10_1.mcap').read_bytes()
    with pytest.raises(HoocError, match='10_1: exists already'):
        write_bag(scene_set.scenes[0], scene_set, tmp_path)
    assert (bag / '10_1.mcap').read_bytes() == before


def test_a_scene_that_cannot_be_read_leaves_nothing(tmp_path):
    scene_set = make_set(tmp_path / 'set')
    (tmp_path / 'set' / 'scenes' / 'bare' / 'left.png').write_bytes(b'junk')
    with pytest.raises(HoocError, match=r'left\.png'):
        write_bag(scene_set.scene('bare'), scene_set, tmp_path / 'out')
    assert not (tmp_path / 'out').exists()
