# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Depth images in another unit than their encoding promises are detected."""

from hooc_perception.io.depth_units import depth_unit_error
import numpy as np
import pytest


def depth(metres):
    return np.full((240, 320), metres, np.float32)


@pytest.mark.parametrize('metres, encoding, word', [
    (0.8, '16UC1', None), (3.9, '16UC1', None), (0.06, '32FC1', None),
    (0.0009, '16UC1', 'hold metres'), (0.04, 'mono16', 'centimetres'),
    (10.0, '16UC1', 'tenths of a millimetre'), (65.535, '16UC1', 'saturated'),
    (900.0, '32FC1', 'millimetres'), (0.0009, '32FC1', 'another unit'), (np.nan, '32FC1', None)])
def test_units(metres, encoding, word):
    trouble = depth_unit_error(depth(metres), encoding, 4.0)
    assert trouble is None if word is None else word in trouble


def test_a_room_behind_the_table_is_no_wrong_unit():
    image = depth(7.0)
    image[60:180, 80:240] = 0.9
    assert depth_unit_error(image, '16UC1', 4.0) is None
