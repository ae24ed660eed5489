# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a running node still answers."""

import time

from hooc_perception.supervisor.supervisor import Supervisor
from lifecycle_msgs.srv import GetState
from rclpy.task import Future

# A node answers between two computations, so that a low rate is enough.
PERIOD_S = 5.0


class Heartbeat:
    """
    Query the state of a node every few seconds and measure for how long no answer has come.

    :param supervisor: gives the client of the node.
    :param name: of the node.
    :param hung_s: silence that counts as a hang; 0 = none does.
    :ivar silent_s: seconds of the silence that counted as a hang, 0.0 = none did.
    """

    def __init__(self, supervisor: Supervisor, name: str, hung_s: float) -> None:
        """Regard the node as alive from now on."""
        self._client, self._hung_s = supervisor.client(name, GetState), hung_s
        self.reset()

    def reset(self) -> None:
        """Regard the node as alive from now on and forget earlier queries."""
        self._heard = self._asked = self._checked = time.monotonic()
        self._futures: list[Future] = []
        self.silent_s = 0.0

    def check(self) -> bool:
        """Query again if it is time to; return False once, when the node turns out to hang."""
        now = time.monotonic()
        if now - self._checked > self._hung_s / 4:
            self.reset()        # nobody was listening, so it is no silence
        self._checked = now
        if any(future.done() for future in self._futures):
            self._heard, self._futures = now, []
        if not self._hung_s or self.silent_s:
            return True
        if now - self._heard > self._hung_s:
            self.silent_s = now - self._heard
            return False
        if now - self._asked > min(PERIOD_S, self._hung_s / 4):
            self._asked = now
            self._futures.append(self._client.call_async(GetState.Request()))
        return True
