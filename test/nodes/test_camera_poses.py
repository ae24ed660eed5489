# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where cameras stand: by parameters that may change, and by tf2 at the stamp of the image."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy')

from hooc_perception.nodes.ingestion_node import IngestionNode
from hooc_perception.ros.inputs import camera_poses
from hooc_perception.ros.messages import conversions as c
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402

spec = importlib.util.spec_from_file_location('raw_camera', Path(__file__).with_name(
    'raw_camera.py'))
raw_camera = importlib.util.module_from_spec(spec)
spec.loader.exec_module(raw_camera)
ROTATION, start = raw_camera.ROTATION, raw_camera.start
S = 10 ** 9


def height(bench, node, name='a'):
    """Return z of the pose in use of a camera, m; None before its first frame."""
    camera = node.work.assembly.frames[name].camera
    return camera and round(float(camera.T_world_camera[2, 3]), 6)


def test_a_declared_pose_may_change_while_running(bench):
    node, (raw,), heard = start(bench, 'a', extrinsics__a=[0.1, 0.2, 1.0, *ROTATION])
    raw.send(S)
    assert bench.spin(lambda: height(bench, node) == 1.0)
    (result,) = node.set_parameters([Parameter('extrinsics.a', value=[0.1, 0.2, 1.5, *ROTATION])])
    assert result.successful
    raw.send(2 * S)
    assert bench.spin(lambda: height(bench, node) == 1.5)


@pytest.mark.parametrize('value, word', [
    ([1.0], '1 numbers'), ('here', "'here'"), ([0.0] * 7, 'norm 1'),
    ([np.nan, 0.0, 1.0, *ROTATION], 'finite')])
def test_what_is_no_pose_is_refused_in_every_state(bench, value, word):
    node = bench.add(IngestionNode, cameras=['a'], warm_up=False)
    for change in (node.trigger_configure, node.trigger_activate, node.trigger_deactivate,
                   node.trigger_cleanup):
        assert change() == TransitionCallbackReturn.SUCCESS
        (result,) = node.set_parameters([Parameter('extrinsics.a', value=value)])
        assert not result.successful
        assert 'extrinsics.a' in result.reason and word in result.reason
        assert node.poses['a'] == ()


def test_an_image_that_overtakes_its_latched_pose_waits_for_it(bench):
    node, (raw, other), heard = start(bench, 'a', 'b')
    for stamp in (S, 2 * S):
        raw.send(stamp)
        other.send(stamp)
    assert bench.spin(lambda: bench.reasons(node).get('b', ('',))[0] == 'no_extrinsics')
    bench.rest(0.2)
    raw.stand()
    other.stand()
    assert bench.spin(lambda: heard['a'] and heard['b'])
    assert c.nanoseconds(heard['a'][0].header.stamp) == 2 * S
    raw.stand()     # the pose again, as of a driver that repeats it: the image went out already
    bench.rest(0.2)
    assert len(heard['a']) == 1


class TransformException(Exception):
    pass


class ExtrapolationException(TransformException):
    pass


class Buffer:
    """What tf2's does: poses at stamps, 10 s of them, between the first and the last only."""

    def __init__(self):
        self.static, self.moving = {}, {}

    def say(self, source, stamp_ns, z):
        known = self.moving.setdefault(source, {})
        if not known or stamp_ns > max(known) - 10 * S:
            known[stamp_ns] = z
        for old in [t for t in known if t < max(known) - 10 * S]:
            del known[old]

    def lookup_transform(self, target, source, time):
        known = self.moving.get(source)
        if source in self.static:
            z = self.static[source]
        elif known is None:
            raise TransformException(source)
        elif not known or not min(known) <= time.nanoseconds <= max(known):
            raise ExtrapolationException(source)
        else:
            z = np.interp(time.nanoseconds, sorted(known), [known[t] for t in sorted(known)])
        return c.transform_message((0.1, 0.2, float(z)), ROTATION, c.header(0, target), source)

    def clear(self):
        self.moving = {source: {} for source in self.moving}


@pytest.fixture
def tf(monkeypatch):
    """Return the listeners that are there, [(Buffer, node)], as if tf2 were installed."""
    listeners = []

    class TransformListener:
        def __init__(self, buffer, node):
            self.entry = (buffer, node)
            listeners.append(self.entry)

        def unregister(self):
            listeners.remove(self.entry)

    for kind in (Buffer, TransformListener, TransformException, ExtrapolationException):
        monkeypatch.setattr(camera_poses, kind.__name__, kind, raising=False)
    return listeners


def test_a_static_pose_serves_every_stamp(bench, tf):
    node, (raw,), heard = start(bench, 'a')
    tf[0][0].static['a_optical'] = 1.25
    for stamp in (S, 10 ** 9 * S, 0):
        raw.send(stamp)
    assert bench.spin(lambda: height(bench, node) == 1.25)
    assert node.poses['a'] == ()


def test_a_camera_on_an_arm_is_where_it_was_at_the_stamp(bench, tf):
    node, (raw,), heard = start(bench, 'a')
    for stamp, z in ((S, 1.0), (3 * S, 1.4)):
        tf[0][0].say('a_optical', stamp, z)
    raw.send(2 * S)
    assert bench.spin(lambda: height(bench, node) == 1.2)


def test_an_image_waits_for_its_pose_until_the_next_comes(bench, tf):
    node, (raw,), heard = start(bench, 'a')
    say = tf[0][0].say
    say('a_optical', S, 1.0)
    raw.send(2 * S)
    bench.rest(0.2)
    assert heard['a'] == []
    say('a_optical', 2 * S, 1.2)
    raw.send(3 * S)
    assert bench.spin(lambda: len(heard['a']) == 1)
    assert height(bench, node) == 1.2 and 'a' not in node.work.assembly.sets.drops
    # One whose pose has not even come by then is dropped, and counted.
    raw.send(4 * S)
    assert bench.spin(lambda: bench.reasons(node).get('a', ' ')[0] == 'late_extrinsics')
    assert 'a_optical' in bench.reasons(node)['a'][1] and len(heard['a']) == 1


def test_poses_of_before_a_loop_are_forgotten(bench, tf):
    node, (raw,), heard = start(bench, 'a')
    buffer = tf[0][0]
    for loop in range(2):
        # The second time not as far as tf2 would mix the old with the new.
        for stamp in range(100, 116 if loop else 131, 5):
            buffer.say('a_optical', stamp * S, 1.0 + 0.1 * loop)
            raw.send(stamp * S)
            bench.rest(0.03)
        assert bench.spin(lambda: height(bench, node) == 1.0 + 0.1 * loop)


def test_poses_of_before_a_short_loop_are_forgotten(bench, tf):
    node, (raw,), heard = start(bench, 'a')
    for stamp in (100, 103):
        tf[0][0].say('a_optical', stamp * S, 1.0)
    raw.send(103 * S)
    assert bench.spin(lambda: len(heard['a']) == 1)
    raw.send(101 * S)
    assert bench.spin(lambda: node.work.assembly.sets.drops['a', 'time_jump'])
    assert tf[0][0].moving['a_optical'] == {}


def test_cleaning_up_ends_to_listen(bench, tf):
    node = bench.add(IngestionNode, cameras=['a'], warm_up=False)
    for _ in range(3):
        assert node.trigger_configure()
        assert [listener[1] for listener in tf] == [node]
        assert node.trigger_cleanup()
        assert tf == []
