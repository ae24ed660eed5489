# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Damaged bags: found out by their checksums, bounded, and saved as far as they go."""

import io
import shutil
import struct

from hooc_perception.diagnosis.bag import check_bag
from hooc_perception.errors import HoocError
from hooc_perception.io.bags import mcap_format, mcap_salvage
from hooc_perception.io.bags.files import iter_messages, topics, TYPES
from hooc_perception.io.bags.raw_writer import RawBagWriter
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.bags.salvage import salvage_bag, write_salvaged
from hooc_perception.io.depth_encodings import decode_depth
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
import numpy as np
import pytest
import zstandard

IMAGE = 'sensor_msgs/msg/Image'


@pytest.fixture(scope='module')
def demo(repository, tmp_path_factory):
    """Return a bag of the bundled scene, written anew, so that it has checksums."""
    bag = repository / 'bags' / 'demo'
    if not (bag / 'metadata.yaml').is_file():
        pytest.skip('no bundled scene')
    out = tmp_path_factory.mktemp('bag') / 'demo'
    with RawBagWriter(out) as writer:
        for m in iter_messages(bag):
            writer.write(m.topic.name, m.topic.type_name, m.data, m.time_ns, m.topic.latched)
    return out


def copy(bag, tmp_path):
    """Return (copy of a bag, its file)."""
    out = tmp_path / bag.name
    shutil.copytree(bag, out)
    return out, next(f for f in out.iterdir() if f.suffix in ('.mcap', '.db3'))


def contents(bag):
    return sorted((m.time_ns, m.topic.name, m.topic.type_name, m.topic.latched, m.data)
                  for m in iter_messages(bag))


def test_an_independent_reader_agrees_with_all_checksums(demo):
    with open(demo / 'demo.mcap', 'rb') as file:
        chunks = [r for r in StreamReader(file, emit_chunks=True, validate_crcs=True).records
                  if type(r).__name__ == 'Chunk']
        assert chunks and all(chunk.uncompressed_crc for chunk in chunks)
        file.seek(0)
        reader = make_reader(file, validate_crcs=True)
        assert sum(1 for _ in reader.iter_messages()) == reader.get_summary().statistics.\
            message_count


def test_a_bit_that_flips_anywhere_in_the_messages_is_found(demo, tmp_path):
    bag, file = copy(demo, tmp_path)
    data = file.read_bytes()
    chunks = [(at, length) for opcode, at, length in mcap_format.records(data) if opcode == 6]
    rng = np.random.default_rng(0)
    for _ in range(20):
        start, length = chunks[rng.integers(len(chunks))]
        at = int(rng.integers(start + 40, start + length))
        file.write_bytes(data[:at] + bytes([data[at] ^ 1 << int(rng.integers(8))])
                         + data[at + 1:])
        with pytest.raises(HoocError, match='checksum'):
            list(iter_messages(bag))


def test_a_bit_that_flips_in_the_index_is_found(demo, tmp_path):
    bag, file = copy(demo, tmp_path)
    data = bytearray(file.read_bytes())
    data[-100] ^= 4
    file.write_bytes(data)
    with pytest.raises(HoocError, match='index is damaged'):
        topics(bag)


def test_a_whole_bag_is_salvaged_whole(demo, tmp_path):
    found = salvage_bag(demo)
    assert found.notes == []
    write_salvaged(found, tmp_path / 'again')
    assert contents(tmp_path / 'again') == contents(demo)


@pytest.mark.parametrize('share', [0.3, 0.6, 0.9, 0.999])
def test_a_file_that_was_cut_off_is_saved_up_to_the_cut(demo, tmp_path, share):
    bag, file = copy(demo, tmp_path)
    data = file.read_bytes()
    file.write_bytes(data[:int(share * len(data))])
    (bag / 'metadata.yaml').unlink()
    found = salvage_bag(bag)
    assert found.notes
    kept = [(m[3], m[0], m[1], m[4], m[2]) for m in found.messages]
    whole = contents(demo)
    assert set(kept) <= set(whole)
    images = {m[0] for m in found.messages if m[0].endswith('image_raw')}
    # 434 kB an image of the 1.3 MB: what lies before the cut is there.
    assert len(images) >= int(share * len(data) / 434_200) - 1
    if share > 0.9:
        write_salvaged(found, tmp_path / 'again')
        assert len(BagScene(tmp_path / 'again').views()) == 3


def test_what_follows_a_damaged_record_is_found_again(demo, tmp_path):
    bag = tmp_path / 'long'
    with RawBagWriter(bag) as writer:
        for i in range(3):
            for m in iter_messages(demo):
                writer.write(m.topic.name, m.topic.type_name, m.data, m.time_ns + i,
                             m.topic.latched)
    file = bag / 'long.mcap'
    data = bytearray(file.read_bytes())
    chunks = [at for opcode, at, _ in mcap_format.records(data) if opcode == 6]
    assert len(chunks) >= 3
    struct.pack_into('<Q', data, chunks[1] - 8, 2 ** 40)    # its length
    file.write_bytes(data)
    found = salvage_bag(bag)
    whole = 3 * len(contents(demo))
    assert whole * 0.4 < len(found.messages) < whole
    assert any('damaged at byte' in note for note in found.notes)
    assert max(m[3] for m in found.messages) > max(m[0] for m in contents(demo))


