# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Wait for the nodes downstream of a node: what it publishes before it finds them is lost."""

from collections.abc import Mapping
import time

from hooc_perception.chain import TOPICS
from hooc_perception.errors import HoocError
from rclpy.node import Node

FOUND_TIMEOUT_S = 30.0
_POLL_S = 0.01


def wait_for_consumers(node: Node, topics: Mapping[str, str]) -> None:
    """
    Wait until a node has found every node of its namespace that needs its topics.

    DDS discovers endpoints in its own threads, so that a callback may wait.

    :param topics: {topic as published: its name in the table of topics}.
    :raises HoocError: if a node is still missing after FOUND_TIMEOUT_S.
    """
    deadline = time.monotonic() + FOUND_TIMEOUT_S
    needed = {topic: TOPICS[row].needed_by for topic, row in topics.items()
              if TOPICS[row].needed_by}
    while missing := _missing(node, needed):
        if time.monotonic() > deadline:
            absent = sorted(set().union(*missing.values()))
            raise HoocError(
                f'{" and ".join(absent)} did not subscribe to {", ".join(sorted(missing))} '
                f'within {FOUND_TIMEOUT_S:g} s: start the whole chain in one namespace, or set '
                'wait_for_stages to false')
        time.sleep(_POLL_S)


def _missing(node: Node, needed: Mapping[str, tuple[str, ...]]) -> dict[str, set[str]]:
    """Return {topic: names of the nodes in `needed` that were not found yet}."""
    missing: dict[str, set[str]] = {}
    for topic, names in needed.items():
        there = {info.node_name for info in
                 node.get_subscriptions_info_by_topic(topic)
                 if info.node_namespace == node.get_namespace()}
        if absent := set(names) - there:
            missing[topic] = absent
    return missing
