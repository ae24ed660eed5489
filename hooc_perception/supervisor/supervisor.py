# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Run the nodes as separate processes, bring them up and down, and leave nothing behind."""

from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
import signal
import socket
import sys
import time
from typing import Any, TypeVar

from hooc_perception.chain import CHAIN
from hooc_perception.errors import HoocError
from hooc_perception.supervisor.environment import full_namespace, isolate, use_large_segments
from hooc_perception.supervisor.params_file import check_parameters, unreached_sections
from hooc_perception.supervisor.processes import NodeProcess
from hooc_perception.supervisor.services import NodeServices
from hooc_perception.supervisor.shared_memory import free_orphans
from lifecycle_msgs.msg import State, Transition
import rclpy
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

STOP_GRACE_S = 5.0
START_TIMEOUT_S = 60.0
T = TypeVar('T')


class Supervisor:
    """
    Run nodes as processes, as a context manager: they live inside of the `with` block.

    :ivar names: of the nodes.
    :ivar namespace: of the nodes, with its slash.
    :ivar processes: {node name: NodeProcess}.
    """

    def __init__(self, names: Iterable[str] = CHAIN,
                 parameters: Mapping[str, Mapping[str, Any]] | None = None,
                 namespace: str = '/hooc', isolated: bool = False, verbose: bool = False,
                 params_file: str | Path | None = None,
                 modules: Mapping[str, str] | None = None,
                 defaults: Mapping[str, Mapping[str, Any]] | None = None) -> None:
        """
        Prepare to start the nodes.

        :param parameters: {node name: {parameter: value}}.
        :param namespace: of the nodes; HoocError if it is not valid in ROS.
        :param isolated: keep apart from all other ROS traffic.
        :param verbose: print everything that the nodes log, not only warnings and errors.
        :param params_file: YAML of the user; `parameters` take precedence.
        :param modules: {node name: module to run instead}, in tests.
        :param defaults: {node name: {parameter: value}} for what neither `parameters` nor the
            file set.
        """
        self.names, self.namespace = tuple(names), full_namespace(namespace)
        self.processes: dict[str, NodeProcess] = {}
        self._parameters = {name: dict(values) for name, values in (parameters or {}).items()}
        self._isolated, self._verbose, self._modules = isolated, verbose, dict(modules or {})
        self._defaults = defaults or {}
        self._params_file = Path(params_file) if params_file else None
        if self._params_file and not self._params_file.is_file():
            raise HoocError(f'{params_file}: no such file of parameters; check --params')
        self._old_handlers: dict[int, Any] = {}
        self._claim: socket.socket | None = None
        self._node: Node | None = None

    @property
    def node(self) -> Node:
        """Return the rclpy Node of this process, for endpoints of the caller."""
        if self._node is None:
            raise HoocError('the supervisor is not running; use it in a with block')
        return self._node

    def __enter__(self) -> 'Supervisor':
        """Start the processes and wait until all of them answer."""
        try:
            # A shell without job control starts background jobs with SIGINT ignored.
            for number, handler in ((signal.SIGINT, signal.default_int_handler),
                                    (signal.SIGTERM, _exit_by_signal),
                                    (signal.SIGHUP, _exit_by_signal)):
                self._old_handlers[number] = signal.signal(number, handler)
        except ValueError:
            pass    # not in the main thread, which handles signals
        try:
            self._start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """End all processes, whatever happened."""
        try:
            for process in self.processes.values():
                process.ask_to_stop()
        finally:
            deadline = time.monotonic() + STOP_GRACE_S
            while self.processes:
                name = next(iter(self.processes))
                try:
                    self.processes[name].stop(deadline)
                except KeyboardInterrupt:
                    deadline = 0.0      # a second interrupt ends the grace period
                    continue
                del self.processes[name]
            if self._node is not None:
                self._node.destroy_node()
                self._context.try_shutdown()
            if self._claim:
                self._claim.close()
            for number, handler in self._old_handlers.items():
                signal.signal(number, handler)

    def _start(self) -> None:
        if self._isolated:
            self._claim = isolate()
        use_large_segments(len(self.names) + 1)
        free_orphans()
        if self._params_file:
            check_parameters(self._params_file, self.names, self.namespace)
            for sentence in unreached_sections(self._params_file, self.names, self.namespace):
                print(f'[WARN] {sentence}', file=sys.stderr, flush=True)
        for name in self.names:
            self.start_process(name)
        self._context = Context()
        # Signals are handled here: rclpy would only shut down its context and leave the nodes.
        rclpy.init(args=['--ros-args', '--disable-external-lib-logs'], context=self._context,
                   signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node('hooc_supervisor', namespace=self.namespace,
                                       context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._services = NodeServices(self._node, self.names, self)
        for name in self.names:
            self._services.wait_until_ready(name, START_TIMEOUT_S)

    def start_process(self, name: str) -> None:
        """Start the process of a node with all parameters that were set so far."""
        self.processes[name] = NodeProcess(
            name, self._parameters.get(name, {}), self.namespace, self._params_file,
            self._verbose, self._modules.get(name), self._defaults.get(name))

    def remember(self, name: str, values: Mapping[str, Any]) -> None:
        """Note changed parameters, for a process that has to be restarted."""
        self._parameters[name] = {**self._parameters.get(name, {}), **values}

    # Waiting.

    def spin(self, seconds: float = 0.05) -> None:
        """Serve callbacks for a moment; raise HoocError if a node has died."""
        self.spin_unchecked(seconds)
        self.check()

    def spin_unchecked(self, seconds: float = 0.05) -> None:
        """Serve callbacks for a moment, even if nodes have died."""
        self._executor.spin_once(timeout_sec=seconds)

    def dead(self) -> list[str]:
        """Return the names of the nodes whose process has ended."""
        return [name for name, process in self.processes.items()
                if process.exit_code() is not None]

    def check(self) -> None:
        """Raise HoocError if a node has died."""
        for name in self.dead():
            process = self.processes[name]
            raise HoocError(f'{name} ended unexpectedly (exit code {process.exit_code()}): '
                            f'{process.last_words()}')

    def wait(self, condition: Callable[[], T | None], timeout_s: float,
             complaint: str | Callable[[], str]) -> T:
        """
        Serve callbacks until `condition()`; return its value.

        :param complaint: sentence, or callable that returns it.
        :raises HoocError: the complaint after `timeout_s`, or if a node has died.
        """
        deadline = time.monotonic() + timeout_s
        while not (value := condition()):
            if time.monotonic() > deadline:
                raise HoocError(complaint if isinstance(complaint, str) else complaint())
            self.spin()
        return value

    def wait_a_moment(self, seconds: float = 0.3) -> None:
        """Serve callbacks for this long; HoocError if a node has died."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.spin()

    # Services of the nodes.

    def client(self, name: str, kind: type) -> Client:
        """Return the client of a node for GetState, ChangeState or a parameter service."""
        return self._services.clients[name, kind]

    def bring_up(self, names: Iterable[str] | None = None) -> None:
        """Configure and activate nodes (None = all), all of them at the same time."""
        chosen = tuple(names or self.names)
        self.change(chosen, Transition.TRANSITION_CONFIGURE, 'configured')
        self.change(chosen, Transition.TRANSITION_ACTIVATE, 'activated')

    def bring_down(self, names: Iterable[str] | None = None) -> None:
        """Deactivate and clean up nodes (None = all)."""
        chosen = tuple(names or self.names)
        self.change([n for n in chosen if self.state(n) == State.PRIMARY_STATE_ACTIVE],
                    Transition.TRANSITION_DEACTIVATE, 'deactivated')
        self.change([n for n in chosen if self.state(n) == State.PRIMARY_STATE_INACTIVE],
                    Transition.TRANSITION_CLEANUP, 'cleaned up')

    def change(self, names: Collection[str], transition: int, done: str) -> None:
        """
        Have nodes make one lifecycle transition.

        :param done: the transition as a participle, for the error message.
        :raises HoocError: if one fails, with the reason of the first.
        """
        futures = {name: self._services.start_transition(name, transition) for name in names}
        for name, future in futures.items():
            if not self._services.finish_transition(name, transition, future, done):
                # The reason comes through a pipe and may be a moment late.
                self.wait_a_moment()
                raise HoocError(f'{name} could not be {done}: '
                                f'{self.processes[name].last_words()}')

    def state(self, name: str) -> int:
        """Return the id of the lifecycle state of a node."""
        return self._services.state(name)

    def set_parameters(self, name: str, values: Mapping[str, Any]) -> None:
        """Set parameters of one node, all or none; HoocError with the reason of the node."""
        self._services.set_parameters(name, values)
        self.remember(name, values)

    def get_parameters(self, name: str, parameters: Iterable[str]) -> dict[str, Any]:
        """Return {parameter: value} of one node; None for a parameter that is not declared."""
        return self._services.get_parameters(name, parameters)


def _exit_by_signal(number: int, _: object) -> None:
    raise SystemExit(128 + number)
