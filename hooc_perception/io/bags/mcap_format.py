# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Records and chunks of MCAP files, below the level at which rosbags reads them.

A file is a magic number, then records of an opcode, a length and that many bytes; most messages
lie in chunk records (https://mcap.dev/spec).
"""

from collections.abc import Iterator
import io
import struct
from typing import Any

import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.records import Chunk
import zstandard

MAGIC = b'\x89MCAP0\r\n'
# Opcode and length of a record.
RECORD_HEAD = struct.Struct('<BQ')
# ROS writes chunks of less than one megabyte; a bigger one than this is an attack on memory.
MAX_CHUNK_BYTES = 1 << 28
# Largest file that is read into memory as a whole.
MAX_FILE_BYTES = 4 << 30


def records(data: bytes | bytearray, start: int = len(MAGIC)) -> Iterator[tuple[int, int, int]]:
    """Yield (opcode, offset of the content, its length) up to the first incomplete record."""
    at = start
    while at + RECORD_HEAD.size <= len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        at += RECORD_HEAD.size
        if not 1 <= opcode <= 0x0F or at + length > len(data):
            return
        yield opcode, at, length
        at += length


def read_chunk(content: bytes | bytearray) -> Chunk:
    """Return the chunk with this record content."""
    return Chunk.read(ReadDataStream(io.BytesIO(content)))


def decompress_chunk(chunk: Chunk) -> bytes:
    """Return the records in a chunk; raise ValueError where no recorder writes such a chunk."""
    if not chunk.compression:
        return chunk.data
    if chunk.uncompressed_size > MAX_CHUNK_BYTES or chunk.compression not in ('zstd', 'lz4'):
        raise ValueError('a chunk that no recorder writes')
    with open_decompressor(chunk.data, chunk.compression) as stream:
        return stream.read(chunk.uncompressed_size)


def open_decompressor(packed: bytes, compression: str) -> Any:
    """Return a readable stream (a context manager) over 'lz4' or 'zstd' bytes."""
    if compression == 'lz4':
        return lz4.frame.open(io.BytesIO(packed))
    return zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(
        io.BytesIO(packed), read_across_frames=True)
