# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bring the nodes up as separate processes, watch them, leave nothing behind."""

from pathlib import Path
import signal
import sys
import time

from hooc_perception.chain import CHAIN
from hooc_perception.errors import HoocError
from hooc_perception.ros.lifecycle.parameters import parameter_message
from hooc_perception.supervisor.environment import full_namespace, isolate, use_large_segments
from hooc_perception.supervisor.params_file import unreached_sections
from hooc_perception.supervisor.processes import NodeProcess
from hooc_perception.supervisor.shared_memory import free_orphans
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import parameter_value_to_python
from rclpy.signals import SignalHandlerOptions

STOP_GRACE_S = 5.0
START_TIMEOUT_S = 60.0
# Loading a model and compiling for the first time take long on a small machine.
TRANSITION_TIMEOUT_S = 300.0
SET_TIMEOUT_S = 10.0
RETRY_S = 3.0
_SERVICES = {GetState: 'get_state', ChangeState: 'change_state',
             GetParameters: 'get_parameters', SetParametersAtomically: 'set_parameters_atomically'}
_GOALS = {Transition.TRANSITION_CONFIGURE: State.PRIMARY_STATE_INACTIVE,
          Transition.TRANSITION_ACTIVATE: State.PRIMARY_STATE_ACTIVE,
          Transition.TRANSITION_DEACTIVATE: State.PRIMARY_STATE_INACTIVE,
          Transition.TRANSITION_CLEANUP: State.PRIMARY_STATE_UNCONFIGURED}


