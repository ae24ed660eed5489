# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a node that lives still answers."""

import time

from lifecycle_msgs.srv import GetState

# A node answers between two computations, so now and then is enough.
ASK_EVERY_S = 5.0


class Heartbeat:
    """
    Ask a node for its state every few seconds, and mind how long no answer has come.

    :param supervisor: gives the node's client.
    :param name: of the node.
    :ivar hung_s: silence that counts as a hang; 0 = none does.
    :ivar silent_s: seconds of the silence that was taken for a hang, 0.0 while there was none.
    """

    def __init__(self, supervisor, name, hung_s):
        """Regard the node as alive from now on."""
        self._client, self.hung_s = supervisor.client(name, GetState), hung_s
        self.start_anew()

    def start_anew(self):
        """Regard the node as alive from now on, whatever was asked before."""
        self._heard = self._asked = self._looked = time.monotonic()
        self._futures, self.silent_s = [], 0.0

    def beats(self):
        """Ask again if it is time to; return False once, when the node turns out to hang."""
        now = time.monotonic()
        if now - self._looked > self.hung_s / 4:
            self.start_anew()       # nobody has listened, so no silence was heard
        self._looked = now
        if any(future.done() for future in self._futures):
            self._heard, self._futures = now, []
        if not self.hung_s or self.silent_s:
            return True
        if now - self._heard > self.hung_s:
            self.silent_s = now - self._heard
            return False
        if now - self._asked > min(ASK_EVERY_S, self.hung_s / 4):
            self._asked = now
            self._futures.append(self._client.call_async(GetState.Request()))
        return True
