# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read and write grey PNG images; images of unknown origin are checked before decoding."""

from pathlib import Path
import struct
import zlib

import cv2
from hooc_perception.core.arrays import AnyArray, Float32Array
from hooc_perception.errors import HoocError
from hooc_perception.io.depth_encodings import depth_from_counts
from hooc_perception.io.scenes import files
import numpy as np

MAX_PNG_BYTES = 64 << 20
_COLOUR_TYPES = {0: 'grey', 2: 'colour', 3: 'palette', 4: 'grey with alpha',
                 6: 'colour with alpha'}


def read_png(path: str | Path, width: int, height: int, bits: int) -> AnyArray:
    """
    Return the (height, width) uint16 or uint8 pixels of a grey PNG with 16 or 8 bits.

    Header, size and checksums are checked before decoding: OpenCV would return the readable
    part of a truncated file without an error.
    """
    data = files.read_bytes(path, MAX_PNG_BYTES)
    found_width, found_height, found_bits, colour_type = _png_header(path, data)
    if (found_bits, colour_type) != (bits, 0):
        raise HoocError(f'{path}: a {found_bits}-bit {_COLOUR_TYPES.get(colour_type, "unknown")} '
                        f'PNG; save it as a {bits}-bit grey PNG')
    if (found_width, found_height) != (width, height):
        raise HoocError(f'{path}: the image has {found_width} x {found_height} pixels, but its '
                        f'camera says width {width} and height {height}; correct one of them')
    if not _is_complete(data):
        raise HoocError(f'{path}: the PNG is truncated or damaged; copy or record it again')
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None or pixels.shape != (height, width):
        raise HoocError(f'{path}: the PNG cannot be decoded; copy or record it again')
    return pixels


def png_size(path: str | Path) -> tuple[int, int]:
    """Return the (width, height) in a PNG's header."""
    return _png_header(path, files.read_bytes(path, MAX_PNG_BYTES))[:2]


def read_depth_png(path: str | Path, width: int, height: int, unit: float) -> Float32Array:
    """Return (H, W) float32 metres, NaN = none, of a 16-bit PNG with `unit` metres per count."""
    counts = read_png(path, width, height, 16)
    if not counts.any():
        raise HoocError(f'{path}: every depth pixel is 0, so the image holds no reading; '
                        'record this view again or remove the scene')
    return depth_from_counts(counts, unit)


def write_png(path: str | Path, pixels: AnyArray) -> None:
    """Write (H, W) uint8 or uint16 pixels as a grey PNG."""
    ok, data = cv2.imencode('.png', pixels)
    if not ok:
        raise HoocError(f'{path}: the image of shape {pixels.shape} cannot be made into a PNG')
    Path(path).write_bytes(data.tobytes())


def _png_header(path: str | Path, data: bytes) -> tuple[int, int, int, int]:
    """Return (width, height, bits, colour type) of a PNG."""
    if data[:8] != b'\x89PNG\r\n\x1a\n' or len(data) < 33:
        raise HoocError(f'{path}: not a PNG image; save it as a grey PNG')
    width, height, bits, colour_type = struct.unpack('>IIBB', data[16:26])
    return width, height, bits, colour_type


def _is_complete(data: bytes) -> bool:
    """Return whether all chunks up to IEND are there with correct checksums."""
    at = 8
    while at + 12 <= len(data):
        length, = struct.unpack('>I', data[at:at + 4])
        end = at + 12 + length
        if end > len(data):
            return False
        if zlib.crc32(data[at + 4:end - 4]) != struct.unpack('>I', data[end - 4:end])[0]:
            return False
        if data[at + 4:at + 8] == b'IEND':
            return True
        at = end
    return False
