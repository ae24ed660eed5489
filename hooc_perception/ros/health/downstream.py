# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Wait for the nodes downstream of a node: what it publishes before it finds them is lost."""

from collections.abc import Mapping
import time
from typing import TYPE_CHECKING

from hooc_perception.chain import CHAIN, REPLAY, TOPICS
from hooc_perception.errors import HoocError
from hooc_perception.ros.health.states import LifecycleStates
from rclpy.node import Node

if TYPE_CHECKING:
    from hooc_perception.ros.lifecycle.endpoints import EndpointNode

FOUND_TIMEOUT_S = 30.0
_POLL_S = 0.01
_ASK_S = 0.25
_ORDER = (REPLAY, *CHAIN)


def wait_for_consumers(node: Node, topics: Mapping[str, str]) -> None:
    """
    Wait until a node has found every node of its namespace that needs its topics.

    DDS discovers endpoints in its own threads, so that a callback may wait.

    :param topics: {topic as published: its name in the table of topics}.
    :raises HoocError: if a node is still missing after FOUND_TIMEOUT_S.
    """
    deadline = time.monotonic() + FOUND_TIMEOUT_S
    while missing := missing_consumers(node, topics):
        if time.monotonic() > deadline:
            absent = sorted(set().union(*missing.values()))
            raise HoocError(
                f'{" and ".join(absent)} did not subscribe to {", ".join(sorted(missing))} '
                f'within {FOUND_TIMEOUT_S:g} s: start the whole chain in one namespace, or set '
                'wait_for_stages to false')
        time.sleep(_POLL_S)


def missing_consumers(node: Node, topics: Mapping[str, str]) -> dict[str, set[str]]:
    """Return {topic: names of the nodes that need it and were not found yet}."""
    missing: dict[str, set[str]] = {}
    for topic, row in topics.items():
        there = {info.node_name for info in node.get_subscriptions_info_by_topic(topic)
                 if info.node_namespace == node.get_namespace()
                 } if TOPICS[row].needed_by else set()
        if absent := set(TOPICS[row].needed_by) - there:
            missing[topic] = absent
    return missing


class Downstream:
    """
    Whether the nodes downstream of a configured node are active, without waiting for them.

    :param topics: {topic as published: its name in the table of topics}.
    """

    def __init__(self, node: 'EndpointNode', topics: Mapping[str, str]) -> None:
        """Prepare queries by a node, until it is cleaned up."""
        self._node, self._topics = node, dict(topics)
        own = _ORDER.index(node.get_name()) if node.get_name() in _ORDER else len(_ORDER)
        # What flows back (views/refused) must be found, but its reader waits for this node.
        later = {name for row in self._topics.values() for name in TOPICS[row].needed_by
                 if _ORDER.index(name) > own}
        self._passive = {f'{node.get_namespace().rstrip("/")}/{name}' for name in later}
        self._states = LifecycleStates(node, self._on_state)
        self._asked = -_ASK_S       # time.monotonic()

    def missing(self) -> str:
        """Return the names of the nodes that are not there or not active yet, '' for none."""
        absent: set[str] = set()
        absent = absent.union(*missing_consumers(self._node, self._topics).values())
        if not absent and self._passive and time.monotonic() - self._asked >= _ASK_S:
            self._asked = time.monotonic()
            self._states.ask(self._passive)
        names = absent or {name.rpartition('/')[2] for name in self._passive}
        return ' and '.join(sorted(names))

    def _on_state(self, name: str, state: str) -> None:
        if state == 'active':
            self._passive.discard(name)
