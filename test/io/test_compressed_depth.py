# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Depth of compressed_depth_image_transport, encoded here as its publishers do."""

import struct

import cv2
from hooc_perception.errors import HoocError
from hooc_perception.io.compressed_depth import decode_compressed_depth
import numpy as np
import pytest

RNG = np.random.default_rng(0)
COUNTS = np.where(RNG.random((48, 64)) < 0.3, 0, RNG.integers(300, 60_000, (48, 64))).astype('u2')


def png(counts):
    """Return the bytes of a PNG."""
    return cv2.imencode('.png', counts)[1].tobytes()


def rvl(counts):
    """Return an RVL image, written bit by bit from the description of the format."""
    nibbles = []

    def put(value):
        while True:
            value, bits = value >> 3, value & 7
            nibbles.append(bits | (8 if value else 0))
            if not value:
                return

    flat, at, previous = counts.ravel().astype(int).tolist(), 0, 0
    while at < len(flat):
        for is_run in (lambda v: v == 0, lambda v: v != 0):
            end = at
            while end < len(flat) and is_run(flat[end]):
                end += 1
            put(end - at)
            for value in flat[at:end] if flat[at:end] and flat[at] else ():
                # The codec works in 16 bits with a sign.
                delta = (value - previous + 0x8000) % 0x10000 - 0x8000
                put((delta << 1) ^ (delta >> 31))
                previous = value
            at = end
    nibbles += [0] * (-len(nibbles) % 8)
    words = [sum(n << 28 - 4 * i for i, n in enumerate(nibbles[k:k + 8]))
             for k in range(0, len(nibbles), 8)]
    return struct.pack('<ii', *counts.shape[::-1]) + struct.pack(f'<{len(words)}I', *words)


HEAD = struct.pack('<iff', 0, 0, 0)


@pytest.mark.parametrize('form, data', [
    ('16UC1; compressedDepth png', HEAD + png(COUNTS)),
    ('16UC1; compressedDepth', HEAD + png(COUNTS)),
    ('16UC1; compressedDepth rvl', HEAD + rvl(COUNTS)),
    ('mono16; compressedDepth png', HEAD + png(COUNTS)),
    ('16UC1; png compressed ', png(COUNTS)),
])
def test_counts_come_back_to_the_bit(form, data):
    encoding, pixels = decode_compressed_depth(form, data)
    assert encoding == '16UC1' and pixels.dtype == np.uint16
    np.testing.assert_array_equal(pixels, COUNTS)


@pytest.mark.parametrize('codec, encode', [('png', png), ('rvl', rvl)])
def test_metres_come_back_within_the_quantization(codec, encode):
    depth = np.where(COUNTS, COUNTS / 10_000, np.nan).astype(np.float32)
    depth[0, :8] = np.nan
    # As the transport does with its defaults, depth_max 10 and depth_quantization 100.
    a = 100 * 101.0
    b = 1 - a / 10
    inverse = np.where(np.isfinite(depth), a / np.nan_to_num(depth, nan=1) + b, 0)
    data = struct.pack('<iff', 0, a, b) + encode(inverse.astype('u2'))
    encoding, pixels = decode_compressed_depth(f'32FC1; compressedDepth {codec}', data)
    assert encoding == '32FC1' and pixels.dtype == np.float32
    np.testing.assert_array_equal(np.isnan(pixels), np.isnan(depth))
    near = np.isfinite(depth) & (a / np.nan_to_num(depth, nan=1) + b < 65_000)
    # One step of inverse depth is depth^2 / a.
    assert (np.abs(pixels - depth)[near] <= 1.01 * depth[near] ** 2 / a).all()


@pytest.mark.parametrize('form, data, words', [
    ('bgr8; jpeg compressed bgr8', b'\xff\xd8', 'no compressed depth'),
    ('16UC1; compressedDepth png', HEAD, 'too few'),
    ('16UC1; compressedDepth png', HEAD + png(COUNTS)[:200], 'damaged'),
    ('16UC1; compressedDepth png', HEAD + b'junk' * 20, 'damaged'),
    ('16UC1; compressedDepth png', HEAD + png(COUNTS.astype('u1')), 'damaged'),
    ('16UC1; compressedDepth rvl', HEAD + rvl(COUNTS)[:400], 'damaged'),
    ('16UC1; compressedDepth rvl', HEAD + struct.pack('<ii', 1 << 30, 1 << 30), 'damaged'),
    ('16UC1; compressedDepth rvl', HEAD + struct.pack('<ii', 4, 4) + b'\xff' * 80, 'damaged'),
])
def test_what_is_no_depth_gets_a_sentence(form, data, words):
    with pytest.raises(HoocError, match=words):
        decode_compressed_depth(form, data)
