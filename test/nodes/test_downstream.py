# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Activating waits for the stages that come next, where it is asked to."""

import threading

import pytest

pytest.importorskip('rclpy')

from hooc_perception.ros.health import downstream
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.qos import qos
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.node import Node  # noqa: E402
from sensor_msgs.msg import PointCloud2  # noqa: E402

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
TOPIC = 'pixels/probabilities'


class Speaker(StageNode):
    """A stage that publishes what two others work on, and what nobody does."""

    def __init__(self, **kwargs):
        super().__init__('classification_node', **kwargs)

    def configure(self):
        self.publisher(PointCloud2, TOPIC)
        self.publisher(PointCloud2, 'views/points')


@pytest.fixture
def listener(bench):
    """Return the function that makes a listener of a name and namespace."""
    def make(name, namespace='/hooc'):
        node = Node(name, namespace=namespace, context=bench.context)
        node.create_subscription(PointCloud2, f'/hooc/{TOPIC}', lambda _: None, qos(TOPIC))
        bench.nodes.append(node)
    return make


def test_activating_waits_until_the_next_stages_are_found(bench, listener):
    node = bench.add(Speaker, wait_for_stages=True)
    assert node.trigger_configure() == SUCCESS
    listener('candidate_node')
    late = threading.Timer(0.3, listener, ['parsing_node'])
    late.start()
    assert node.trigger_activate() == SUCCESS
    assert node.count_subscribers(f'/hooc/{TOPIC}') == 2
    late.join()


def test_who_is_missing_is_named_and_the_node_stays_inactive(bench, listener, monkeypatch):
    monkeypatch.setattr(downstream, 'FOUND_TIMEOUT_S', 0.3)
    node = bench.add(Speaker, wait_for_stages=True)
    assert node.trigger_configure() == SUCCESS
    listener('candidate_node')
    listener('parsing_node', '/another')
    assert node.trigger_activate() == FAILURE
    code, sentence = bench.reasons(node)['node']
    assert code == 'activate_failed' and not node.active
    assert sentence.startswith(f'parsing_node did not subscribe to {TOPIC} within 0.3 s')
    listener('parsing_node')
    assert node.trigger_activate() == SUCCESS


def test_nobody_is_waited_for_unless_asked(bench):
    node = bench.add(Speaker)
    assert node.trigger_configure() == SUCCESS and node.trigger_activate() == SUCCESS
