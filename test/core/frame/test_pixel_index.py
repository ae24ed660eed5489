# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The numbering of pixels over views of different sizes."""

from types import SimpleNamespace

from hooc_perception.core.frame.pixel_index import first_pixels, rows_of_pixels, stacked_index
import numpy as np

VIEWS = [SimpleNamespace(depth=np.zeros((4, 6))), SimpleNamespace(depth=np.zeros((3, 5)))]


def test_views_follow_one_another():
    assert first_pixels(VIEWS).tolist() == [0, 24, 39]


def test_every_pixel_has_the_number_of_its_place_in_the_stack():
    stack = np.concatenate([np.arange(v.depth.size) + 100 * k for k, v in enumerate(VIEWS)])
    camera = np.array([0, 0, 1, 1, 1], np.uint8)
    uv = np.array([[0, 0], [5, 2], [0, 0], [4, 2], [1, 1]], np.uint16)
    index = stacked_index(VIEWS, camera, uv)
    assert stack[index].tolist() == [0, 17, 100, 114, 106]
    rows = rows_of_pixels(index, 39)
    assert rows.dtype == np.int32
    assert rows[index].tolist() == [0, 1, 2, 3, 4]
    assert (np.delete(rows, index) == -1).all()


def test_no_pixels_listed():
    index = stacked_index(VIEWS, np.zeros(0, np.uint8), np.zeros((0, 2), np.uint16))
    assert len(index) == 0
    assert (rows_of_pixels(index, 39) == -1).all()
