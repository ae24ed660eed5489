# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of size and surface: closed forms, symmetries, and what evaluate writes of them."""

from dataclasses import replace

from hooc_perception.evaluation.as_json import as_json
from hooc_perception.evaluation.evaluate import evaluate_results
from hooc_perception.evaluation.matching import PosedObject
from hooc_perception.evaluation.scores import score_scene
from hooc_perception.evaluation.shape import (
    shape_errors,
    shape_summary,
    size_logs,
    surface_distance,
)
from hooc_perception.evaluation.shape_table import shape_table
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

TURNED = Rotation.from_euler('z', np.pi / 2).as_quat()


def thing(model, turn=(0, 0, 0, 1.0), size=None, at=(0, 0, 0)):
    """Return a PosedObject of a model."""
    return PosedObject(model.name, np.array(at, float), np.array(turn, float),
                       np.array(model.extents if size is None else size, float))


def test_a_box_moved_up_has_the_distance_of_the_closed_form(models):
    # Moved up by h, top and bottom (a b each) are h away, the bottom less near its edges; of
    # the sides, the strip that sticks out. Summed up: 2 h a b + 4/3 h^3 of the whole surface.
    a, b, c, h = 0.16, 0.10, 0.06, 0.01
    expected = (2 * h * a * b + 4 / 3 * h ** 3) / (2 * (a * b + b * c + c * a))
    box = models['box']
    moved = surface_distance(thing(box, at=(0.3, 0.1, h)), thing(box, at=(0.3, 0.1, 0)), box)
    assert moved == pytest.approx(expected, rel=0.03)


def test_concentric_balls_are_as_far_apart_as_their_radii(models):
    ball = models['ball']
    larger = surface_distance(thing(ball, size=np.full(3, 0.1)), thing(ball), ball)
    assert larger == pytest.approx(0.01, rel=0.02)


def test_surfaces_that_coincide_have_no_distance_whatever_the_turn(models):
    box, ball = models['box'], models['ball']
    assert surface_distance(thing(box), thing(box), box) == 0
    turned = thing(box, Rotation.from_euler('z', np.pi).as_quat())
    assert surface_distance(turned, thing(box), box) < 1e-6
    assert surface_distance(thing(ball, TURNED), thing(ball), ball) < 2e-4


def test_both_directions_count_and_areas_are_those_of_the_placed_model(models):
    # The box stretched to ten times its length: most of its surface is far from the other one.
    box = models['box']
    long, short = thing(box, size=(1.6, 0.1, 0.06)), thing(box)
    distance = surface_distance(long, short, box)
    assert distance == pytest.approx(surface_distance(short, long, box), rel=1e-9)
    # Beyond the ends, a point x from the middle is about x - 8 cm away: 36 cm on average over
    # the nine tenths; from the short box only the ends, 9 % of its surface or a fifth of it, are
    # inside the long one, and at most 3 cm off.
    assert 0.5 * 0.9 * 0.36 < distance < 0.5 * 0.9 * 0.36 + 0.01


def test_logs_of_sizes_by_hand(models):
    box = models['box']
    true, est = thing(box, size=(0.2, 0.1, 0.1)), thing(box, size=(0.1, 0.3, 0.1))
    longest, axes = size_logs(est, true, box)
    assert longest == pytest.approx(np.log(1.5))
    assert axes == pytest.approx((np.log(0.5), np.log(3), 0))


def test_axes_that_a_symmetry_exchanges_are_compared_as_they_lie(models):
    # A quarter turn of a square box with its sides swapped is the same box.
    square = replace(models['box'], symmetry=np.array([2, 2, 4]))
    square = replace(square, extents=np.full(3, 0.1),
                     vertices=square.vertices / square.extents * 0.1)
    true = thing(square, size=(0.2, 0.1, 0.05))
    swapped = thing(square, TURNED, (0.1, 0.2, 0.05))
    assert size_logs(swapped, true, square)[1] == pytest.approx((0, 0, 0), abs=1e-9)
    turned = replace(swapped, size=true.size)
    assert size_logs(turned, true, square)[1] == pytest.approx((np.log(2), -np.log(2), 0))


def test_flat_objects_have_a_ratio(models):
    flat = thing(models['box'], size=(0.1, 0.1, 0))
    assert size_logs(flat, flat, models['box']) == (0, pytest.approx((0, 0, 0), abs=1e-9))


def test_only_localized_objects_count_and_the_means_are_of_absolute_values(models):
    truths = [thing(models['box']), thing(models['can']), thing(models['ball'])]
    estimates = [replace(truths[0], size=truths[0].size * 2),
                 replace(truths[1], size=truths[1].size / 2),
                 replace(truths[2], translation=np.array([1.0, 0, 0]))]
    errors = shape_errors(score_scene('x', estimates, truths, models), estimates, truths, models)
    assert [(e.category, e.truth) for e in errors] == [('box', 0), ('can', 1)]
    assert errors[0].longest_log == pytest.approx(-errors[1].longest_log)
    summary = shape_summary(errors)
    assert summary['objects'] == 2
    assert summary['longest_log'] == pytest.approx(np.log(2))
    assert summary['axes_log'] == pytest.approx([np.log(2)] * 3)
    assert summary['surface_m'] == pytest.approx((errors[0].surface_m + errors[1].surface_m) / 2)
    nothing = shape_summary([])
    assert nothing['objects'] == 0 and np.isnan([nothing['surface_m'], *nothing['axes_log']]).all()


def test_evaluate_tells_certain_errors_sizes_and_surfaces(tiny, models, truth_results):
    """Two estimates above .8 stay right, one goes astray; one below it does not count."""
    first, second = (scene['objects'] for scene in truth_results['scenes'][:2])
    for thing_, score in zip((*first, *second), (0.9, 0.95, 0.85, 0.8, 0.1)):
        thing_['score'] = score
    for stray in (first[2], second[0]):
        stray['translation'] = [0.5, 0.5, 0.5]
    first[0]['size'] = [1.5 * s for s in first[0]['size']]
    e = evaluate_results(tiny, truth_results, models, 'some')
    content = as_json(tiny, [e], {}, {})['results'][0]
    certain = content['certainty']['certain']
    assert certain == {'above': 0.8, 'estimates': 3, 'wrong': 1, 'share': pytest.approx(1 / 3)}
    assert content['shape']['objects'] == 3
    assert content['shape']['longest_log'] == pytest.approx(np.log(1.5) / 3)
    assert [x['category'] for x in content['shape']['scenes']['10_1']] == ['ball', 'box']
    # The ball of 4 cm radius is taken for one of 6 cm.
    assert content['shape']['surface_m'] == pytest.approx(0.02 / 3, rel=0.02)
    row, = shape_table([e]).rows
    assert row[:4] == ('some', 3, 1, '0.333') and row[5:9] == ('0.135',) * 4 and row[9] == '6.6'


def test_nothing_estimated_leaves_the_cells_empty(tiny, models, truth_results):
    for scene in truth_results['scenes']:
        scene['objects'] = []
    e = evaluate_results(tiny, truth_results, models, 'none')
    content = as_json(tiny, [e], {}, {})['results'][0]
    assert content['certainty']['certain']['share'] is None
    assert content['shape']['axes_log'] == [None] * 3
    row, = shape_table([e]).rows
    assert row == ('none', 0, 0, *(None,) * 7)
    assert shape_table([]) is None
