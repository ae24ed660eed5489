# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The lifecycle states of other nodes, queried without waiting."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from lifecycle_msgs.srv import GetState
from rclpy.client import Client
from rclpy.task import Future

if TYPE_CHECKING:
    from hooc_perception.ros.lifecycle.endpoints import EndpointNode


@dataclass
class _Query:
    """The client of another node, and its pending request, if any."""

    client: Client
    pending: Future | None = None

    def cancel(self) -> None:
        """Drop the pending request."""
        if self.pending:
            self.client.remove_pending_request(self.pending)
            self.pending = None


class LifecycleStates:
    """
    Query the states of other nodes; a busy node does not reply.

    :param on_state: called with the full name of a node and the label of its state.
    """

    def __init__(self, node: 'EndpointNode', on_state: Callable[[str, str], object]) -> None:
        """Prepare queries by a node, until it is cleaned up."""
        self._node, self._on_state = node, on_state
        self._queries: dict[str, _Query] = {}       # by full name

    def ask(self, names: Iterable[str]) -> None:
        """Query nodes by full name; earlier requests that are still pending are dropped."""
        for name in names:
            if name not in self._queries:
                client = self._node.create_client(GetState, f'{name}/get_state')
                self._queries[name] = _Query(self._node.owned(self._node.destroy_client, client))
            query = self._queries[name]
            query.cancel()
            if query.client.service_is_ready():
                query.pending = query.client.call_async(GetState.Request())
                query.pending.add_done_callback(
                    self._node.guarded(partial(self._on_response, name)))

    def forget(self) -> None:
        """Drop all pending requests."""
        for query in self._queries.values():
            query.cancel()

    def _on_response(self, name: str, future: Future) -> None:
        response = future.result()
        if response is not None:
            self._on_state(name, response.current_state.label)
