# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The replay node plays again whenever it is activated, and keeps nothing of the last time."""

import json

import pytest

pytest.importorskip('rclpy')

from hooc_perception.io.bags.reader import BagScene
from hooc_perception.nodes.replay_node import ReplayNode
from hooc_perception.ros.qos import qos
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from std_msgs.msg import String  # noqa: E402

SUCCESS = TransitionCallbackReturn.SUCCESS


def test_each_activation_plays_the_bag_with_the_same_timer(bench, repository):
    bag = repository / 'bags' / 'demo'
    if not (bag / 'metadata.yaml').is_file():
        pytest.skip('no bundled scene')
    node = bench.add(ReplayNode, bag=str(bag), wait_for_subscribers=0)
    states = bench.hear(String, 'replay/status', qos('replay/status'))
    assert node.trigger_configure() == SUCCESS
    timers = len(list(node.timers))
    for i in range(3):
        assert node.trigger_activate() == SUCCESS
        assert bench.spin(lambda: [json.loads(s.data)['state'] for s in states].count('finished')
                          == i + 1)
        assert json.loads(states[-1].data)['images'] == 3
        assert node.trigger_deactivate() == SUCCESS
        assert len(list(node.timers)) == timers
        # Inactive, it does nothing: the player has played all and is not asked again.
        assert node.work._timer.is_canceled()


def test_a_camera_without_images_is_named(bench, repository, monkeypatch):
    bag = repository / 'bags' / 'demo'
    if not (bag / 'metadata.yaml').is_file():
        pytest.skip('no bundled scene')
    monkeypatch.setattr(BagScene, 'warnings', ('there is no depth image of b',))
    node = bench.add(ReplayNode, bag=str(bag))
    assert node.trigger_configure() == SUCCESS
    assert bench.reasons(node)['bag'] == ('incomplete', 'there is no depth image of b')
