# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The same recording in every container that recorders write is read as the same recording."""

import shutil

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.files import iter_messages, oddities, topics
from hooc_perception.io.bags.folder import is_bag
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.bags.salvage import salvage_bag
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter
import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
import zstandard

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_JAZZY)
ROS1.register(get_types_from_msg('geometry_msgs/TransformStamped[] transforms',
                                 'tf2_msgs/msg/TFMessage'))


def ros1_bag(path, messages, compression=None):
    """Write a bag of ROS 1."""
    with Ros1Writer(path) as writer:
        connections = {}
        for topic, kind, time_ns, data in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=ROS1)
            writer.write(connections[topic], time_ns, ROS2.cdr_to_ros1(data, kind))
    return path


def ros2_bag(path, messages, storage='mcap', mode=None):
    """Write a rosbag2 folder."""
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()])
    if mode:
        writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, kind, time_ns, data in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=ROS2)
            writer.write(connections[topic], time_ns, data)
    return path


def mcap_file(path, messages, profile='ros2', encoding='cdr', **options):
    """Write an MCAP file; behind the channel of a topic lies an empty one of the same name."""
    with open(path, 'wb') as file:
        writer = McapWriter(file, **options)
        writer.start(profile=profile)
        channels = {}
        for topic, kind, time_ns, data in messages:
            if topic not in channels:
                name = kind.replace('/msg/', '/') if encoding == 'ros1' else kind
                schema = writer.register_schema(name, f'{profile}msg', b'')
                channels[topic] = writer.register_channel(topic, encoding, schema)
                writer.register_channel(topic, encoding, schema, {'callerid': 'second'})
            writer.add_message(channels[topic], time_ns, data, time_ns)
        writer.finish()
    return path


def without_metadata(folder):
    """Remove metadata.yaml from a bag."""
    (folder / 'metadata.yaml').unlink()
    return folder


def edited(folder, old, new):
    """Replace text in metadata.yaml."""
    text = (folder / 'metadata.yaml').read_text()
    assert old in text
    (folder / 'metadata.yaml').write_text(text.replace(old, new))
    return folder


def renamed(folder):
    """Rename the storage file, which metadata.yaml then does not list any more."""
    file = next(folder.glob('*.mcap'))
    file.rename(folder / 'recording.mcap')
    return folder


def packed(folder):
    """Compress the storage file as rosbag2 does with compression_mode FILE."""
    file = next(folder.glob('*.mcap'))
    file.with_suffix('.mcap.zstd').write_bytes(zstandard.compress(file.read_bytes()))
    file.unlink()
    return folder


def as_ros1(messages):
    """Return the messages serialized as ROS 1 does."""
    return [(topic, kind, time_ns, bytes(ROS2.cdr_to_ros1(data, kind)))
            for topic, kind, time_ns, data in messages]


SOURCES = {
    'ROS 1': lambda p, m: ros1_bag(p / 'b.bag', m),
    'ROS 1 under another name': lambda p, m: ros1_bag(p / 'b.bag', m).rename(p / 'b.bag.orig.bag'),
    'MCAP of ROS 1': lambda p, m: mcap_file(p / 'b.mcap', as_ros1(m), 'ros1', 'ros1'),
    'MCAP without profile': lambda p, m: mcap_file(p / 'b.mcap', m, ''),
    'MCAP without index': lambda p, m: mcap_file(
        p / 'b.mcap', m, index_types=IndexType.NONE, use_statistics=False,
        repeat_channels=False, repeat_schemas=False),
    'MCAP without chunks, not in order': lambda p, m: mcap_file(
        p / 'b.mcap', [*m[:-2], m[-1], m[-2]], use_chunking=False,
        compression=CompressionType.NONE),
    'messages compressed, SQLite': lambda p, m: ros2_bag(p / 'b', m, 'sqlite3', 'MESSAGE'),
    'messages compressed, MCAP': lambda p, m: ros2_bag(p / 'b', m, 'mcap', 'MESSAGE'),
    'messages compressed, metadata lost': lambda p, m: without_metadata(
        ros2_bag(p / 'b', m, 'sqlite3', 'MESSAGE')),
    'file compressed, SQLite': lambda p, m: ros2_bag(p / 'b', m, 'sqlite3', 'FILE'),
    'file compressed, metadata lost': lambda p, m: without_metadata(packed(ros2_bag(p / 'b', m))),
    'metadata lost, SQLite': lambda p, m: without_metadata(ros2_bag(p / 'b', m, 'sqlite3')),
    'metadata lost': lambda p, m: without_metadata(ros2_bag(p / 'b', m)),
    'no storage identifier': lambda p, m: edited(ros2_bag(p / 'b', m),
                                                 'storage_identifier: mcap',
                                                 "storage_identifier: ''"),
    'counts of zero': lambda p, m: edited(ros2_bag(p / 'b', m, 'sqlite3'),
                                          'message_count: 2', 'message_count: 0'),
    'newer metadata': lambda p, m: edited(ros2_bag(p / 'b', m), 'version: 9', 'version: 99'),
    'another QoS in metadata': lambda p, m: edited(ros2_bag(p / 'b', m),
                                                   'offered_qos_profiles: []',
                                                   'offered_qos_profiles: [{depth: 1}]'),
    'file renamed': lambda p, m: renamed(ros2_bag(p / 'b', m)),
    'two channels, one empty': lambda p, m: mcap_file(p / 'b.mcap', m),
}


