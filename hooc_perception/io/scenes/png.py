# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""PNG images that somebody else wrote: checked before anything is decoded."""

from pathlib import Path
import struct
import zlib

import cv2
from hooc_perception.errors import HoocError
from hooc_perception.io.depth_encodings import depth_from_counts
from hooc_perception.io.scenes import files
import numpy as np

MAX_PNG_BYTES = 64 << 20
_KINDS = {0: 'grey', 2: 'colour', 3: 'palette', 4: 'grey with alpha', 6: 'colour with alpha'}


def read_png(path, width, height, bits):
    """
    Return the (height, width) uint16 or uint8 pixels of a grey PNG with 16 or 8 bits.

    Header, size and checksums are checked before anything is decoded: OpenCV would hand out
    the readable part of a truncated file without a word.
    """
    data = files.read_bytes(path, MAX_PNG_BYTES)
    found_width, found_height, found_bits, kind = _png_header(path, data)
    if (found_bits, kind) != (bits, 0):
        raise HoocError(f'{path}: a {found_bits}-bit {_KINDS.get(kind, "unknown")} PNG; '
                        f'save it as a {bits}-bit grey PNG')
    if (found_width, found_height) != (width, height):
        raise HoocError(f'{path}: the image has {found_width} x {found_height} pixels, but its '
                        f'camera says width {width} and height {height}; correct one of them')
    if not _complete(data):
        raise HoocError(f'{path}: the PNG is truncated or damaged; copy or record it again')
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None or pixels.shape != (height, width):
        raise HoocError(f'{path}: the PNG cannot be decoded; copy or record it again')
    return pixels


def png_size(path):
    """Return (width, height) that a PNG's header says."""
    return _png_header(path, files.read_bytes(path, MAX_PNG_BYTES))[:2]


def read_depth_png(path, width, height, unit):
    """Return (H, W) float32 metres, NaN = none, of a 16-bit PNG with `unit` metres a count."""
    counts = read_png(path, width, height, 16)
    if not counts.any():
        raise HoocError(f'{path}: every depth pixel is 0, so the image holds no reading; '
                        'record this view again or remove the scene')
    return depth_from_counts(counts, unit)


def write_png(path, pixels):
    """Write (H, W) uint8 or uint16 pixels as a grey PNG."""
    ok, data = cv2.imencode('.png', pixels)
    if not ok:
        raise HoocError(f'{path}: the image of shape {pixels.shape} cannot be made into a PNG')
    Path(path).write_bytes(data.tobytes())


def _png_header(path, data):
    """Return (width, height, bits, kind of colour) of a PNG."""
    if data[:8] != b'\x89PNG\r\n\x1a\n' or len(data) < 33:
        raise HoocError(f'{path}: not a PNG image; save it as a grey PNG')
    return struct.unpack('>IIBB', data[16:26])


def _complete(data):
    """Say whether all chunks up to IEND are there with correct checksums."""
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
