# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Nothing that the parsing node has said outlives its watching, whatever ends that."""

import json
import os
import signal
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray  # noqa: E402
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import Energy, ParsedScene
from hooc_perception.nodes import parsing_node
from hooc_perception.nodes.warm_up import made_up_scene
from hooc_perception.ros.messages import conversions as c
from hooc_perception.ros.messages.stages import candidates_messages, probabilities_message
from hooc_perception.ros.qos import qos
from lifecycle_msgs.msg import Transition  # noqa: E402
from lifecycle_msgs.srv import ChangeState  # noqa: E402
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from sensor_msgs.msg import PointCloud2  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

SUCCESS = TransitionCallbackReturn.SUCCESS
STAMP = 1_700_000_000_250_000_000
ENDS = {'deactivate': Transition.TRANSITION_DEACTIVATE,
        'shutdown': Transition.TRANSITION_ACTIVE_SHUTDOWN}
KINDS = {'objects/poses': PoseArray, 'objects/attributes': PointCloud2,
         'objects/labels': String, 'objects/markers': MarkerArray, 'scene/summary': String,
         'scene/unexplained': PointCloud2, 'objects/box/poses': PoseArray,
         'objects/can/poses': PoseArray}


SPEAKER = """
import sys
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_node import StageNode
from std_msgs.msg import String

class Speaker(StageNode):
    def __init__(self):
        super().__init__('speaker')
        self.trigger_configure(), self.trigger_activate()

    def configure(self):
        return self.publisher(String, 'scene/summary')

    def activate(self):
        self.work.publish(String(data='here'))

    def deactivate(self):
        self.work.publish(String(data='gone'))

sys.exit(run_node(Speaker))
"""


class Adapter:
    """Another package's view of the answer, which may break."""

    def __init__(self):
        self.told, self.broken = [], False

    def publish(self, scene):
        self.told.append(len(scene.objects))
        assert not self.broken, 'no such frame'

    def clear(self, stamp_ns, frame):
        self.told.append('clear')
        assert not self.broken, 'no such frame'


@pytest.fixture(scope='module')
def folder(make_folder):
    """Return the ModelFolder of a box and a can."""
    return make_folder({'box': trimesh.creation.box((0.1, 0.06, 0.08)),
                        'can': trimesh.creation.cylinder(0.04, 0.12)})


@pytest.fixture
def parsing(bench, folder, monkeypatch):
    """Return an active node that found a box and a can, what a subscriber heard, an adapter."""
    views, p, pool, models = made_up_scene(folder.models, folder.cameras)
    adapter, observation, some = Adapter(), observe(views), np.ones(2, np.float32)
    parsed = ParsedScene(pool.take([0, 1]), Energy(0.5, 0.25, 0.125), some, some, some,
                         np.full(2, 2, np.uint8), pool)
    monkeypatch.setattr(JointMethod, 'parse', lambda *args: parsed)
    monkeypatch.setattr(parsing_node, 'adapters_of', lambda node: [adapter])
    node = bench.add(parsing_node.ParsingNode, model=str(folder.path), warm_up=False,
                     sigmas=False)
    head = c.header(STAMP, 'table')
    poses, attributes = candidates_messages(pool, head)
    messages = {'probabilities': probabilities_message(p, observation,
                                                       [m.name for m in models], head),
                'poses': poses, 'attributes': attributes}
    heard = listen(bench)

    def look():
        node.work.on_set(STAMP, observation, messages)
        assert bench.spin(lambda: all(heard.values())
                          and len(heard['objects/poses'][-1].poses) == 2)
    assert node.trigger_configure() == SUCCESS and node.trigger_activate() == SUCCESS
    look()
    return SimpleNamespace(node=node, heard=heard, adapter=adapter, look=look)


def listen(bench):
    """Return {topic: messages}, the latched ones and those to come."""
    return {topic: bench.hear(kind, topic, qos(
        topic if topic.count('/') == 1 else 'objects/<category>/poses'))
        for topic, kind in KINDS.items()}


def is_taken_back(heard):
    """Return whether the last messages say that nothing is known, in every form."""
    if not all(heard.values()):
        return False
    last = {topic: messages[-1] for topic, messages in heard.items()}
    summary = json.loads(last['scene/summary'].data)
    return (all(message.poses == [] for topic, message in last.items() if 'poses' in topic)
            and last['objects/attributes'].width == last['scene/unexplained'].width == 0
            and json.loads(last['objects/labels'].data)['objects'] == {}
            and all(m.action != Marker.ADD for m in last['objects/markers'].markers)
            and summary['energy']['total'] is None and summary['candidates'] == 0)


def change(bench, transition):
    """Return the future of a transition that is asked for from outside."""
    return call(bench, ChangeState, 'parsing_node/change_state',
                transition=Transition(id=transition))


