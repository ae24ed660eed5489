# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The members of all families, numbered through."""

from dataclasses import replace

from hooc_perception.core.shapes import Shapes
from hooc_perception.core.types import Candidates
import numpy as np
import pytest


@pytest.fixture(scope='module')
def families(things):
    """Return three categories: box alone, ball with two variants, can with one."""
    box, ball, can = things
    return box, replace(ball, variants=(box, can)), replace(can, variants=(ball,))


def objects_of(category, member=()):
    """Return Candidates somewhere."""
    n = len(category)
    return Candidates(np.array(category, np.uint16), np.zeros((n, 3)),
                      np.tile([0, 0, 0, 1.0], (n, 1)), np.ones((n, 3), np.float32),
                      np.ones(n, np.float32), np.array(member, np.uint16))


def test_members_follow_one_another(families):
    box, ball, can = families
    shapes = Shapes(families)
    expected = [box, ball, *ball.variants, can, *can.variants]
    assert len(shapes) == 6 and all(a is b for a, b in zip(shapes.models, expected, strict=True))
    assert shapes.category.tolist() == [1, 2, 2, 2, 3, 3]
    assert shapes.member.tolist() == [0, 0, 1, 2, 0, 1]
    assert shapes.family.tolist() == [1, 3, 3, 3, 2, 2]
    assert shapes.member.dtype == np.uint16
    np.testing.assert_array_equal(shapes.extents, [m.extents for m in expected])


def test_a_candidate_has_the_number_of_its_mesh(families):
    shapes = Shapes(families)
    objects = objects_of([3, 2, 1, 2, 3], [1, 2, 0, 0, 0])
    number = shapes.of(objects)
    assert number.tolist() == [5, 3, 0, 1, 4] and number.dtype == np.int64
    np.testing.assert_array_equal(shapes.category[number], objects.category)
    np.testing.assert_array_equal(shapes.member[number], objects.member)
    assert all(shapes.models[k] is m for k, m in zip(number, objects.shapes(families)))


def test_without_variants_shapes_are_the_models(things):
    shapes = Shapes(things)
    assert shapes.models == tuple(things) and set(shapes.family) == {1}
    assert shapes.of(objects_of([2, 3, 1])).tolist() == [1, 2, 0]


def test_no_models_and_no_candidates(things):
    none = Shapes(())
    assert len(none) == 0 and none.extents.shape == (0, 3) and none.of(objects_of([])).size == 0
    assert Shapes(things).of(Candidates.empty()).shape == (0,)


def test_candidates_are_generic_where_nothing_is_said():
    objects = objects_of([1, 2])
    assert objects.member.tolist() == [0, 0] and objects.member.dtype == np.uint16
    joined = objects.extended(objects_of([2, 2], [1, 2]))
    assert joined.member.tolist() == [0, 0, 1, 2]
    assert joined.take([3, 1]).member.tolist() == [2, 0]
    assert joined.take(np.zeros(4, bool)).member.shape == (0,)
    assert Candidates.empty().extended(objects).member.tolist() == [0, 0]
