# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What happened between two results."""

from hooc_perception.core.parsing.events import EventLog, HIDDEN, MOVED, PUT, SEEN, TAKEN
from hooc_perception.core.types import Candidates
import numpy as np

BOX, CAN = 1, 3


def result(models, *rows):
    """Return (ids, Candidates) of rows (id, category, x)."""
    n = len(rows)
    category = np.array([c for _, c, _ in rows], np.uint16)
    return np.array([i for i, _, _ in rows], np.uint32), Candidates(
        category, np.array([[x, 0, 0.05] for _, _, x in rows]).reshape(n, 3),
        np.tile([0.0, 0, 0, 1], (n, 1)), np.ones((n, 3), np.float32), np.ones(n, np.float32))


def test_put_taken_and_moved(things):
    log = EventLog(things)
    assert log.update(*result(things, (1, BOX, 0.0), (2, CAN, 0.2))) == []
    assert log.update(*result(things, (1, BOX, 0.001), (2, CAN, 0.2))) == []
    events = log.update(*result(things, (2, CAN, 0.3), (5, CAN, 0.6)))
    assert [(e.kind, e.id, e.category) for e in events] == [
        (TAKEN, 1, 'box'), (MOVED, 2, things[CAN - 1].name), (PUT, 5, things[CAN - 1].name)]
    moved = events[1]
    np.testing.assert_allclose((moved.translation[0], moved.before[0]), (0.3, 0.2))
    assert moved.to_dict()['before'] == moved.before.tolist()


def test_hidden_is_not_taken(things):
    log = EventLog(things)
    scene = result(things, (1, BOX, 0.0), (2, CAN, 0.2))
    log.update(*scene)
    hidden = np.array([0, 0.5], np.float32)
    assert [(e.kind, e.id) for e in log.update(*scene, hidden)] == [(HIDDEN, 2)]
    assert log.update(*scene, 2 * hidden) == []
    assert [(e.kind, e.id) for e in log.update(*scene)] == [(SEEN, 2)]


def test_nothing_is_said_of_the_first_result_after_a_reset(things):
    log = EventLog(things)
    log.update(*result(things, (1, BOX, 0.0)))
    log.forget()
    assert log.update(*result(things, (7, CAN, 0.0))) == []
