# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""docs/nodes.md lists the topics and services that the nodes really have, with type and QoS."""

import importlib
import re

import pytest

pytest.importorskip('rclpy')

from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy  # noqa: E402

NODES = {'ingestion_node': 'IngestionNode', 'classification_node': 'ClassificationNode',
         'candidate_node': 'CandidateNode', 'parsing_node': 'ParsingNode',
         'replay_node': 'ReplayNode'}
# Of rclpy itself, the same in every node.
COMMON = re.compile(r'.*/(parameter_events|rosout|transition_event|diagnostics|clock|tf|'
                    r'tf_static)$')
# There only with a parameter, or on installations with more packages.
OPTIONAL = {'objects/detections', '/tf', '/planning_scene', '/joint_states',
            'views/<camera>/count'}


def section(text, node):
    """Return the part of the page about a node."""
    return re.search(rf'^## {node}\n(.*?)(?=^## |\Z)', text, re.S | re.M)[1]


def documented(text, heading):
    """Return {topic: (type, cell with the QoS)} of the tables with a heading."""
    out = {}
    for table in re.findall(rf'^\| {heading} \|.*?\n\|[-|]+\|\n((?:\|.*\n)*)', text, re.M):
        for row in table.splitlines():
            topics, kind, meaning = (cell.strip() for cell in row.strip('|').split('|')[:3])
            names = re.findall(r'`([^`]+)`', topics)
            kinds = re.findall(r'\b([A-Z]\w+)', re.sub(r'`[^`]*`', '', kind))
            for i, name in enumerate(names):
                out[name] = kinds[min(i, len(kinds) - 1)] if kinds else None, meaning
    return out


def pattern(topic):
    """Return what matches the real name of a documented topic."""
    name = re.sub(r'<\w+>', '[A-Za-z0-9_]+', topic).replace('*', '.*')
    return re.compile(name if topic.startswith('/') else f'/hooc/{name}')


@pytest.fixture(params=NODES)
def node(request, bench, repository):
    """Return (name, configured node)."""
    model, bag = repository / 'models' / 'demo', repository / 'bags' / 'demo'
    if not model.is_dir() or not bag.is_dir():
        pytest.skip('no bundled scene: make it with "make bundle"')
    kind = getattr(importlib.import_module(f'hooc_perception.nodes.{request.param}'),
                   NODES[request.param])
    own = {'bag': str(bag)} if request.param == 'replay_node' else {
        'model': str(model), 'warm_up': False}
    made = bench.add(kind, **own)
    assert made.trigger_configure() == TransitionCallbackReturn.SUCCESS
    return request.param, made


def test_topics_are_as_documented(node, repository):
    name, made = node
    text = section((repository / 'docs' / 'nodes.md').read_text(), name)
    for heading, endpoints in (('publishes', made.publishers), ('subscribes', made.subscriptions)):
        said = documented(text, heading)
        if heading == 'subscribes':
            for topic in re.findall(r'It (?:also )?subscribes `([^`]+)`', text):
                said[topic] = None, ''
        seen = set()
        for endpoint in endpoints:
            topic = getattr(endpoint, 'topic_name', None) or endpoint.topic
            if COMMON.match(topic):
                continue
            rows = [row for row in said if pattern(row).fullmatch(topic)]
            assert rows, f'{name} {heading} {topic}, but the page does not say so'
            # The most exact row is meant: objects/poses, not objects/<category>/poses.
            row = max(rows, key=len)
            seen |= set(rows)
            kind, meaning = said[row]
            if kind:
                assert kind == endpoint.msg_type.__name__, topic
            profile = endpoint.qos_profile
            latched = re.search(r'latched(?: \((\d+)\))?', meaning)
            reliable = re.search(r'reliable \((\d+)\)', meaning)
            if heading == 'publishes':
                assert latched or reliable, f'{topic}: the page does not say its QoS'
                assert (profile.durability == DurabilityPolicy.TRANSIENT_LOCAL) == bool(latched)
                assert profile.depth == int((latched or reliable)[1]), topic
                assert profile.reliability == ReliabilityPolicy.RELIABLE
        missing = [row for row in said if row not in seen and row not in OPTIONAL]
        assert not missing, f'{name} has no endpoints for {missing}'


def test_services_are_as_documented(node, repository):
    name, made = node
    text = section((repository / 'docs' / 'nodes.md').read_text(), name)
    said = documented(text, 'service')
    own = {s.service_name.rpartition('/')[2]: s.srv_type.__name__ for s in made.services
           if s.service_name.startswith('/hooc/') and s.service_name.count('/') == 2}
    assert own == {row: kind for row, (kind, _) in said.items()}
