# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A table that changes, and the judgement of answers to it."""

from dataclasses import replace

from hooc_perception.benchmark.change_check import ChangeCheck, Found
from hooc_perception.benchmark.changing_table import (
    Change,
    ChangingTable,
    FEWEST,
    MOST,
    MOST_ALIKE,
)
from hooc_perception.benchmark.soak_result import SoakResult, write_plot
from hooc_perception.cli.main import main
from hooc_perception.errors import HoocError
from hooc_perception.synthesis.rigs import ring
from hooc_perception.trained.folder import load_model_folder
import numpy as np
import pytest

A, B, C, NEW = (np.array([x, 0.0, 0.05]) for x in (-0.3, 0.0, 0.3, 0.6))
S = 10 ** 9


@pytest.fixture(scope='module')
def models(repository):
    """Return the generic models of the bundled model."""
    return load_model_folder(repository / 'models' / 'demo').models


@pytest.fixture(scope='module')
def cameras():
    """Return two small cameras."""
    return ring(np.random.default_rng(0), 2, 128, 106, 91.0)


def test_a_table_changes_one_object_at_a_time(models, cameras):
    table = ChangingTable(models, cameras, np.random.default_rng(1))
    kinds = set()
    for _ in range(60):
        before, seen = table.places(), table.views()
        change = table.change()
        after = table.places()
        kinds.add(change.kind)
        assert before.get(change.name) is change.before and after.get(change.name) is change.after
        same = before.keys() & after.keys() - {change.name}
        assert all(before[name] is after[name] for name in same)
        assert FEWEST <= len(after) <= MOST
        counts = np.bincount([thing.category for thing in table.things.values()])
        assert counts.max() <= MOST_ALIKE
        places = np.array(list(after.values()))
        apart = np.linalg.norm(places[:, None] - places, axis=2) + 9 * np.eye(len(places))
        assert apart.min() > 0.2
        moved = [np.nanmax(np.abs(a.depth - b.depth)) for a, b in zip(seen, table.views())]
        assert max(moved) > 0.03
    assert kinds == {'put', 'taken', 'moved'}


def test_between_changes_only_noise_differs(models, cameras):
    table = ChangingTable(models, cameras, np.random.default_rng(1))
    a, b = table.views()[0].depth, table.views()[0].depth
    assert np.array_equal(np.isnan(a), np.isnan(b)) and 0 < np.nanstd(a - b) < 0.03


def test_tables_that_cannot_be_rendered_are_refused(models, cameras):
    rng = np.random.default_rng(0)
    with pytest.raises(HoocError, match='cameras'):
        ChangingTable(models, (), rng)
    small = [replace(model, extents=model.extents / 10) for model in models]
    with pytest.raises(HoocError, match='categories'):
        ChangingTable(small, cameras, rng)


def found(number, place, category=1, off=0.01):
    return Found(number, category, place + off)


@pytest.fixture
def check():
    """Return a ChangeCheck of A and B, whose first frame set has been answered."""
    check = ChangeCheck({1: A, 2: B})
    check.sent(S)
    check.answered(S, [found(7, A), found(8, B)], S)
    return check


def judged(check, change, *answers):
    """Return the ChangeResult after a change at 2 s and answers, one a second."""
    check.changed(2 * S, change)
    for k, objects in enumerate(answers):
        check.sent((2 + k) * S)
        check.answered((2 + k) * S, objects, int((2.5 + k) * S))
    return check.result()


MOVED, TAKEN, PUT = (Change('moved', 1, A, NEW), Change('taken', 1, A, None),
                     Change('put', 3, None, C))
BOTH = [found(7, A), found(8, B)]


@pytest.mark.parametrize('change, wrong, right', [
    (MOVED, BOTH, [found(7, NEW), found(8, B)]),
    (MOVED, [*BOTH, found(9, NEW)], [found(7, NEW), found(8, B)]),
    (TAKEN, BOTH, [found(8, B)]),
    (PUT, BOTH, [*BOTH, found(9, C)])])
