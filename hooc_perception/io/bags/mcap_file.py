# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
What rosbags leaves to be done with an MCAP file: checksums, bounds, the search for what is left.

The format: magic, then records of an opcode, a length and that many bytes; most messages lie
in chunk records (https://mcap.dev/spec).
"""

from collections import Counter
from dataclasses import dataclass, field
import io
import struct
from zlib import crc32

from hooc_perception.errors import HoocError
import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Message, Schema
import zstandard

MAGIC = b'\x89MCAP0\r\n'
# ROS writes chunks below one megabyte; a bigger one than this was made to fill the memory.
MAX_CHUNK_BYTES = 1 << 28
# What is read into memory as a whole, to be sealed or salvaged.
MOST_BYTES = 4 << 30
# Messages of more than so many bytes, and of more than so many times the size of their file, are
# no more salvaged: depth does not pack so well.
MOST_SALVAGED, MOST_PACKED = 1 << 30, 8
MOST_NOTES = 1000
_HEAD = struct.Struct('<BQ')
_CRC_AT = 24            # of a chunk's content: behind two times and the size
_PIECE = 1 << 20


def records(data, start=len(MAGIC)):
    """Yield (opcode, offset of the content, its length) up to the first that is not whole."""
    at = start
    while at + _HEAD.size <= len(data):
        opcode, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if not 1 <= opcode <= 0x0F or at + length > len(data):
            return
        yield opcode, at, length
        at += length


def seal(path):
    """
    Write the checksums into an MCAP file that rosbags has written: it leaves them zero.

    With them a bit that flips in any chunk or in the index is found when the file is read.
    """
    if path.stat().st_size > MOST_BYTES:
        return
    data = bytearray(path.read_bytes())
    for opcode, at, length in list(records(data)):
        if opcode == Opcode.CHUNK:
            chunk = _chunk(data, at, length)
            struct.pack_into('<I', data, at + _CRC_AT, crc32(_unpacked(chunk)))
        elif opcode == Opcode.DATA_END:
            struct.pack_into('<I', data, at, crc32(data[:at - _HEAD.size]))
        elif opcode == Opcode.FOOTER:
            (summary_start,) = struct.unpack_from('<Q', data, at)
            if summary_start:
                struct.pack_into('<I', data, at + 16, crc32(data[summary_start:at + 16]))
    path.write_bytes(data)


def check(path):
    """
    Raise HoocError where a file's index is damaged or it would unpack to more than is sane.

    Chunks are held against their checksums by rosbags when they are read.
    """
    with open(path, 'rb') as file:
        file.seek(0, io.SEEK_END)
        size = file.tell()
        file.seek(max(0, size - 37))
        tail = file.read()
        if len(tail) == 37 and tail[0] == Opcode.FOOTER and tail.endswith(MAGIC):
            summary_start, _, crc = struct.unpack_from('<QQI', tail, 9)
            if crc and 0 < summary_start < size:
                file.seek(summary_start)
                if crc32(file.read(size - 12 - summary_start)) != crc:
                    raise HoocError(f'{path}: the index is damaged (its checksum differs); copy '
                                    'it again, or save what is left with hooc doctor --salvage')
        file.seek(len(MAGIC))
        while len(head := file.read(_HEAD.size)) == _HEAD.size:
            opcode, length = _HEAD.unpack(head)
            start = file.tell()
            if start + length > size:
                break
            if opcode == Opcode.CHUNK:
                _check_chunk(file.read(min(length, 64)), file, start, length, path)
            file.seek(start + length)


def _check_chunk(head, file, start, length, path):
    """Raise HoocError where a compressed chunk holds more than it says, or than is sane."""
    if len(head) < 32:
        return
    size, _, name_length = struct.unpack_from('<QII', head, 16)
    name = bytes(head[32:32 + min(name_length, 8)])
    if size > MAX_CHUNK_BYTES:
        raise HoocError(f'{path}: a chunk says that it unpacks to {size} bytes; this is no bag '
                        'of a recorder')
    if name in (b'zstd', b'lz4'):
        file.seek(start + 32 + name_length + 8)
        packed = file.read(max(0, length - 40 - name_length))
        if _unpacked_size(packed, name.decode(), size) > size:
            raise HoocError(f'{path}: a chunk unpacks to more than the {size} bytes that it says; '
                            'this is no bag of a recorder')


def _unpacked_size(packed, compression, limit):
    """Return how much a compressed chunk unpacks to, not counting beyond `limit`; 0 = damaged."""
    total = 0
    try:
        with _opened(packed, compression) as stream:
            while total <= limit and (piece := stream.read(_PIECE)):
                total += len(piece)
    except (zstandard.ZstdError, RuntimeError, EOFError, OSError):
        return 0        # reading it says what is wrong
    return total


def _opened(packed, compression):
    if compression == 'lz4':
        return lz4.frame.open(io.BytesIO(packed))
    return zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(
        io.BytesIO(packed), read_across_frames=True)


def _chunk(data, at, length):
    return Chunk.read(ReadDataStream(io.BytesIO(data[at:at + length])))


def _unpacked(chunk):
    """Return the bytes in a chunk; ValueError where they do not add up."""
    if not chunk.compression:
        return chunk.data
    if chunk.uncompressed_size > MAX_CHUNK_BYTES or chunk.compression not in ('zstd', 'lz4'):
        raise ValueError('a chunk that no recorder writes')
    with _opened(chunk.data, chunk.compression) as stream:
        return stream.read(chunk.uncompressed_size)


@dataclass
class Salvage:
    """
    What could be read of damaged files.

    :ivar size: of the files, in bytes; bounds what is read.
    :ivar keep: whether messages are kept or only counted.
    :ivar readable: callable (type, CDR bytes) -> whether a message can be decoded.
    :ivar messages: list of (topic, message type, CDR bytes, time in ns, latched).
    :ivar counts: Counter {message type: messages}.
    :ivar notes: what was wrong, one sentence part each.
    :ivar full: whether there was more than can be meant; the rest was left.
    """

    size: int = 0
    keep: bool = True
    readable: object = None
    messages: list = field(default_factory=list)
    counts: Counter = field(default_factory=Counter)
    notes: list = field(default_factory=list)
    full: bool = False
    bytes: int = 0

    def note(self, text):
        """Note what was wrong."""
        if len(self.notes) < MOST_NOTES:
            self.notes.append(text)

    def add(self, topic, kind, data, time_ns, latched):
        """Take in a message."""
        limit = max(MOST_SALVAGED, MOST_PACKED * self.size)
        self.bytes += len(data)
        if self.bytes > limit:
            self.full = True
            self.notes.insert(0, f'after {limit >> 20} MB of messages the rest is left, since no '
                              f'recorder packs so much into {self.size} bytes')
        elif self.readable and not self.readable(kind, data):
            self.note(f'a message of {topic} is lost')
        else:
            self.counts[kind] += 1
            if self.keep:
                self.messages.append((topic, kind, data, time_ns, latched))


def salvage(path, found):
    """
    Add to a Salvage what can be read of an MCAP file, however it is damaged.

    Without its index, from the front; after a damaged record from the next whole chunk on;
    the last chunk of a file that was cut off, up to the cut.
    """
    if path.stat().st_size > MOST_BYTES:
        raise HoocError(f'{path}: {path.stat().st_size} bytes are more than can be salvaged at '
                        'once; cut the file into pieces, which may begin and end anywhere')
    data = path.read_bytes()
    schemas, channels = {}, {}
    at = len(MAGIC) if data.startswith(MAGIC) else max(0, _next_chunk(data, 0))
    while at < len(data):
        end = at
        for opcode, start, length in records(data, at):
            end = start + length
            if opcode == Opcode.CHUNK:
                _take_chunk(data[start:end], schemas, channels, found, at)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
                _take(opcode, data[start:end], schemas, channels, found)
            if found.full:
                return
        if end >= len(data) - len(MAGIC):
            break
        found.note(f'damaged at byte {end}')
        at = _next_chunk(data, end + 1)
        if at < 0:
            _take_chunk(data[end + _HEAD.size:], schemas, channels, found, end)
            break


def _next_chunk(data, at):
    """Return where the next chunk record seems to begin, -1 for none."""
    while (at := data.find(bytes([Opcode.CHUNK]), at)) >= 0:
        if at + 50 <= len(data):
            _, length, begin, end, size, _, name = struct.unpack_from('<BQQQQII', data, at)
            if (at + 9 + length <= len(data) and begin <= end and name in (0, 3, 4)
                    and 0 < size <= MAX_CHUNK_BYTES and length > 40):
                return at
        at += 1
    return -1


def _take_chunk(content, schemas, channels, found, at):
    """Add what a chunk holds, whole or cut off."""
    try:
        chunk = _chunk(content, 0, len(content))
        inside = _unpacked(chunk)
        if chunk.uncompressed_crc and crc32(inside) != chunk.uncompressed_crc:
            found.note(f'a bit is wrong somewhere in the chunk at byte {at}')
    except Exception:       # cut off, or its lengths are damaged: what follows the head
        if len(content) < 40 or struct.unpack_from('<I', content, 28)[0]:
            found.note(f'a chunk is lost at byte {at}')
            return
        inside = content[40:]
        found.note(f'the chunk at byte {at} is not whole')
    for opcode, start, length in records(inside, 0):
        if found.full:
            return
        _take(opcode, inside[start:start + length], schemas, channels, found)


def _take(opcode, content, schemas, channels, found):
    """Add one record; what it lacks or garbles costs only itself."""
    try:
        stream = ReadDataStream(io.BytesIO(content))
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            schemas[schema.id] = schema.name
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(stream)
            # YAML of any version: 1 or transient_local.
            profile = channel.metadata.get('offered_qos_profiles', '')
            latched = 'durability: 1' in profile or 'durability: transient_local' in profile
            channels[channel.id] = channel.topic, schemas[channel.schema_id], latched
        elif opcode == Opcode.MESSAGE:
            message = Message.read(stream, len(content))
            topic, kind, latched = channels[message.channel_id]
            found.add(topic, kind, message.data, message.log_time, latched)
    except Exception as error:      # the bytes are damaged ones
        found.note(f'a record is lost ({type(error).__name__})')