@pytest.mark.parametrize('kind', SOURCES)
def test_the_same_scene_from_every_source(kind, sound_bag, sound_messages, tmp_path):
    bag = SOURCES[kind](tmp_path, sound_messages)
    assert is_bag(bag)
    known, wanted = topics(bag), topics(sound_bag)
    assert {name: (t.type_name, t.count) for name, t in known.items()} == {
        name: (t.type_name, t.count) for name, t in wanted.items()}
    scene, expected = BagScene(bag), BagScene(sound_bag)
    assert scene.depth_topics == expected.depth_topics
    for view, other in zip(scene.views(), expected.views(), strict=True):
        np.testing.assert_array_equal(view.depth, other.depth)
        np.testing.assert_array_equal(view.camera.K, other.camera.K)
        np.testing.assert_array_equal(view.camera.T_world_camera, other.camera.T_world_camera)


@pytest.mark.parametrize('content', ['', '- 1', '[' * 100_000, 'rosbag2_bagfile_information: {}'])
def test_metadata_that_describes_nothing_is_said_and_not_needed(content, sound_bag, tmp_path):
    bag = shutil.copytree(sound_bag, tmp_path / 'b')
    (bag / 'metadata.yaml').write_text(content)
    assert BagScene(bag).depth_topics == BagScene(sound_bag).depth_topics
    sentence, = oddities(bag)
    assert 'metadata.yaml' in sentence and 'lies there' in sentence or 'without it' in sentence
    assert oddities(sound_bag) == []


def test_parts_of_a_recording_are_read_in_the_order_of_time(sound_messages, tmp_path):
    bag = tmp_path / 'split'
    bag.mkdir()
    half = len(sound_messages) // 2
    mcap_file(bag / 'split_0.mcap', sound_messages[:half])
    mcap_file(bag / 'split_1.mcap', sound_messages[half:])
    assert [m.data for m in iter_messages(bag)] == [data for *_, data in sound_messages]
    (bag / 'split_1.mcap').rename(bag / 'other.mcap')
    with pytest.raises(HoocError, match='several recordings.*other.mcap, split_0.mcap'):
        topics(bag)


def test_a_missing_part_is_said(sound_messages, tmp_path):
    bag = edited(ros2_bag(tmp_path / 'b', sound_messages), '  - b.mcap', '  - b.mcap\n  - c.mcap')
    assert len(topics(bag)) == len({topic for topic, *_ in sound_messages})
    assert 'c.mcap of the recording is missing' in oddities(bag)[0]


def test_a_compression_that_nobody_can_read_is_named(sound_messages, tmp_path):
    bag = edited(ros2_bag(tmp_path / 'b', sound_messages, 'sqlite3', 'MESSAGE'),
                 'compression_format: zstd', 'compression_format: lz4')
    with pytest.raises(HoocError, match='compressed with lz4, and only zstd'):
        topics(bag)


def test_an_interrupted_recording_of_ros_1_needs_an_index(sound_messages, tmp_path):
    bag = ros1_bag(tmp_path / 'b.bag', sound_messages)
    data = bytearray(bag.read_bytes())
    at = data.index(b'index_pos=') + len(b'index_pos=')
    data[at:at + 8] = bytes(8)
    bag.write_bytes(data)
    for use in (topics, salvage_bag):
        with pytest.raises(HoocError, match='rosbag reindex'):
            use(bag)


def test_what_unpacks_without_bound_is_refused(sound_messages, tmp_path, monkeypatch):
    bag = packed(ros2_bag(tmp_path / 'b', sound_messages))
    monkeypatch.setattr('hooc_perception.io.bags.zstd.MAX_UNPACKED_BYTES', 1000)
    monkeypatch.setattr('hooc_perception.io.bags.zstd.MAX_COMPRESSION', 1)
    with pytest.raises(HoocError, match='unpacks to more than'):
        topics(bag)
    bag = ros2_bag(tmp_path / 'c', sound_messages, 'sqlite3', 'MESSAGE')
    monkeypatch.setattr('hooc_perception.io.bags.zstd.MAX_CHUNK_BYTES', 1000)
    with pytest.raises(HoocError, match='message unpacks to more than'):
        list(iter_messages(bag))


@pytest.mark.parametrize('kind', ['messages compressed, SQLite', 'MCAP of ROS 1',
                                  'file compressed, metadata lost'])
def test_salvage_knows_these_sources_too(kind, sound_messages, tmp_path):
    found = salvage_bag(SOURCES[kind](tmp_path, sound_messages))
    assert not found.notes
    assert sorted(m.data for m in found.messages) == sorted(d for *_, d in sound_messages)
