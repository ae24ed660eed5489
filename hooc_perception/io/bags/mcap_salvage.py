# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Recover the messages that are left in a damaged MCAP file."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
import io
from pathlib import Path
import struct
from typing import NamedTuple
from zlib import crc32

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.mcap_format import (
    decompress_chunk,
    MAGIC,
    MAX_CHUNK_BYTES,
    MAX_FILE_BYTES,
    read_chunk,
    RECORD_HEAD,
    records,
)
from hooc_perception.io.bags.storage import as_cdr, ros2_type
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Message, Schema

# Salvaging stops where the messages exceed both this many bytes and this many times the size of
# their file: depth does not compress that well.
MAX_SALVAGED_BYTES, MAX_COMPRESSION = 1 << 30, 8
MAX_NOTES = 1000


class SalvagedMessage(NamedTuple):
    """A recovered message: topic, message type, CDR bytes, time in ns, whether latched."""

    topic: str
    type_name: str
    data: bytes
    time_ns: int
    latched: bool


@dataclass
class Salvage:
    """
    What could be recovered from damaged files.

    :ivar size: of the files, in bytes; bounds what is read.
    :ivar keep: whether messages are kept or only counted.
    :ivar readable: callable (type, CDR bytes) -> whether a message can be decoded.
    :ivar counts: messages by type.
    :ivar notes: what was wrong, a part of a sentence each.
    :ivar full: whether the size limit ended the search before the end of the files.
    :ivar total_bytes: sum of the messages' sizes.
    """

    size: int = 0
    keep: bool = True
    readable: Callable[[str, bytes], bool] | None = None
    messages: list[SalvagedMessage] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    notes: list[str] = field(default_factory=list)
    full: bool = False
    total_bytes: int = 0

    def note(self, text: str) -> None:
        """Add a note on what was wrong."""
        if len(self.notes) < MAX_NOTES:
            self.notes.append(text)

    def add(self, message: SalvagedMessage) -> None:
        """Add a message, or a note if it cannot be decoded."""
        limit = max(MAX_SALVAGED_BYTES, MAX_COMPRESSION * self.size)
        self.total_bytes += len(message.data)
        if self.total_bytes > limit:
            self.full = True
            self.notes.insert(0, f'the rest is skipped after {limit >> 20} MB of messages, since '
                              f'no recorder packs that much into {self.size} bytes')
        elif self.readable and not self.readable(message.type_name, message.data):
            self.note(f'a message of {message.topic} is lost')
        else:
            self.counts[message.type_name] += 1
            if self.keep:
                self.messages.append(message)


def salvage_mcap(path: Path, found: Salvage) -> None:
    """
    Add to a Salvage the readable messages of an MCAP file with any kind of damage.

    The file is read from the front without its index, after a damaged record from the next
    complete chunk on, and in the last chunk of a truncated file up to the cut.
    """
    if path.stat().st_size > MAX_FILE_BYTES:
        raise HoocError(f'{path}: {path.stat().st_size} bytes are too many to be salvaged at '
                        'once; cut the file into pieces, which may begin and end anywhere')
    _McapSalvager(found).read_file(path.read_bytes())


class _McapSalvager:
    """Reads records in any state; what it learns of schemas and channels holds for later ones."""

    def __init__(self, found: Salvage) -> None:
        self._found = found
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str, bool, str]] = {}

    def read_file(self, data: bytes) -> None:
        """Add the messages of a whole file."""
        found = self._found
        at = len(MAGIC) if data.startswith(MAGIC) else max(0, _next_chunk(data, 0))
        while at < len(data):
            end = at
            for opcode, start, length in records(data, at):
                end = start + length
                if opcode == Opcode.CHUNK:
                    self._read_chunk(data[start:end], at)
                elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
                    self._read_record(opcode, data[start:end])
                if found.full:
                    return
            if end >= len(data) - len(MAGIC):
                break
            found.note(f'damaged at byte {end}')
            at = _next_chunk(data, end + 1)
            if at < 0:
                self._read_chunk(data[end + RECORD_HEAD.size:], end)
                break

    def _read_chunk(self, content: bytes, at: int) -> None:
        """Add the messages of a chunk, complete or cut off, at byte `at` of the file."""
        found = self._found
        try:
            chunk = read_chunk(content)
            inside = decompress_chunk(chunk)
            if chunk.uncompressed_crc and crc32(inside) != chunk.uncompressed_crc:
                found.note(f'a bit is wrong somewhere in the chunk at byte {at}')
        except Exception:       # cut off, or its lengths are damaged: use what follows the head
            if len(content) < 40 or struct.unpack_from('<I', content, 28)[0]:
                found.note(f'a chunk is lost at byte {at}')
                return
            inside = content[40:]
            found.note(f'the chunk at byte {at} is not whole')
        for opcode, start, length in records(inside, 0):
            if found.full:
                return
            self._read_record(opcode, inside[start:start + length])

    def _read_record(self, opcode: int, content: bytes) -> None:
        """Add one record; a damaged record does not affect others."""
        try:
            stream = ReadDataStream(io.BytesIO(content))
            if opcode == Opcode.SCHEMA:
                schema = Schema.read(stream)
                self._schemas[schema.id] = schema.name
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(stream)
                # Profiles are YAML of any version: 1 or transient_local.
                profile = channel.metadata.get('offered_qos_profiles', '')
                latched = 'durability: 1' in profile or 'durability: transient_local' in profile
                self._channels[channel.id] = (
                    channel.topic, ros2_type(self._schemas[channel.schema_id]), latched,
                    channel.message_encoding)
            elif opcode == Opcode.MESSAGE:
                message = Message.read(stream, len(content))
                topic, type_name, latched, encoding = self._channels[message.channel_id]
                data = as_cdr(message.data, type_name, encoding)
                self._found.add(SalvagedMessage(topic, type_name, data, message.log_time,
                                                latched))
        except Exception as error:      # damaged bytes fail in many ways
            self._found.note(f'a record is lost ({type(error).__name__})')


def _next_chunk(data: bytes, at: int) -> int:
    """Return the offset of the next plausible chunk record, -1 for none."""
    while (at := data.find(bytes([Opcode.CHUNK]), at)) >= 0:
        if at + 50 <= len(data):
            _, length, begin, end, size, _, name = struct.unpack_from('<BQQQQII', data, at)
            if (at + 9 + length <= len(data) and begin <= end and name in (0, 3, 4)
                    and 0 < size <= MAX_CHUNK_BYTES and length > 40):
                return at
        at += 1
    return -1
