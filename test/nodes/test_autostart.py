# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A node that configures and activates itself, in the right order where it is asked to wait."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from hooc_perception.errors import HoocError
import pytest

pytest.importorskip('rclpy')

from hooc_perception.nodes.ingestion_node import IngestionNode  # noqa: E402
from hooc_perception.ros.health import downstream  # noqa: E402
from hooc_perception.ros.lifecycle import autostart  # noqa: E402
from hooc_perception.ros.lifecycle.stage_node import StageNode  # noqa: E402
from hooc_perception.ros.qos import qos  # noqa: E402
from lifecycle_msgs.srv import GetState  # noqa: E402
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from sensor_msgs.msg import PointCloud2  # noqa: E402
from std_msgs.msg import Header  # noqa: E402

SUCCESS = TransitionCallbackReturn.SUCCESS
TOPIC = 'pixels/probabilities'


class Speaker(StageNode):
    """A stage that publishes what the candidate and the parsing node need."""

    def __init__(self, **kwargs):
        super().__init__('classification_node', **kwargs)

    def configure(self):
        self.publisher(PointCloud2, TOPIC)


class Listener(StageNode):
    """A stage that needs it."""

    def configure(self):
        self.subscription(PointCloud2, TOPIC, lambda _: None)


class Candidates(Listener):
    def __init__(self, **kwargs):
        super().__init__('candidate_node', **kwargs)


class Parsing(Listener):
    def __init__(self, **kwargs):
        super().__init__('parsing_node', **kwargs)


def test_a_node_activates_itself_and_is_then_left_alone(bench):
    node = bench.add(Speaker, autostart=True)
    assert not node.active      # nothing happens before it spins
    assert bench.spin(lambda: node.active)
    assert node.trigger_deactivate() == SUCCESS
    bench.rest(5 * autostart.TICK_S)
    assert node.is_inactive()
    assert bench.reasons(node)['node'][0] == 'not_active'


def test_without_autostart_it_waits_for_others(bench):
    node = bench.add(Speaker)
    bench.rest(5 * autostart.TICK_S)
    assert node.is_unconfigured()


def test_a_node_that_somebody_else_configures_is_theirs(bench):
    node = bench.add(Speaker, autostart=True)
    assert node.trigger_configure() == SUCCESS
    bench.rest(5 * autostart.TICK_S)
    assert node.is_inactive()


def test_it_fails_once_with_its_reason(bench):
    class Broken(Speaker):
        tried = 0

        def configure(self):
            self.tried += 1
            raise HoocError('there is no model')

    node = bench.add(Broken, autostart=True)
    assert bench.spin(lambda: bench.reasons(node).get('node', ' ')[0] == 'configure_failed')
    bench.rest(5 * autostart.TICK_S)
    assert node.tried == 1 and node.is_unconfigured()


def test_it_waits_until_the_nodes_that_need_its_topics_are_active(bench, monkeypatch):
    monkeypatch.setattr(autostart, 'FOUND_TIMEOUT_S', 0.5)
    node = bench.add(Speaker, autostart=True, wait_for_stages=True)
    candidates, parsing = bench.add(Candidates), bench.add(Parsing)
    for other in (candidates, parsing):
        assert other.trigger_configure() == SUCCESS
    assert candidates.trigger_activate() == SUCCESS
    # Subscribed is not enough, and after some time it is a problem.
    assert bench.spin(lambda: bench.reasons(node).get('node', ('', ''))[1].startswith(
        'waits until parsing_node is active'))
    assert bench.spin(lambda: any(value.key == 'count_waits_for_stages' and int(value.value)
                                  for status in node.diagnostics.statuses()
                                  for value in status.values))
    assert not node.active
    assert parsing.trigger_activate() == SUCCESS
    assert bench.spin(lambda: node.active)
    assert bench.reasons(node)['node'][0] == 'ok'


def test_what_flows_back_is_not_waited_for_to_be_active(bench):
    class Parser(Parsing):
        def configure(self):
            self.publisher(Header, 'views/refused')

    node = bench.add(Parser, autostart=True, wait_for_stages=True)
    ingestion = bench.add(IngestionNode, cameras=['a'], warm_up=False)
    bench.rest(5 * autostart.TICK_S)
    assert not node.active
    assert ingestion.trigger_configure() == SUCCESS
    assert bench.spin(lambda: node.active) and ingestion.is_inactive()


def test_downstream_counts_only_nodes_of_its_namespace(bench):
    from rclpy.node import Node
    node = bench.add(Speaker)
    assert node.trigger_configure() == SUCCESS
    for name in ('candidate_node', 'parsing_node'):
        other = Node(name, namespace='/another', context=bench.context)
        other.create_subscription(PointCloud2, f'/hooc/{TOPIC}', lambda _: None, qos(TOPIC))
        bench.nodes.append(other)
    assert bench.spin(lambda: node.count_subscribers(f'/hooc/{TOPIC}') == 2)
    assert downstream.Downstream(node, node.published).missing() == (
        'candidate_node and parsing_node')


@pytest.mark.slow
def test_a_killed_process_that_is_started_again_becomes_active(bench):
    root = str(Path(__file__).resolve().parents[2])
    environment = {**os.environ, 'PYTHONPATH': root, 'ROS_DOMAIN_ID': str(
        bench.context.get_domain_id())}
    command = [sys.executable, '-m', 'hooc_perception.nodes.ingestion_node', '--ros-args', '-p',
               'autostart:=true', '-p', 'cameras:=[a]', '-p', 'warm_up:=false']
    client = bench.peer.create_client(GetState, 'ingestion_node/get_state')

    def active():
        future = client.call_async(GetState.Request())
        done = bench.spin(future.done, 1.0)
        client.remove_pending_request(future)
        return done and future.result().current_state.label == 'active'

    for end in (signal.SIGKILL, signal.SIGINT):
        process = subprocess.Popen(command, env=environment)
        try:
            deadline = time.monotonic() + 120
            while not active():
                assert process.poll() is None and time.monotonic() < deadline
        finally:
            process.send_signal(end)
            code = process.wait(60)
        assert code == (-end if end == signal.SIGKILL else 0)
