# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Write and verify what rosbags does not: checksums of MCAP files, bounds on their chunks."""

import io
from pathlib import Path
import struct
from typing import BinaryIO
from zlib import crc32

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.mcap_format import (
    decompress_chunk,
    MAGIC,
    MAX_CHUNK_BYTES,
    MAX_FILE_BYTES,
    open_decompressor,
    read_chunk,
    RECORD_HEAD,
    records,
)
from mcap.opcode import Opcode
import zstandard

# Offset of the checksum in a chunk's content: behind two times and the size.
_CHUNK_CRC_AT = 24
_FOOTER_BYTES = 37
_PIECE = 1 << 20


def write_checksums(path: Path) -> None:
    """
    Fill in the checksums of an MCAP file, which rosbags leaves at zero.

    With them, a flipped bit in any chunk or in the index is detected when the file is read.
    """
    if path.stat().st_size > MAX_FILE_BYTES:
        return
    data = bytearray(path.read_bytes())
    for opcode, at, length in list(records(data)):
        if opcode == Opcode.CHUNK:
            chunk = read_chunk(data[at:at + length])
            struct.pack_into('<I', data, at + _CHUNK_CRC_AT, crc32(decompress_chunk(chunk)))
        elif opcode == Opcode.DATA_END:
            struct.pack_into('<I', data, at, crc32(data[:at - RECORD_HEAD.size]))
        elif opcode == Opcode.FOOTER:
            (summary_start,) = struct.unpack_from('<Q', data, at)
            if summary_start:
                struct.pack_into('<I', data, at + 16, crc32(data[summary_start:at + 16]))
    path.write_bytes(data)


def check_mcap(path: Path) -> None:
    """
    Raise HoocError if a file's index is damaged or a chunk unpacks to an implausible size.

    The checksums of the chunks are verified by rosbags when they are read.
    """
    with open(path, 'rb') as file:
        file.seek(0, io.SEEK_END)
        size = file.tell()
        _check_index(file, size, path)
        file.seek(len(MAGIC))
        while len(head := file.read(RECORD_HEAD.size)) == RECORD_HEAD.size:
            opcode, length = RECORD_HEAD.unpack(head)
            start = file.tell()
            if start + length > size:
                break
            if opcode == Opcode.CHUNK:
                _check_chunk(file.read(min(length, 64)), file, start, length, path)
            file.seek(start + length)


def _check_index(file: BinaryIO, size: int, path: Path) -> None:
    """Raise HoocError if the index at the end of the file does not match its checksum."""
    file.seek(max(0, size - _FOOTER_BYTES))
    tail = file.read()
    if len(tail) != _FOOTER_BYTES or tail[0] != Opcode.FOOTER or not tail.endswith(MAGIC):
        return
    summary_start, _, crc = struct.unpack_from('<QQI', tail, RECORD_HEAD.size)
    if not crc or not 0 < summary_start < size:
        return
    file.seek(summary_start)
    if crc32(file.read(size - 12 - summary_start)) != crc:
        raise HoocError(f'{path}: the index is damaged (its checksum differs); copy the file '
                        'again, or save what is left with hooc doctor --salvage')


def _check_chunk(head: bytes, file: BinaryIO, start: int, length: int, path: Path) -> None:
    """Raise HoocError if a chunk unpacks to more than it declares or to more than the limit."""
    if len(head) < 32:
        return
    size, _, name_length = struct.unpack_from('<QII', head, 16)
    name = bytes(head[32:32 + min(name_length, 8)])
    if size > MAX_CHUNK_BYTES:
        raise HoocError(f'{path}: a chunk says that it unpacks to {size} bytes, which no recorder '
                        'writes; get the bag from its source again')
    if name in (b'zstd', b'lz4'):
        file.seek(start + 32 + name_length + 8)
        packed = file.read(max(0, length - 40 - name_length))
        if _unpacked_size(packed, name.decode(), size) > size:
            raise HoocError(f'{path}: a chunk unpacks to more than the {size} bytes that it says, '
                            'which no recorder writes; get the bag from its source again')


def _unpacked_size(packed: bytes, compression: str, limit: int) -> int:
    """Return the unpacked size of a chunk, counted little beyond `limit`; 0 = damaged."""
    total = 0
    try:
        with open_decompressor(packed, compression) as stream:
            while total <= limit and (piece := stream.read(_PIECE)):
                total += len(piece)
    except (zstandard.ZstdError, RuntimeError, EOFError, OSError):
        return 0        # the error message comes when it is read
    return total
