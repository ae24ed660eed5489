# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Depth encodings against values written down by hand with `struct`."""

import struct

from hooc_perception.errors import HoocError
from hooc_perception.io.depth_encodings import (
    counts_from_depth,
    decode_depth,
    depth_from_counts,
    encode_depth,
)
import numpy as np
import pytest


@pytest.mark.parametrize('order, is_bigendian', [('<', 0), ('>', 1)])
@pytest.mark.parametrize('padding', [0, 1, 6])
def test_millimetres_in_any_byte_order_and_step(order, is_bigendian, padding):
    row = struct.pack(order + 'HHH', 0, 1234, 65535) + b'\xff' * padding
    depth = decode_depth(row * 2, 2, 3, '16UC1', 6 + padding, is_bigendian)
    assert depth.dtype == np.float32 and depth.shape == (2, 3)
    assert np.isnan(depth[:, 0]).all()
    np.testing.assert_allclose(depth[:, 1:], [[1.234, 65.535]] * 2, rtol=1e-6)


@pytest.mark.parametrize('order, is_bigendian', [('<', 0), ('>', 1)])
def test_metres_reject_what_is_no_distance(order, is_bigendian):
    values = [1.5, float('nan'), float('inf'), -1.0, 0.0]
    depth = decode_depth(struct.pack(order + '5f', *values), 1, 5, '32FC1', 20, is_bigendian)
    assert depth[0, 0] == 1.5
    assert np.isnan(depth[0, 1:]).all()


def test_last_row_may_lack_its_padding():
    data = struct.pack('<HHHH', 1000, 2000, 7, 3000)
    depth = decode_depth(data, 2, 1, '16UC1', 6)
    np.testing.assert_allclose(depth[:, 0], [1.0, 3.0])


@pytest.mark.parametrize('encoding', ['16UC1', '32FC1'])
def test_there_and_back(encoding):
    depth = depth_from_counts(np.arange(0, 65535, 7, np.uint16)[:9000].reshape(90, 100))
    data, step, is_bigendian = encode_depth(depth, encoding)
    np.testing.assert_array_equal(decode_depth(data, 90, 100, encoding, step, is_bigendian), depth)


def test_counts_that_do_not_fit_become_no_reading():
    np.testing.assert_array_equal(
        counts_from_depth(np.array([np.nan, np.inf, -1, 0.0004, 0.0006, 65.535, 65.536])),
        [0, 0, 0, 0, 1, 65535, 0])


@pytest.mark.parametrize('arguments, word', [
    ((b'\0' * 8, 2, 2, 'rgb8', 4), 'rgb8'),
    ((b'\0' * 8, 2, 2, '16UC1', 3), 'step'),
    ((b'\0' * 7, 2, 2, '16UC1', 4), '7'),
    ((b'', 0, 2, '16UC1', 4), 'empty')])
def test_bad_images_get_a_sentence(arguments, word):
    with pytest.raises(HoocError, match=word):
        decode_depth(*arguments)
