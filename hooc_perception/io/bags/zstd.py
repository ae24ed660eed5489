# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Unpack what rosbag2 compresses: single messages and whole files, both with zstd."""

from functools import lru_cache
from pathlib import Path
import tempfile

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.mcap_format import MAX_CHUNK_BYTES
import zstandard

MAGIC = b'\x28\xb5\x2f\xfd'
SUFFIXES = ('.zstd', '.zst')
# A file may unpack to this many bytes, or to this many times its size: depth does not compress
# better than that.
MAX_UNPACKED_BYTES, MAX_COMPRESSION = 1 << 30, 8
_PIECE = 1 << 20


def unpack_message(data: bytes) -> bytes:
    """
    Return a message without the compression of rosbag2; CDR never begins like zstd.

    :raises HoocError: if it unpacks to more than any recorder writes.
    """
    if data[:4] != MAGIC:
        return data
    with zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(data) as stream:
        unpacked = stream.read(MAX_CHUNK_BYTES + 1)
    if len(unpacked) > MAX_CHUNK_BYTES:
        raise HoocError('a compressed message unpacks to more than any recorder writes; get the '
                        'bag from its source again')
    return unpacked


def unpack_file(path: Path) -> Path:
    """
    Return a temporary copy of a file without its compression; it lives as long as the process.

    :raises HoocError: if it unpacks to more than a recorder packs into such a file.
    """
    stat = path.stat()
    folder, name = _unpacked(path.resolve(), stat.st_mtime_ns, stat.st_size)
    return Path(folder.name) / name


@lru_cache(maxsize=8)
def _unpacked(path: Path, _mtime_ns: int, size: int) -> tuple[
        'tempfile.TemporaryDirectory[str]', str]:
    """Unpack a file once; return the folder, which is removed with its last reference."""
    folder = tempfile.TemporaryDirectory(prefix='hooc_bag_')
    limit = max(MAX_UNPACKED_BYTES, MAX_COMPRESSION * size)
    total = 0
    with open(path, 'rb') as source, open(Path(folder.name) / path.stem, 'wb') as target:
        stream = zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(
            source, read_across_frames=True)
        while piece := stream.read(_PIECE):
            total += len(piece)
            if total > limit:
                raise HoocError(f'{path}: it unpacks to more than {limit >> 20} MB, which no '
                                'recorder writes; get the bag from its source again')
            target.write(piece)
    return folder, path.stem
