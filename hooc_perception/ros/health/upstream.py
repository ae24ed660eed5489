# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the nodes upstream are active: their publishers exist in every lifecycle state."""

from collections.abc import Iterable

from hooc_perception.ros.health.states import LifecycleStates
from hooc_perception.ros.lifecycle.stage_node import StageNode


class Upstream:
    """
    Report publishers of topics that are not active; a busy node does not reply.

    :param topics: names of topics, relative to the node.
    """

    def __init__(self, node: StageNode, topics: Iterable[str]) -> None:
        """Prepare queries by a node."""
        self._node, self._topics = node, tuple(topics)
        self._states = LifecycleStates(node, self._on_state)

    def ask(self) -> None:
        """Query every node once."""
        self._states.ask({info.node_namespace.rstrip('/') + '/' + info.node_name
                          for topic in self._topics
                          for info in self._node.get_publishers_info_by_topic(topic)})

    def forget(self) -> None:
        """Drop all pending requests: everything has arrived."""
        self._states.forget()

    def _on_state(self, name: str, state: str) -> None:
        if state != 'active':
            self._node.diagnostics.warn('input', 'not_active', (
                f'views arrive, but nothing comes from {name}, which is {state}; activate it'))
