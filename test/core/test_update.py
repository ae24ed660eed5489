# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parser.update: the answer follows the frame sets."""

from dataclasses import replace

from hooc_perception import Parser
from hooc_perception import parser as parser_module
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.profiles import profile
import numpy as np
import pytest
import trimesh

BOX, BALL, CAN = range(3)
FIELDS = ('category', 'translation', 'rotation_xyzw', 'size', 'score')


@pytest.fixture
def table(small, desk, things, cheap, monkeypatch):
    """Return (parser, function: rows of the desk, seed, extra meshes -> raw views)."""
    now = {}

    def views_with(rows=(BOX, BALL, CAN), seed=0, extra=(), moved=None):
        truth = desk.truth
        if moved is not None:
            truth = replace(truth, translation=truth.translation + np.array(moved))
        now['desk'] = small.desk_with(things, truth.take(list(rows)), seed, extra)
        return now['desk'].views

    calls = []

    def classify(observation, classifier, config):
        calls.append(observation)
        return small.probabilities_of(observation, now['desk'].classes, len(things))

    monkeypatch.setattr(parser_module, 'classify', classify)
    parser = Parser(things, {'known': 1}, replace(
        profile('best'), propose=cheap, parse=ParseConfig(rounds=1)), sigmas=True)
    parser.calls = calls
    return parser, views_with


def rows_of(scene, category):
    """Return {field: the one object of a category}."""
    objects = scene.parsed.objects
    row = np.flatnonzero(objects.category == category + 1)
    assert len(row) == 1
    return {**{name: getattr(objects, name)[row[0]] for name in FIELDS},
            'sigma_t': scene.parsed.sigma_t[row[0]]}


def assert_same_object(a, b):
    for name, value in a.items():
        np.testing.assert_array_equal(value, b[name], name)


def categories(scene):
    return sorted(scene.parsed.objects.category - 1)


def test_the_first_frame_set_is_parsed_as_ever(table):
    parser, views_with = table
    views = views_with()
    first, alone = parser.update(views), parser.parse(views)
    assert first.past is not None and alone.past is None
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(first.parsed.objects, name),
                                      getattr(alone.parsed.objects, name))
    # What parse returned is no past to follow.
    again = parser.update(views, alone)
    np.testing.assert_array_equal(again.parsed.objects.translation,
                                  first.parsed.objects.translation)


def test_a_still_scene_costs_no_stage_but_the_first(table):
    parser, views_with = table
    first = parser.update(views_with(seed=0))
    parser.calls.clear()
    second = parser.update(views_with(seed=1), first)
    assert not parser.calls and set(second.seconds) == {'observe'}
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(second.parsed.objects, name),
                                      getattr(first.parsed.objects, name))
    # When it has settled, everything is decided once more, on the readings of all frame sets.
    later = second
    for seed in (2, 3, 4):
        later = parser.update(views_with(seed=seed), later)
    assert len(parser.calls) == 1 and categories(later) == [BOX, BALL, CAN]


def test_taken_and_put_and_the_others_stay_to_the_bit(table):
    parser, views_with = table
    first = parser.update(views_with())
    taken = parser.update(views_with((BOX, BALL), 1), first)
    assert categories(taken) == [BOX, BALL]
    put = parser.update(views_with((BOX, BALL, CAN), 2), taken)
    assert categories(put) == [BOX, BALL, CAN]
    for category in (BOX, BALL):
        for scene in (taken, put):
            assert_same_object(rows_of(first, category), rows_of(scene, category))
    off = rows_of(put, CAN)['translation'] - rows_of(first, CAN)['translation']
    assert np.linalg.norm(off) < 0.01 and np.isfinite(rows_of(put, CAN)['sigma_t'])


def test_moved(table):
    parser, views_with = table
    first = parser.update(views_with())
    moved = parser.update(views_with(seed=1, moved=[[0, 0, 0], [0, 0, 0], [0.1, -0.02, 0]]), first)
    off = rows_of(moved, CAN)['translation'] - rows_of(first, CAN)['translation']
    np.testing.assert_allclose(off, [0.1, -0.02, 0], atol=0.01)
    # The can stood in front of the box in one of the views: it may sharpen, but it stays.
    np.testing.assert_allclose(rows_of(first, BOX)['translation'],
                               rows_of(moved, BOX)['translation'], atol=0.003)


def test_an_arm_does_not_take_what_it_hides(table):
    parser, views_with = table
    arm = trimesh.creation.box((0.8, 0.06, 0.06))
    arm.apply_translation([0.42, -0.1, 0.2])
    first = parser.update(views_with())
    during = parser.update(
        views_with(seed=1, extra=[(np.asarray(arm.vertices), np.asarray(arm.faces, np.int32))]),
        first)
    assert sum(int(view.hidden.sum()) for view in during.observation.views
               if view.hidden is not None) > 300
    assert categories(during) == [BOX, BALL, CAN]
    after = parser.update(views_with(seed=2), during)
    for category in (BOX, BALL, CAN):
        np.testing.assert_array_equal(rows_of(first, category)['translation'],
                                      rows_of(during, category)['translation'])
    assert categories(after) == [BOX, BALL, CAN]


def test_the_same_frame_sets_give_the_same_answers(table):
    parser, views_with = table

    def answers():
        scene, out = None, []
        for rows, seed in (((BOX, BALL, CAN), 0), ((BOX, BALL), 1), ((BOX, BALL, CAN), 2)):
            scene = parser.update(views_with(rows, seed), scene, seed=3)
            out.append(scene.parsed.objects)
        return out
    for a, b in zip(answers(), answers(), strict=True):
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_everything_anew_where_that_is_asked_for_or_much_has_changed(table):
    parser, views_with = table
    first = parser.update(views_with())
    parser.calls.clear()
    full = parser.update(views_with(seed=1), first, full=True)
    assert len(parser.calls) == 1 and categories(full) == [BOX, BALL, CAN]
    views = views_with((CAN,), 2)
    other, alone = parser.update(views, full), parser.parse(views)
    np.testing.assert_array_equal(other.parsed.objects.translation,
                                  alone.parsed.objects.translation)


def test_the_papers_method_looks_at_frame_sets_one_by_one(small, desk, things, monkeypatch):
    monkeypatch.setattr(parser_module, 'classify', lambda observation, *_: small.probabilities_of(
        observation, desk.classes, len(things)))
    parser = Parser(things, {'known': 1}, profile('paper'))
    first = parser.update(desk.views)
    again = parser.update(desk.views, first)
    np.testing.assert_array_equal(first.parsed.objects.translation,
                                  again.parsed.objects.translation)
