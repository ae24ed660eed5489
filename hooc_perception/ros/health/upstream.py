# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the nodes upstream are active: their publishers exist in every lifecycle state."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

from hooc_perception.ros.lifecycle.stage_node import StageNode
from lifecycle_msgs.srv import GetState
from rclpy.client import Client
from rclpy.task import Future


@dataclass
class _Query:
    """The client of a node upstream, and its pending request, if any."""

    client: Client
    pending: Future | None = None

    def cancel(self) -> None:
        """Drop the pending request."""
        if self.pending:
            self.client.remove_pending_request(self.pending)
            self.pending = None


class Upstream:
    """
    Query the lifecycle state of the publishers of topics; a busy node does not reply.

    :param topics: names of topics, relative to the node.
    """

    def __init__(self, node: StageNode, topics: Iterable[str]) -> None:
        """Prepare queries by a node."""
        self._node, self._topics = node, tuple(topics)
        self._queries: dict[str, _Query] = {}       # by full name of a node

    def ask(self) -> None:
        """Query every node once; earlier requests that are still pending are dropped."""
        names = {(info.node_namespace.rstrip('/') + '/' + info.node_name)
                 for topic in self._topics
                 for info in self._node.get_publishers_info_by_topic(topic)}
        for name in names:
            if name not in self._queries:
                client = self._node.create_client(GetState, f'{name}/get_state')
                self._queries[name] = _Query(self._node.owned(self._node.destroy_client, client))
            query = self._queries[name]
            query.cancel()
            if query.client.service_is_ready():
                query.pending = query.client.call_async(GetState.Request())
                query.pending.add_done_callback(
                    self._node.guarded(partial(self._on_state, name)))

    def forget(self) -> None:
        """Drop all pending requests: everything has arrived."""
        for query in self._queries.values():
            query.cancel()

    def _on_state(self, name: str, future: Future) -> None:
        response = future.result()
        if response is not None and (state := response.current_state.label) != 'active':
            self._node.diagnostics.warn('input', 'not_active', (
                f'views arrive, but nothing comes from {name}, which is {state}; activate it'))
