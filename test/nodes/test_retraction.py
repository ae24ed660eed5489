# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""In place of a parsing node that has died, everything that it said is taken back."""

import importlib.util
import json
from pathlib import Path
import sys
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray  # noqa: E402
from hooc_perception.ros.qos import qos
from hooc_perception.supervisor.displayed import Displayed
from hooc_perception.supervisor.retraction import Retraction
from rclpy.clock import Clock  # noqa: E402
from rclpy.node import Node  # noqa: E402
from sensor_msgs.msg import PointCloud2  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

CLASSES = {'1': {'name': 'tea cup'}}


def test_all_topics_are_emptied_and_every_marker_is_deleted(bench):
    watchdog = Node('watchdog', namespace='/hooc', context=bench.context)
    bench.nodes.append(watchdog)
    bench.executor.add_node(watchdog)
    shown = Displayed(watchdog)
    speak = {topic: bench.peer.create_publisher(kind, topic, qos(topic)) for kind, topic in (
        (MarkerArray, 'objects/markers'), (String, 'objects/labels'))}
    speak['objects/labels'].publish(String(data=json.dumps(
        {'classes': CLASSES, 'objects': {'7': {'category': 'tea cup'}}})))
    gone, there = Marker(ns='can', id=1, action=Marker.DELETE), Marker(ns='can', id=1)
    for markers in ([there], [gone, Marker(ns='tea cup', id=7), Marker(ns='can', id=2)]):
        speak['objects/markers'].publish(MarkerArray(markers=markers))
        assert bench.spin(lambda m=markers: shown.labels and (m[-1].ns, m[-1].id)
                          in shown.markers)
    heard = {topic: bench.hear(kind, topic, qos('objects/poses')) for kind, topic in (
        (PoseArray, 'objects/poses'), (PoseArray, 'objects/tea_cup/poses'),
        (PointCloud2, 'objects/attributes'), (PointCloud2, 'scene/unexplained'),
        (String, 'scene/summary'), (String, 'objects/labels'),
        (MarkerArray, 'objects/markers'))}
    bench.rest(0.2)
    for messages in heard.values():
        messages.clear()
    empty = Retraction(watchdog, shown)
    for _ in range(2):      # who comes late has to hear of every marker, too
        empty.publish('rig')
        assert bench.spin(lambda: all(heard.values()) and not shown.markers), heard
        last = {topic: messages.pop() for topic, messages in heard.items()}
        assert not last['objects/poses'].poses and not last['objects/tea_cup/poses'].poses
        assert last['objects/attributes'].width == last['scene/unexplained'].width == 0
        stamp = last['objects/poses'].header.stamp
        assert {last[topic].header.frame_id for topic in (
            'objects/poses', 'objects/attributes', 'scene/unexplained')} == {'rig'}
        assert json.loads(last['objects/labels'].data) == {'classes': CLASSES, 'objects': {}}
        summary = json.loads(last['scene/summary'].data)
        assert summary['stamp_ns'] == stamp.sec * 10 ** 9 + stamp.nanosec
        assert summary['candidates'] == 0 and set(summary['energy'].values()) == {None}
        markers = last['objects/markers'].markers
        assert {(m.ns, m.id) for m in markers if m.action == Marker.DELETE} == {
            ('tea cup', 7), ('can', 2)}
        assert all(m.header.frame_id == 'rig' and m.header.stamp == stamp for m in markers)
        assert all(m.action in (Marker.DELETE, Marker.DELETEALL) for m in markers)
    empty.close()


class Endpoints:
    """A node as it is seen here, for messages that are not installed."""

    def __init__(self):
        self.sent, self.takes = {}, {}

    def create_publisher(self, kind, topic, profile):
        return SimpleNamespace(publish=self.sent.setdefault(topic, []).append)

    def create_subscription(self, kind, topic, take, profile):
        self.takes[topic] = take

    def resolve_topic_name(self, topic):
        return f'/hooc/{topic}'

    def get_topic_names_and_types(self):
        return []

    def get_clock(self):
        return Clock()


@pytest.fixture
def stubs(monkeypatch):
    """Put stand-ins for vision_msgs and moveit_msgs in place; return both msg modules."""
    spec = importlib.util.spec_from_file_location(
        'stub_messages', Path(__file__).parents[1] / 'ros' / 'stub_messages.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for package in ('moveit_msgs', 'vision_msgs'):
        module.install(monkeypatch, package)
    from moveit_msgs import msg
    return msg


def test_our_objects_leave_the_planning_scene_and_the_users_stay(stubs):
    node = Endpoints()
    shown = Displayed(node)
    shown.watch_planning_scene()
    shown.watch_planning_scene()
    kind, hear = stubs.CollisionObject, node.takes['/planning_scene']

    def thing(name, category, operation=kind.ADD):
        made = kind(id=name, operation=operation)
        made.type.key = category
        return made

    scene = stubs.PlanningScene(is_diff=True)
    scene.world.collision_objects = [
        thing('tea_cup_7', 'tea cup'), thing('can_1', 'can'), thing('can_2', 'can'),
        thing('wall', ''), thing('wall_2', ''), thing('can_lid', 'can')]
    hear(scene)
    scene = stubs.PlanningScene(is_diff=True)
    scene.world.collision_objects = [thing('can_1', '', kind.REMOVE)]
    hear(scene)
    empty = Retraction(node, shown, detections=True)
    empty.publish('rig')
    diff, = node.sent['/planning_scene']
    assert diff.is_diff and diff.robot_state.is_diff
    removed = diff.world.collision_objects
    assert {o.id for o in removed} == {'tea_cup_7', 'can_2'}
    assert all(o.operation == kind.REMOVE and o.header.frame_id == 'rig' for o in removed)
    detections, = node.sent['objects/detections']
    assert detections.header.frame_id == 'rig' and not detections.detections
    # Not again what everybody has heard.
    hear(diff)
    empty.publish('rig')
    assert len(node.sent['/planning_scene']) == 1


def test_without_their_packages_the_other_topics_are_emptied(monkeypatch):
    for package in ('moveit_msgs', 'vision_msgs'):
        monkeypatch.setitem(sys.modules, f'{package}.msg', None)
    node = Endpoints()
    shown = Displayed(node)
    shown.watch_planning_scene()
    Retraction(node, shown, detections=True).publish('rig')
    assert '/planning_scene' not in node.takes and 'objects/detections' not in node.sent
    assert not node.sent['/hooc/objects/poses'][0].poses
