# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes in this process, beside a node of the test, on a domain of their own."""

import time

import pytest


class Bench:
    """An executor with the node under test and a `peer` that talks to it."""

    def __init__(self, context):
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        self.context = context
        self.peer = Node('peer', namespace='/hooc', context=context)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.peer)
        self.heard, self.nodes = {}, []

    def add(self, kind, **parameters):
        """Return a node with these parameters, spun with the others."""
        from rclpy.parameter import Parameter
        node = kind(context=self.context, parameter_overrides=[
            Parameter(name.replace('__', '.'), value=value)
            for name, value in parameters.items()])
        self.executor.add_node(node)
        self.nodes.append(node)
        return node

    def hear(self, kind, topic, profile):
        """Collect what is said on a topic, in the list that is returned."""
        self.heard[topic] = []
        self.peer.create_subscription(kind, topic, self.heard[topic].append, profile)
        return self.heard[topic]

    def spin(self, condition, timeout_s=10.0):
        """Serve callbacks until a condition holds; return whether it came to hold."""
        deadline = time.monotonic() + timeout_s
        while not (value := condition()) and time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)
        return value

    def rest(self, seconds=0.4):
        """Serve callbacks for so long."""
        self.spin(lambda: False, seconds)

    def reasons(self, node):
        """Return {thing: (reason code, sentence)} of a node's diagnostics."""
        return {status.name.partition(': ')[2]: (
            next(v.value for v in status.values if v.key == 'reason'), status.message)
            for status in node.diagnostics.statuses()}


@pytest.fixture
def bench():
    """Return a Bench."""
    rclpy = pytest.importorskip('rclpy')
    from hooc_perception.supervisor.environment import claim_domain
    domain, claim = claim_domain()
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    bench = Bench(context)
    yield bench
    for node in (*bench.nodes, bench.peer):
        node.destroy_node()
    bench.executor.shutdown()
    rclpy.try_shutdown(context=context)
    claim.close()


@pytest.fixture
def cheap():
    """Return parameters of nodes that do as little work as they can be told to."""
    return {
        'candidate_node': {'propose.samples': 300, 'propose.pool': 10, 'propose.refine_steps': 5,
                           'propose.polish': 2, 'propose.polish_steps': 2,
                           'propose.per_category': 2},
        'parsing_node': {'parse.rounds': 0, 'parse.polish_steps': 0, 'parse.patience': 0,
                         'parse.finalists': 1}}
