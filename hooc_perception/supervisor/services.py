# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Call the lifecycle and parameter services of nodes, although requests may get lost."""

from collections.abc import Callable, Iterable, Mapping
import time
from typing import Any, Protocol, TypeVar

from hooc_perception.errors import HoocError
from hooc_perception.ros.lifecycle.parameters import parameter_message
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.task import Future

RETRY_S = 3.0
SET_TIMEOUT_S = 10.0
# Loading a model and compiling for the first time take long on a small machine.
TRANSITION_TIMEOUT_S = 300.0
_SERVICES = {GetState: 'get_state', ChangeState: 'change_state',
             GetParameters: 'get_parameters', SetParametersAtomically: 'set_parameters_atomically'}
_GOALS = {Transition.TRANSITION_CONFIGURE: State.PRIMARY_STATE_INACTIVE,
          Transition.TRANSITION_ACTIVATE: State.PRIMARY_STATE_ACTIVE,
          Transition.TRANSITION_DEACTIVATE: State.PRIMARY_STATE_INACTIVE,
          Transition.TRANSITION_CLEANUP: State.PRIMARY_STATE_UNCONFIGURED}
T = TypeVar('T')


class Waiter(Protocol):
    """Serves the callbacks of a node while somebody waits."""

    def wait(self, condition: Callable[[], T | None], timeout_s: float,
             complaint: str | Callable[[], str]) -> T:
        """Serve callbacks until `condition()`; return its value, or raise the complaint."""
        ...

    def wait_a_moment(self, seconds: float = 0.3) -> None:
        """Serve callbacks for this long."""


class NodeServices:
    """
    Clients of the services of nodes.

    :param node: the node that owns the clients.
    :param names: of the nodes to call, in the same namespace.
    :param waiter: serves callbacks in the meantime.
    """

    def __init__(self, node: Node, names: Iterable[str], waiter: Waiter) -> None:
        """Create all clients at once: they discover their services while the nodes start."""
        self._waiter = waiter
        self.clients: dict[tuple[str, type], Client] = {
            (name, kind): node.create_client(kind, f'{name}/{service}')
            for name in names for kind, service in _SERVICES.items()}

    def wait_until_ready(self, name: str, timeout_s: float) -> None:
        """Wait until a node has declared its parameters and answers; HoocError after that time."""
        complaint = f'{name} does not answer {timeout_s:g} s after its start'
        for kind in _SERVICES:
            self._waiter.wait(self.clients[name, kind].service_is_ready, timeout_s, complaint)
        # The services exist before the parameters are declared; only a node that has accepted
        # all of them answers.
        self.state(name, timeout_s, complaint)

    def state(self, name: str, timeout_s: float = SET_TIMEOUT_S,
              complaint: str | None = None) -> int:
        """Return the id of the lifecycle state of a node."""
        return self._call(name, GetState, GetState.Request(), timeout_s,
                          complaint).current_state.id

    def set_parameters(self, name: str, values: Mapping[str, Any]) -> None:
        """Set parameters of one node, all or none; HoocError with the reason of the node."""
        request = SetParametersAtomically.Request(
            parameters=[parameter_message(*item) for item in values.items()])
        result = self._call(name, SetParametersAtomically, request).result
        if not result.successful:
            raise HoocError(f'{name}: {result.reason}')

    def get_parameters(self, name: str, parameters: Iterable[str]) -> dict[str, Any]:
        """Return {parameter: value} of one node; None for a parameter that is not declared."""
        names = list(parameters)
        values = self._call(name, GetParameters, GetParameters.Request(names=names)).values
        return dict(zip(names, map(parameter_value_to_python, values)))

    def start_transition(self, name: str, transition: int) -> Future:
        """Request a lifecycle transition of a node."""
        return self.clients[name, ChangeState].call_async(
            ChangeState.Request(transition=Transition(id=transition)))

    def finish_transition(self, name: str, transition: int, future: Future, done: str) -> bool:
        """
        Wait for a transition to end; return whether it succeeded.

        The response is lost if the node had not discovered the client yet. Other requests can
        simply be repeated; here, the state of the node tells whether that is necessary.

        :param future: of `start_transition`.
        :param done: the transition as a participle, for the error message.
        """
        goal, futures = _GOALS[transition], [future]
        complaint = f'{name} could not be {done} within {TRANSITION_TIMEOUT_S:g} s'
        deadline = time.monotonic() + TRANSITION_TIMEOUT_S

        def succeeded() -> bool:
            responses = [future.result() for future in futures if future.done()]
            return any(response is not None and response.success for response in responses)

        while time.monotonic() < deadline:
            asked = time.monotonic()
            self._waiter.wait(lambda: futures[-1].done() or succeeded()
                              or time.monotonic() - asked > RETRY_S,
                              TRANSITION_TIMEOUT_S, complaint)
            if succeeded():
                return True
            # A node answers this only after the transition has ended.
            state = self.state(name, TRANSITION_TIMEOUT_S, complaint)
            self._waiter.wait_a_moment()
            # If two requests arrive, the second is rejected: the first one did it.
            if state == goal or succeeded():
                return True
            if futures[-1].done():
                return False
            futures.append(self.start_transition(name, transition))
        raise HoocError(complaint)

    def _call(self, name: str, kind: type, request: Any, timeout_s: float = SET_TIMEOUT_S,
              complaint: str | None = None) -> Any:
        """Return the response to a request, which is repeated every RETRY_S."""
        futures: list[Future] = []
        asked = -RETRY_S

        def answered() -> Future | None:
            nonlocal asked
            if time.monotonic() - asked > RETRY_S:
                asked = time.monotonic()
                futures.append(self.clients[name, kind].call_async(request))
            return next((future for future in futures if future.done()), None)

        complaint = complaint or f'{name} does not answer within {timeout_s:g} s'
        return self._waiter.wait(answered, timeout_s, complaint).result()