def test_a_change_is_shown_at_once_later_or_never(check, change, wrong, right):
    now, = judged(check, change, right, right).followed
    assert (now.late, now.answers, now.seconds) == (0, 2, pytest.approx(0.5))
    check = ChangeCheck({1: A, 2: B})
    later, = judged(check, change, wrong, right).followed
    assert (later.late, later.answers, later.seconds) == (1, 2, pytest.approx(1.5))
    check = ChangeCheck({1: A, 2: B})
    result = judged(check, change, wrong, wrong)
    assert result.followed[0].late is None and result.lost == result.followed
    result = judged(ChangeCheck({1: A, 2: B}), change)
    assert result.followed[0].late is None and result.followed[0].answers == 0
    assert not result.lost      # nobody was asked


def test_answers_to_earlier_frame_sets_do_not_count(check):
    check.sent(2 * S)
    check.changed(3 * S, TAKEN)
    assert check.since_change == 0
    check.answered(2 * S, [found(8, B)], 4 * S)
    check.answered(9 * S, [], 9 * S)        # a retraction
    assert check.since_change == 0
    assert check.result().followed[0].answers == 0
    check.sent(4 * S)
    check.answered(4 * S, [found(8, B)], 5 * S)
    assert check.since_change == 1 and check.result().followed[0].late == 0


@pytest.mark.parametrize('change, answer, swapped, lost_ids, renamed', [
    (MOVED, [found(7, NEW), found(8, B)], 0, 0, 0),
    (MOVED, [found(9, NEW), found(8, B)], 0, 1, 0),
    (MOVED, [found(9, NEW, 2), found(8, B)], 0, 0, 1),
    (MOVED, [found(8, NEW), found(7, B)], 2, 0, 0),
    (TAKEN, [found(8, B)], 0, 0, 0),
    (TAKEN, [found(7, B)], 0, 1, 0),
    (PUT, [*BOTH, found(9, C)], 0, 0, 0),
    (PUT, [found(7, A), found(9, B), found(8, C)], 1, 1, 0)])
def test_ids_stay_with_their_objects(check, change, answer, swapped, lost_ids, renamed):
    result = judged(check, change, answer)
    assert (result.swapped, result.lost_ids, result.renamed) == (swapped, lost_ids, renamed)
    assert result.found == result.true and result.false == 0


def test_what_is_missing_and_what_is_not_there_is_counted(check):
    result = judged(check, PUT, [found(7, A), found(9, NEW)])
    assert (result.true, result.found, result.false) == (5, 3, 1)


def test_only_a_level_that_rises_is_growth():
    seconds = np.arange(400.0)
    peaks = 400 + 60.0 * (seconds % 20 < 4 + 12 * (seconds > 250))
    result = SoakResult(seconds, np.arange(400), {'peaks': peaks, 'leak': peaks + seconds / 10},
                        400, 400, 400, 0, 0)
    assert result.growth_mb('peaks') == 0 and 15 < result.growth_mb('leak') < 40


def test_changes_are_drawn(check, tmp_path):
    changes = judged(check, MOVED, BOTH, [found(7, NEW), found(8, B)])
    seconds = np.arange(4.0)
    result = SoakResult(seconds, np.arange(4), {'a': seconds + 100}, 4, 4, 4, 0, 0)
    write_plot(tmp_path / 'a.png', result)
    result.changes = changes
    write_plot(tmp_path / 'b.png', result)
    assert (tmp_path / 'b.png').stat().st_size > (tmp_path / 'a.png').stat().st_size > 5000


def test_a_table_that_changes_needs_no_bag(capsys):
    assert main(['bench', 'soak', '--changes', '--bag', 'x']) == 1
    error, = capsys.readouterr().err.splitlines()
    assert '--changes' in error and '--bag' in error
