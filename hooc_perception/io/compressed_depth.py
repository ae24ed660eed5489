# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Decode the depth images of compressed_depth_image_transport.

A message is a header of three numbers, then a PNG or RVL image of 16 bits: counts, or for 32FC1
quantized inverse depth (ros-perception/image_transport_plugins, codec.cpp).
"""

import struct

import cv2
from hooc_perception.core.arrays import AnyArray, Float32Array, UInt16Array
from hooc_perception.errors import HoocError
from hooc_perception.io.depth_encodings import METRES, MILLIMETRES
from hooc_perception.io.scenes.fields import MAX_SIDE
import numpy as np

# Format (unused) and the two parameters of the quantization.
_HEADER = struct.Struct('<iff')
_PNG = b'\x89PNG\r\n\x1a\n'
# Three bits of a number and whether more follow.
_MORE, _BITS = 8, 3


def decode_compressed_depth(form: str, data: bytes) -> tuple[str, AnyArray]:
    """
    Return (encoding, (H, W) pixels): uint16 counts for 16UC1, float32 metres for 32FC1.

    :param form: `format` of the CompressedImage, such as '16UC1; compressedDepth png'. Older
        publishers leave out the codec, which is PNG then.
    :raises HoocError: if it is no depth image or damaged.
    """
    encoding = form.partition(';')[0].strip() or MILLIMETRES
    if encoding == 'mono16':
        encoding = MILLIMETRES
    if encoding not in (MILLIMETRES, METRES):
        raise HoocError(f'format {form!r} is no compressed depth; publish 16UC1 or 32FC1 by '
                        'compressed_depth_image_transport')
    # kinect2_bridge and the transport `compressed` write the PNG alone.
    headed = not data.startswith(_PNG)
    if headed and len(data) <= _HEADER.size:
        raise HoocError(f'it has {len(data)} bytes, too few for a compressed depth image')
    payload = data[_HEADER.size:] if headed else data
    try:
        counts = _decode_rvl(payload) if 'rvl' in form.lower() else _decode_png(payload)
    except (struct.error, IndexError, ValueError, cv2.error):
        raise HoocError('its compressed data is damaged') from None
    if encoding == MILLIMETRES or not headed:
        return MILLIMETRES, counts
    _, a, b = _HEADER.unpack_from(data)
    return METRES, _dequantized(counts, a, b)


def _dequantized(inverse: UInt16Array, a: float, b: float) -> Float32Array:
    """Return metres of quantized inverse depth: a / (value - b); 0 = none."""
    with np.errstate(divide='ignore', invalid='ignore'):
        depth = np.float32(a) / (inverse.astype(np.float32) - np.float32(b))
    return np.where(inverse > 0, depth, np.float32(np.nan)).astype(np.float32)


def _decode_png(payload: bytes) -> UInt16Array:
    """Return the (H, W) uint16 pixels of a grey PNG."""
    if not payload.startswith(_PNG):
        raise ValueError('no PNG')
    width, height = struct.unpack_from('>II', payload, 16)
    _check_size(width, height)
    pixels = cv2.imdecode(np.frombuffer(payload, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None or pixels.dtype != np.uint16 or pixels.ndim != 2:
        raise ValueError('not 16 bits of grey')
    return np.asarray(pixels, np.uint16)


def _decode_rvl(payload: bytes) -> UInt16Array:
    """
    Return the (H, W) uint16 pixels of an RVL image.

    Runs of zeros and of differences to the last pixel alternate (Wilson, "Fast Lossless Depth
    Image Compression", 2017).
    """
    width, height = struct.unpack_from('<ii', payload)
    _check_size(width, height)
    words = np.frombuffer(payload[8:8 + (len(payload) - 8) // 4 * 4], '<u4')
    nibbles = ((words[:, None] >> np.arange(28, -1, -4).astype(np.uint32)) & 15).ravel()
    ends = np.flatnonzero(nibbles < _MORE)
    starts = np.r_[0, ends[:-1] + 1]
    place = np.arange(ends[-1] + 1) - np.repeat(starts, ends - starts + 1)
    if place.max() > 10:
        raise ValueError('a number of more than 32 bits')
    numbers = np.add.reduceat((nibbles[:ends[-1] + 1].astype(np.int64) & 7) << _BITS * place,
                              starts)
    counts = np.zeros(width * height, np.uint16)
    at = pixel = previous = 0
    while pixel < len(counts):
        pixel += int(numbers[at])
        run = int(numbers[at + 1]) if pixel < len(counts) else 0
        codes = numbers[at + 2:at + 2 + run]
        if len(codes) < run or pixel + run > len(counts):
            raise ValueError('a run beyond the image')
        values = previous + np.cumsum((codes >> 1) ^ -(codes & 1))
        counts[pixel:pixel + run] = values & 0xFFFF
        previous = int(values[-1]) if run else previous
        pixel, at = pixel + run, at + 2 + run
    return counts.reshape(height, width)


def _check_size(width: int, height: int) -> None:
    """Raise ValueError for an image that no camera sends."""
    if not (0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE):
        raise ValueError('no camera sends this size')
