# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The shapes of training objects: meshes that the set gives, the catalogue's, and copies."""

from dataclasses import replace

from hooc_perception.objects.catalogue import TRAINING
from hooc_perception.synthesis.bodies import BodyMaker
from hooc_perception.synthesis.population import COPIES, DRAWS, FOLDS, relatives_of
import numpy as np
import pytest


@pytest.fixture(scope='module')
def families(models):
    """Return a rod with four variants, and a box with one."""
    box, can, ring, ball, rod, plate = models
    given = tuple(replace(m, name='rod') for m in (box, can, ball, plate))
    return (replace(rod, variants=given),
            replace(box, variants=(replace(ring, name='box'),)))


@pytest.fixture(scope='module')
def population(families):
    return relatives_of(families, 3)


def test_variants_of_the_set_are_relatives(families, population):
    rods, boxes = population
    assert len(rods) == COPIES + 4 and len(boxes) == DRAWS * len(TRAINING['box']) + 1
    for relatives, given in ((rods[COPIES:], families[0].variants),
                             (boxes[-1:], families[1].variants)):
        for k, (relative, variant) in enumerate(zip(relatives, given, strict=True)):
            assert relative.model is variant and relative.fold == k % FOLDS
            points = np.concatenate(relative.pieces)
            np.testing.assert_allclose(np.ptp(points, axis=0), variant.extents, rtol=0.05,
                                       atol=2e-3)


def test_the_seed_decides_whatever_the_jobs(families, population):
    again = relatives_of(families[:1], 3, jobs=2)
    for a, b in zip(again[0], population[0], strict=True):
        assert a.fold == b.fold
        np.testing.assert_array_equal(a.model.vertices, b.model.vertices)


def test_one_fold_is_what_all_have_of_it(families, population):
    for alone, everyone in zip(relatives_of(families, 3, fold=1), population, strict=True):
        same = [relative for relative in everyone if relative.fold == 1]
        assert {relative.fold for relative in alone} == {1}
        for a, b in zip(alone, same, strict=True):
            np.testing.assert_array_equal(a.model.vertices, b.model.vertices)


def test_objects_are_made_from_variants(families, population):
    maker, rng = BodyMaker(families, population), np.random.default_rng(0)
    bodies = [maker.body(1, rng, fold=1) for _ in range(40)]
    assert {body.fold for body in bodies} == {1}
    can = families[0].variants[1]
    assert any(body.vertices is can.vertices for body in bodies)
    free = [maker.body(1, rng).fold for _ in range(60)]
    assert set(free) == {-1, *range(FOLDS)}
