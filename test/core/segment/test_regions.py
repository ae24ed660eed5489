# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Regions given as parameters: polygons, boxes, and what is neither."""

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.regions import workspace_of
from hooc_perception.errors import HoocError
import numpy as np
import pytest


def inside(workspace, points, ignore=''):
    """Return for each point whether it is in a workspace."""
    return workspace_of(workspace, ignore).contains(np.array(points, float)).tolist()


def test_a_polygon_that_is_not_convex():
    corner = '[[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]'
    points = [(0.5, 0.5, 9), (1.5, 0.5, -9), (0.5, 1.5, 0), (1.5, 1.5, 0), (-0.1, 1, 0),
              (np.nan, 0.5, 0)]
    assert inside(corner, points) == [True, True, True, False, False, False]


def test_a_box_between_two_corners_in_any_order():
    points = [(0.1, 0.1, 0.2), (0.1, 0.1, 0.6), (0.1, 0.1, -0.1), (0.6, 0.1, 0.2)]
    assert inside('[[0.5, -0.2, 0.5], [-0.5, 0.2, 0]]', points) == [True, False, False, False]
    assert inside('[[-0.5, -0.2], [0.5, 0.2]]', points) == [True, True, True, False]


def test_nothing_given_admits_everything_but_what_is_ignored():
    points = [(5, 5, 5), (0.1, 0.1, 0)]
    assert inside('', points) == [True, True]
    assert inside('', points, '[[[0, 0], [1, 1]], [[4, 4], [6, 4], [5, 7]]]') == [False, False]


def test_the_middle_and_reach_of_a_workspace():
    workspace = workspace_of('[[0.2, -0.4], [1.0, 0.2]]', '')
    np.testing.assert_allclose(workspace.centre, [0.6, -0.1])
    assert workspace.radius_m == pytest.approx(0.5)
    assert workspace_of('', '').centre is None


@pytest.mark.parametrize('text', [
    'table', '[0, 1]', '[[0, 0]]', '[[0, 0, 0], [1, 1, 1], [2, 2, 2]]', '[[0, 0], [0, 1]]',
    '[[0, 0, 1], [1, 1, 1]]', '[[0, 0], [1, 1], [2, 2]]', '[[0, 0], [1, null]]', '[[0, 0], [1]]',
    '{"x": 1}', '[[0, 0], [1, 1e999]]'])
def test_what_is_no_region_is_refused_where_it_is_set(text):
    with pytest.raises(HoocError, match='parameter workspace is .* give the corners'):
        ObserveConfig(workspace=text)
    with pytest.raises(HoocError, match='parameter ignore'):
        ObserveConfig(ignore=f'[{text}]')


def test_bounds_of_the_height_are_a_range():
    with pytest.raises(HoocError, match='table_low_m is 0.5, not below table_high_m, 0.2'):
        ObserveConfig(table_low_m=0.5, table_high_m=0.2)