def call(bench, kind, name, **fields):
    """Return the future of a service call."""
    client = bench.peer.create_client(kind, name)
    assert bench.spin(client.service_is_ready)
    return client.call_async(kind.Request(**fields))


def test_deactivating_empties_what_is_latched(bench, parsing):
    assert parsing.node.trigger_deactivate() == SUCCESS
    assert bench.spin(lambda: is_taken_back(parsing.heard))
    late = listen(bench)
    assert bench.spin(lambda: is_taken_back(late))
    assert all(len(messages) == 1 for messages in late.values())
    # The frame set of the old answer is not new after a second activation, either.
    assert parsing.node.trigger_activate() == SUCCESS
    bench.rest(0.2)
    assert is_taken_back(parsing.heard)
    assert parsing.node.trigger_deactivate() == SUCCESS
    assert parsing.node.trigger_cleanup() == SUCCESS
    bench.rest(0.2)
    assert is_taken_back(parsing.heard)


def test_a_second_life_begins_with_nothing_and_ends_so(bench, parsing):
    node = parsing.node
    for step in ('deactivate', 'cleanup', 'configure', 'activate'):
        assert getattr(node, f'trigger_{step}')() == SUCCESS
    late = listen(bench)
    assert bench.spin(lambda: late['objects/labels'])
    assert [topic for topic, messages in late.items() if messages] == ['objects/labels']
    parsing.look()
    assert bench.spin(lambda: all(late.values()))
    assert node.trigger_shutdown() == SUCCESS
    assert bench.spin(lambda: is_taken_back(late))
    last = listen(bench)
    bench.rest(0.3)
    assert not any(last.values())


@pytest.mark.parametrize('end', ['trigger_shutdown', 'on_error'])
def test_the_end_takes_back_what_other_packages_hold(bench, parsing, end):
    act = getattr(parsing.node, end)
    assert (act() if end == 'trigger_shutdown' else act(None)) == SUCCESS
    assert parsing.adapter.told == [2, 'clear']
    assert bench.spin(lambda: is_taken_back(parsing.heard))


def test_markers_are_deleted_one_by_one(bench, parsing):
    shown = {(m.ns, m.id) for m in parsing.heard['objects/markers'][-1].markers}
    assert bench.spin(call(bench, Trigger, 'reset').done)
    assert bench.spin(lambda: is_taken_back(parsing.heard))
    *deleted, rest = parsing.heard['objects/markers'][-1].markers
    assert {(m.ns, m.id) for m in deleted} == shown and len(shown) == 2
    assert all(m.action == Marker.DELETE and m.header.frame_id == 'table' for m in deleted)
    assert rest.action == Marker.DELETEALL and rest.header.frame_id == 'table'


@pytest.mark.parametrize('end', ['deactivate', 'cleanup', 'shutdown'])
def test_who_waits_for_detect_is_told_of_the_end(bench, parsing, end):
    waiting = call(bench, Trigger, 'detect')
    assert bench.spin(lambda: parsing.node.detect._waiting)
    if end == 'cleanup':
        # At once: the reply has not left the node yet when everything goes.
        assert parsing.node.trigger_deactivate() == SUCCESS
        assert parsing.node.trigger_cleanup() == SUCCESS
    else:
        ended = change(bench, ENDS[end])
        assert bench.spin(ended.done) and ended.result().success
    assert bench.spin(waiting.done)
    assert not waiting.result().success
    assert 'deactivated' in json.loads(waiting.result().message)['error']
    # Nor does anybody wait for a node that will not look again.
    refused = call(bench, Trigger, 'detect')
    assert bench.spin(refused.done)
    assert not refused.result().success and 'not active' in refused.result().message


def test_a_broken_adapter_costs_neither_the_answer_nor_the_others(bench, parsing):
    node, other = parsing.node, Adapter()
    node.work.adapters.append(other)
    parsing.adapter.broken = True
    for messages in parsing.heard.values():
        messages.clear()
    parsing.look()
    assert other.told == [2]
    code, sentence = bench.reasons(node)['Adapter']
    assert code == 'unexpected' and 'no such frame' in sentence
    assert node.trigger_deactivate() == SUCCESS
    assert other.told == [2, 'clear'] and parsing.adapter.told[-1] == 'clear'
    assert bench.spin(lambda: is_taken_back(parsing.heard))


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_process_says_its_last_words(bench, number):
    heard = bench.hear(String, 'scene/summary', qos('scene/summary'))
    process = subprocess.Popen(
        [sys.executable, '-c', SPEAKER],
        env={**os.environ, 'ROS_DOMAIN_ID': str(bench.context.get_domain_id())},
        # As a shell starts what it puts into the background.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    try:
        assert bench.spin(lambda: heard, 60.0)
        process.send_signal(number)
        assert bench.spin(lambda: len(heard) == 2)
        assert [message.data for message in heard] == ['here', 'gone']
        assert process.wait(20) == 0
    finally:
        process.kill()
