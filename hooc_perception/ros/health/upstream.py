# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the nodes that should deliver are active: their publishers are there in any state."""

from functools import partial

from lifecycle_msgs.srv import GetState


class Upstream:
    """
    Ask the publishers of topics for their lifecycle state; one that computes does not reply.

    :param topics: names of topics, relative to the node.
    """

    def __init__(self, node, topics):
        """Prepare to ask on behalf of a StageNode."""
        self._node, self._topics = node, tuple(topics)
        self._asked = {}        # full name of a node -> [client, pending future or None]

    def ask(self):
        """Ask everybody once; an earlier question that is still open counts no more."""
        names = {(info.node_namespace.rstrip('/') + '/' + info.node_name)
                 for topic in self._topics
                 for info in self._node.get_publishers_info_by_topic(topic)}
        for name in names:
            if name not in self._asked:
                client = self._node.create_client(GetState, f'{name}/get_state')
                self._asked[name] = [self._node.owned(self._node.destroy_client, client), None]
            client, pending = self._asked[name]
            if pending:
                client.remove_pending_request(pending)
                self._asked[name][1] = None
            if client.service_is_ready():
                self._asked[name][1] = client.call_async(GetState.Request())
                self._asked[name][1].add_done_callback(partial(self._told, name))

    def forget(self):
        """Take back what was asked: everything is there."""
        for asked in self._asked.values():
            client, pending = asked
            if pending:
                client.remove_pending_request(pending)
                asked[1] = None

    def _told(self, name, future):
        state = future.result().current_state.label
        if state != 'active':
            self._node.diagnostics.warn('input', 'not_active', (
                f'views arrive, but nothing comes from {name}, which is {state}; activate it'))
