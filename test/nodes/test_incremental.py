# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The chain of nodes over frame sets that follow one another."""

import json

import numpy as np
import pytest

pytest.importorskip('rclpy')
from hooc_perception.ros.qos import qos  # noqa: E402
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String
from std_srvs.srv import Trigger


def test_what_has_not_changed_is_not_decided_anew(bench, live):
    stages, answer = live()
    candidates = bench.hear(PointCloud2, 'candidates/attributes', qos('candidates/attributes'))
    first = answer()
    assert len(first.poses) == 2 and candidates[-1].width > 0
    stages.given.clear()
    second = answer()
    assert second.poses == first.poses and second.header.stamp != first.header.stamp
    assert not stages.given and candidates[-1].width == 0


def test_reset_and_an_emptied_table_are_decided_anew(bench, live):
    stages, answer = live()
    answer()
    stages.given.clear()
    reset = bench.peer.create_client(Trigger, 'reset')
    assert reset.wait_for_service(5.0)
    done = reset.call_async(Trigger.Request())
    assert bench.spin(done.done)
    # Stage 3 has no reason to propose; parsing does so itself.
    assert len(answer().poses) == 2 and 'parse' in stages.given
    stages.given.clear()
    stages.chosen = []
    assert answer(empty=True).poses == [] and 'parse' in stages.given


def test_events_are_published_where_something_happened(bench, live):
    stages, answer = live()
    heard = bench.hear(String, 'objects/events', qos('objects/events'))
    answer()
    answer()
    bench.rest(0.2)
    assert not heard
    stages.chosen = []
    answer(empty=True)
    assert bench.spin(lambda: heard)
    told = json.loads(heard[0].data)
    assert told['format'] == 'hooc-events/1' and told['frame'] == 'table'
    assert [(e['event'], e['category']) for e in told['events']] == [
        ('taken', 'box'), ('taken', 'can')]
    assert np.isfinite([e['translation'] for e in told['events']]).all()
