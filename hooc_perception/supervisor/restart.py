# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Bring one node up without blocking, so that others can be brought up or served meanwhile.

The generators yield whenever they have to wait.
"""

from collections.abc import Generator
import time
from typing import Any, TypeAlias, TypeVar

from hooc_perception.supervisor.services import RETRY_S, TRANSITION_TIMEOUT_S
from hooc_perception.supervisor.supervisor import START_TIMEOUT_S, Supervisor
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.task import Future

T = TypeVar('T')
Steps: TypeAlias = Generator[None, None, T]
_NEXT = {State.PRIMARY_STATE_UNCONFIGURED: Transition.TRANSITION_CONFIGURE,
         State.PRIMARY_STATE_INACTIVE: Transition.TRANSITION_ACTIVATE}


def pause(seconds: float) -> Steps[None]:
    """Wait."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        yield


def bring_up(supervisor: Supervisor, name: str) -> Steps[str | None]:
    """Configure and activate a node; return None, or the reason why it is not active."""
    process = supervisor.processes[name]
    wanted = None
    while process.exit_code() is None:
        # A node that is being configured answers when it is done.
        state = yield from _call(supervisor, name, GetState, GetState.Request(),
                                 START_TIMEOUT_S if wanted is None else TRANSITION_TIMEOUT_S)
        if state is None:
            break
        if state.current_state.id == State.PRIMARY_STATE_ACTIVE:
            return None
        wanted = _NEXT.get(state.current_state.id)
        if wanted is None:
            yield
            continue
        # If the response gets lost, the state tells how it went.
        request = ChangeState.Request(transition=Transition(id=wanted))
        result = yield from _call(supervisor, name, ChangeState, request, RETRY_S)
        if result is not None and not result.success:
            yield from pause(0.3)       # the reason comes through a pipe
            break
    if process.exit_code() is None and wanted is None:
        process.kill()
        return f'it did not answer {START_TIMEOUT_S:g} s after its start and was killed'
    return process.last_words()


def _call(supervisor: Supervisor, name: str, kind: type, request: Any,
          timeout_s: float) -> Steps[Any]:
    """Return the response to a request, None after `timeout_s` or if the node died."""
    client = supervisor.client(name, kind)
    futures: list[Future] = []
    deadline, asked = time.monotonic() + timeout_s, -RETRY_S
    while time.monotonic() < deadline:
        if supervisor.processes[name].exit_code() is not None:
            return None
        # Requests to a node that is just being discovered get lost.
        if kind is GetState and time.monotonic() - asked > RETRY_S or not futures:
            asked = time.monotonic()
            futures.append(client.call_async(request))
        for future in futures:
            if future.done():
                return future.result()
        yield
    return None