def test_databases_are_salvaged_row_by_row(tmp_path, demo):
    bag = tmp_path / 'base'
    with RawBagWriter(bag, 'sqlite3') as writer:
        for i in range(4):
            for m in iter_messages(demo):
                writer.write(m.topic.name, m.topic.type_name, m.data, m.time_ns + i,
                             m.topic.latched)
    file = next(bag.glob('*.db3'))
    data = file.read_bytes()
    assert len(salvage_bag(bag).messages) == 4 * len(contents(demo))
    file.write_bytes(data[:int(0.6 * len(data))])
    with pytest.raises(HoocError):
        list(iter_messages(bag))
    found = salvage_bag(bag)
    assert found.notes and len(found.messages) > len(contents(demo))
    (message, *_) = [m for m in found.messages if m[0].endswith('image_raw')]
    image = TYPES.deserialize_cdr(message[2], message[1])
    assert np.isfinite(decode_depth(image.data, image.height, image.width, image.encoding,
                                    image.step)).any()


@pytest.mark.parametrize('content', [b'', b'x', b'\x89MCAP0\r\n', bytes(10_000),
                                     b'SQLite format 3\0' + bytes(1000)])
@pytest.mark.parametrize('suffix', ['.mcap', '.db3'])
def test_nothing_is_salvaged_from_nothing(tmp_path, content, suffix):
    file = tmp_path / f'b{suffix}'
    file.write_bytes(content)
    assert salvage_bag(file).messages == []


def test_no_file_at_all(tmp_path):
    with pytest.raises(HoocError, match='nothing can be salvaged'):
        salvage_bag(tmp_path)


@pytest.mark.parametrize('compression', ['zstd', 'lz4'])
def test_recorded_compression_is_read_and_salvaged(demo, tmp_path, compression):
    path = tmp_path / 'packed.mcap'
    kind = {'zstd': CompressionType.ZSTD, 'lz4': CompressionType.LZ4}[compression]
    with open(demo / 'demo.mcap', 'rb') as source, open(path, 'wb') as target:
        writer = Writer(target, compression=kind)
        writer.start('ros2')
        known = {}
        for schema, channel, message in make_reader(source).iter_messages():
            if channel.id not in known:
                known[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding,
                    writer.register_schema(schema.name, schema.encoding, schema.data),
                    channel.metadata)
            writer.add_message(known[channel.id], message.log_time, message.data,
                               message.publish_time)
        writer.finish()
    assert sorted(m.data for m in iter_messages(path)) == sorted(m[-1] for m in contents(demo))
    assert len(salvage_bag(path).messages) == len(contents(demo))


@pytest.mark.parametrize('kind', ['says less', 'says much'])
def test_a_chunk_that_would_fill_the_memory_is_refused(tmp_path, kind):
    packed = zstandard.ZstdCompressor().compress(bytes(2 ** 28))
    size = 1000 if kind == 'says less' else 2 ** 40
    content = struct.pack('<QQQI', 0, 1, size, 0) + struct.pack('<I', 4) + b'zstd' + struct.pack(
        '<Q', len(packed)) + packed
    file = io.BytesIO()
    file.write(mcap_format.MAGIC)
    for opcode, body in ((1, struct.pack('<I', 4) + b'ros2' + struct.pack('<I', 0)), (6, content),
                         (15, bytes(4)), (2, bytes(20))):
        file.write(struct.pack('<BQ', opcode, len(body)) + body)
    file.write(mcap_format.MAGIC)
    path = tmp_path / 'bomb.mcap'
    path.write_bytes(file.getvalue())
    with pytest.raises(HoocError, match='which no recorder writes'):
        topics(path)
    assert salvage_bag(path).messages == []


def test_messages_that_would_fill_the_memory_are_left_and_a_check_keeps_none(
        tmp_path, monkeypatch):
    limit = 1 << 20
    monkeypatch.setattr(mcap_salvage, 'MAX_SALVAGED_BYTES', limit)
    size = 100_000
    kinds = TYPES.types
    head = kinds['std_msgs/msg/Header'](kinds['builtin_interfaces/msg/Time'](1, 0), 'x')
    data = bytes(TYPES.serialize_cdr(
        kinds[IMAGE](head, 1, size, 'mono8', 0, size, np.zeros(size, np.uint8)), IMAGE))
    path = tmp_path / 'bomb.mcap'
    with open(path, 'wb') as file:
        writer = Writer(file, compression=CompressionType.ZSTD, chunk_size=size)
        writer.start('ros2')
        channel = writer.register_channel('/a/depth/image_raw', 'cdr', writer.register_schema(
            IMAGE, 'ros2msg', b''))
        for i in range(100):
            writer.add_message(channel, i, data, i)
        writer.finish()
    path.write_bytes(path.read_bytes()[:-60])
    assert path.stat().st_size < limit / 8
    kept, counted = salvage_bag(path), salvage_bag(path, keep=False)
    assert sum(len(m[2]) for m in kept.messages) <= limit and len(kept.messages) == 10
    assert counted.messages == [] and counted.counts == {IMAGE: 10}
    assert any('the rest is skipped' in note for note in kept.notes)
    text = '\n'.join(f.text for f in check_bag(path))
    assert 'the rest is skipped' in text and '10 of them images' in text


def test_notes_are_bounded(demo, tmp_path):
    path = tmp_path / 'notes.mcap'
    path.write_bytes(mcap_format.MAGIC + struct.pack('<BQ', 5, 0) * 5000)
    assert 0 < len(salvage_bag(path).notes) <= mcap_salvage.MAX_NOTES
