# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the nodes that work on what a node publishes are found: what goes out before is lost."""

import time

from hooc_perception.chain import TOPICS
from hooc_perception.errors import HoocError

FOUND_TIMEOUT_S = 30.0
_POLL_S = 0.01


def wait_for_workers(node, topics):
    """
    Wait until a node has found every node of its namespace that works on its topics.

    DDS finds endpoints in its own threads, so that a callback may wait.

    :param topics: {topic as published: its row in the table of topics}.
    :raises HoocError: where somebody is still missing after FOUND_TIMEOUT_S.
    """
    deadline = time.monotonic() + FOUND_TIMEOUT_S
    needed = {topic: TOPICS[row].needed_by for topic, row in topics.items()
              if TOPICS[row].needed_by}
    while missing := _missing(node, needed):
        if time.monotonic() > deadline:
            who = sorted(set().union(*missing.values()))
            raise HoocError(
                f'{" and ".join(who)} did not come to listen to {", ".join(sorted(missing))} '
                f'within {FOUND_TIMEOUT_S:g} s: start the whole chain in one namespace, or set '
                'wait_for_stages to false')
        time.sleep(_POLL_S)


def _missing(node, needed):
    """Return {topic: set of the names in `needed` that are not found yet}, no empty ones."""
    missing = {}
    for topic, names in needed.items():
        there = {info.node_name for info in
                 node.get_subscriptions_info_by_topic(node.resolve_topic_name(topic))
                 if info.node_namespace == node.get_namespace()}
        if absent := set(names) - there:
            missing[topic] = absent
    return missing