class Supervisor:
    """
    Use as a context manager: the nodes live inside of the `with` block.

    :ivar node: rclpy Node of this process, for endpoints of the caller.
    """

    def __init__(self, names=CHAIN, parameters=None, namespace='/hooc', isolated=False,
                 verbose=False, params_file=None, modules=None, defaults=None):
        """
        Take note of what to start.

        :param parameters: {node name: {parameter: value}}.
        :param namespace: of the nodes; HoocError where ROS takes no such one.
        :param isolated: keep apart from all other ROS traffic.
        :param params_file: YAML of the user; `parameters` win over it.
        :param modules: {node name: module}, in tests.
        :param defaults: {node name: {parameter: value}} that hold where neither the file nor
            `parameters` say otherwise.
        """
        self.names, self.namespace = tuple(names), full_namespace(namespace)
        self._parameters = {name: dict(values) for name, values in (parameters or {}).items()}
        self._isolated, self._verbose, self._modules = isolated, verbose, modules or {}
        self._defaults = defaults or {}
        self._params_file = Path(params_file) if params_file else None
        if self._params_file and not self._params_file.is_file():
            raise HoocError(f'{params_file}: there is no such file of parameters')
        self.processes, self._clients, self._claim = {}, {}, None
        self.node = None

    def __enter__(self):
        """Start the processes and wait until all of them can be talked to."""
        self._old_handlers = {}
        try:
            # A shell without job control starts what is in the background with SIGINT ignored.
            for number, handler in ((signal.SIGINT, signal.default_int_handler),
                                    (signal.SIGTERM, _exit_by_signal),
                                    (signal.SIGHUP, _exit_by_signal)):
                self._old_handlers[number] = signal.signal(number, handler)
        except ValueError:
            pass    # not in the main thread: whoever is there handles signals
        try:
            self._start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
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
                    deadline = 0.0      # asked again: no more patience, but still all of them
                    continue
                del self.processes[name]
            if self.node is not None:
                self.node.destroy_node()
                rclpy.try_shutdown(context=self._context)
            if self._claim:
                self._claim.close()
            for number, handler in self._old_handlers.items():
                signal.signal(number, handler)

    def _start(self):
        if self._isolated:
            self._claim = isolate()
        use_large_segments(len(self.names) + 1)
        free_orphans()
        if self._params_file:
            for sentence in unreached_sections(self._params_file, self.names, self.namespace):
                print(f'[WARN] {sentence}', file=sys.stderr, flush=True)
        for name in self.names:
            self.start_process(name)
        self._context = rclpy.Context()
        # Signals are ours: rclpy would only shut its context down and leave the nodes.
        rclpy.init(args=['--ros-args', '--disable-external-lib-logs'], context=self._context,
                   signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node('hooc_supervisor', namespace=self.namespace,
                                      context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        for name in self.names:
            # All clients at once: they find their services while the nodes start.
            for kind, service in _SERVICES.items():
                self._clients[name, kind] = self.node.create_client(kind, f'{name}/{service}')
        for name in self.names:
            complaint = f'{name} does not answer {START_TIMEOUT_S:g} s after its start'
            for kind in _SERVICES:
                self.wait(self._clients[name, kind].service_is_ready, START_TIMEOUT_S, complaint)
            # Services are there before the parameters are declared; an answer comes only from
            # a node that has accepted all of them.
            self.state(name, START_TIMEOUT_S, complaint)

    def start_process(self, name):
        """Start the process of a node, with all parameters that are known of it."""
        self.processes[name] = NodeProcess(
            name, self._parameters.get(name, {}), self.namespace, self._params_file,
            self._verbose, self._modules.get(name), self._defaults.get(name))

    def remember(self, name, values):
        """Note parameters that were changed, for a process that has to be started again."""
        self._parameters[name] = {**self._parameters.get(name, {}), **values}

    # Talking to the nodes.

    def client(self, name, kind):
        """Return the client of a node's service GetState, ChangeState or the parameters."""
        return self._clients[name, kind]

    def spin(self, seconds=0.05):
        """Serve callbacks for a moment; raise HoocError where a node has died."""
        self.spin_unchecked(seconds)
        self.check()

    def spin_unchecked(self, seconds=0.05):
        """Serve callbacks for a moment, whoever has died."""
        self._executor.spin_once(timeout_sec=seconds)

    def dead(self):
        """Return the names of the nodes whose process has ended."""
        return [name for name, process in self.processes.items()
                if process.exit_code() is not None]

    def check(self):
        """Raise HoocError where a node has died."""
        for name in self.dead():
            process = self.processes[name]
            raise HoocError(f'{name} ended unexpectedly (exit code {process.exit_code()}): '
                            f'{process.last_words()}')

    def wait(self, condition, timeout_s, complaint):
        """
        Serve callbacks until `condition()`; return its value.

        :param complaint: sentence, or callable that returns it.
        :raises HoocError: `complaint` after `timeout_s`, or where a node has died.
        """
        deadline = time.monotonic() + timeout_s
        while not (value := condition()):
            if time.monotonic() > deadline:
                raise HoocError(complaint() if callable(complaint) else complaint)
            self.spin()
        return value

    def bring_up(self, names=None):
        """Configure and activate nodes, all of them at the same time."""
        self.change(names or self.names, Transition.TRANSITION_CONFIGURE, 'configured')
        self.change(names or self.names, Transition.TRANSITION_ACTIVATE, 'activated')

    def bring_down(self, names=None):
        """Deactivate nodes and have them forget what they built."""
        names = names or self.names
        self.change([n for n in names if self.state(n) == State.PRIMARY_STATE_ACTIVE],
                    Transition.TRANSITION_DEACTIVATE, 'deactivated')
        self.change([n for n in names if self.state(n) == State.PRIMARY_STATE_INACTIVE],
                    Transition.TRANSITION_CLEANUP, 'cleaned up')

    def change(self, names, transition, done):
        """Have nodes make one lifecycle transition; HoocError with the reason of the first."""
        request = ChangeState.Request(transition=Transition(id=transition))
        futures = {name: self._clients[name, ChangeState].call_async(request) for name in names}
        for name, future in futures.items():
            if not self._changed(name, request, future, done):
                # The reason comes through a pipe and may be a moment behind.
                self.wait_a_moment()
                raise HoocError(f'{name} could not be {done}: '
                                f'{self.processes[name].last_words()}')

    def _changed(self, name, request, future, done):
        """
        Wait for a transition to end; return whether it succeeded.

        A service's answer is lost where the node had not found the client yet. Asking again is
        no harm for other calls; here the node's state tells first whether it is needed.
        """
        goal, futures = _GOALS[request.transition.id], [future]
        complaint = f'{name} could not be {done} within {TRANSITION_TIMEOUT_S:g} s'
        deadline = time.monotonic() + TRANSITION_TIMEOUT_S

        def answers():
            return [future.result().success for future in futures if future.done()]

        while time.monotonic() < deadline:
            asked = time.monotonic()
            self.wait(lambda: futures[-1].done() or any(answers())
                      or time.monotonic() - asked > RETRY_S, TRANSITION_TIMEOUT_S, complaint)
            if any(answers()):
                return True
            # A node answers this only when it is through with the transition.
            state = self.state(name, TRANSITION_TIMEOUT_S, complaint)
            self.wait_a_moment()
            # The second of two requests that both arrive is refused: the first did it.
            if state == goal or any(answers()):
                return True
            if futures[-1].done():
                return False
            futures.append(self._clients[name, ChangeState].call_async(request))
        raise HoocError(complaint)

    def state(self, name, timeout_s=SET_TIMEOUT_S, complaint=None):
        """Return the lifecycle state's id of a node."""
        return self._ask(name, GetState, GetState.Request(), timeout_s,
                         complaint or f'{name} does not answer').current_state.id

    def set_parameters(self, name, values):
        """Set parameters of one node, all or none; HoocError with the node's reason."""
        request = SetParametersAtomically.Request(
            parameters=[parameter_message(*item) for item in values.items()])
        result = self._ask(name, SetParametersAtomically, request, SET_TIMEOUT_S,
                           f'{name} does not answer').result
        if not result.successful:
            raise HoocError(f'{name}: {result.reason}')
        self.remember(name, values)

    def get_parameters(self, name, parameters):
        """Return {parameter: value} of one node; None for what it has not declared."""
        request = GetParameters.Request(names=list(parameters))
        values = self._ask(name, GetParameters, request, SET_TIMEOUT_S,
                           f'{name} does not answer').values
        return dict(zip(parameters, map(parameter_value_to_python, values)))

    def _ask(self, name, kind, request, timeout_s, complaint):
        """Return the response to a request that may be repeated, and is every RETRY_S."""
        futures, asked = [], -RETRY_S

        def answered():
            nonlocal asked
            if time.monotonic() - asked > RETRY_S:
                asked = time.monotonic()
                futures.append(self._clients[name, kind].call_async(request))
            return next((future for future in futures if future.done()), None)

        return self.wait(answered, timeout_s, complaint).result()

    def wait_a_moment(self, seconds=0.3):
        """Serve callbacks for so long."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.spin()


def _exit_by_signal(number, _):
    raise SystemExit(128 + number)
