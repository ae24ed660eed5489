# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Restart nodes that die or hang, with their parameters, and retract their results meanwhile."""

from collections import Counter
import time
from typing import Any

from hooc_perception.chain import PARSING
from hooc_perception.ros.health.diagnostics import Diagnostics
from hooc_perception.supervisor.heartbeat import Heartbeat
from hooc_perception.supervisor.restart import bring_up, pause, Steps
from hooc_perception.supervisor.retractor import Retractor
from hooc_perception.supervisor.shared_memory import free_orphans
from hooc_perception.supervisor.supervisor import Supervisor
from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import parameter_value_to_python

# From this death in a row on, a node is reported as an error.
MANY_DEATHS = 5


class Watchdog:
    """
    Keep the nodes of a Supervisor alive; call `spin` instead of Supervisor.spin.

    Create it before the nodes are brought up, while all of them answer at once.

    A node that dies is restarted after a pause that doubles with each death and is reset after a
    quiet minute. It gets the parameters that it had, including changes at run time. A node that
    runs but no longer answers is killed and counts as dead. Deaths are counted and reported on
    the log and in /diagnostics.

    :param supervisor: an entered Supervisor.
    :param pause_s: pause before the first restart.
    :param longest_s: upper bound of the pause.
    :param quiet_s: a node that has lived this long is regarded as healthy again.
    :param hung_s: a node that has not answered for this long hangs; far longer than any frame
        set takes. 0 = never.
    :ivar deaths: {node name: number of deaths}.
    """

    def __init__(self, supervisor: Supervisor, pause_s: float = 1.0, longest_s: float = 30.0,
                 quiet_s: float = 60.0, hung_s: float = 120.0) -> None:
        """Watch from now on."""
        self._supervisor, self._node = supervisor, supervisor.node
        self._pause_s, self._longest_s, self._quiet_s = pause_s, longest_s, quiet_s
        self.diagnostics = Diagnostics(self._node)
        self.deaths: Counter[str] = Counter()
        self._recent: Counter[str] = Counter()      # deaths since the node was last healthy
        self._alive_since = dict.fromkeys(supervisor.names, time.monotonic())
        self._restarts: dict[str, Steps[None]] = {}     # of the nodes that are not back yet
        self._heartbeats = {name: Heartbeat(supervisor, name, hung_s) for name in supervisor.names}
        self._retractor = Retractor(supervisor)
        self._node.create_subscription(ParameterEvent, '/parameter_events', self._on_event, 100)
        # After the subscription: no change in between is missed.
        self._retractor.ask_parsing()

    def spin(self, seconds: float = 0.05) -> None:
        """Serve callbacks for a moment, then go on with the restarts of dead nodes."""
        self._supervisor.spin_unchecked(seconds)
        for name, heartbeat in self._heartbeats.items():
            if name not in self._restarts and not heartbeat.check():
                self._supervisor.processes[name].kill()
        for name in self._supervisor.dead():
            if name not in self._restarts:
                self._restarts[name] = self._restart(name)
        for name, restart in list(self._restarts.items()):
            if next(restart, 'done') == 'done':
                del self._restarts[name]
                self._retractor.on_return(name)
        for name, process in self._supervisor.processes.items():
            if name not in self._restarts:
                self.diagnostics.ok(name, pid=process.pid, deaths=self.deaths[name])
        self._retractor.spin(PARSING not in self._restarts)

    def restarting(self) -> list[str]:
        """Return the names of the nodes that are not back yet."""
        return list(self._restarts)

    def _restart(self, name: str) -> Steps[None]:
        """Bring a dead node back to active, however often that takes."""
        while True:
            if self._supervisor.processes[name].exit_code() is not None:
                yield from pause(self._record_death(name))
                free_orphans()
                self._supervisor.start_process(name)
            began = time.monotonic()
            failure = yield from bring_up(self._supervisor, name)
            if failure is None:
                self._alive_since[name] = time.monotonic()
                self._heartbeats[name].reset()
                self._node.get_logger().info(
                    f'{name} is active again, {time.monotonic() - began:.1f} s after its start')
                return
            if self._supervisor.processes[name].exit_code() is None:
                self._recent[name] += 1
                pause_s = self._pause_of(name)
                self.diagnostics.error(name, 'not_up', f'{failure}; trying again in {pause_s:g} s')
                yield from pause(pause_s)

    def _record_death(self, name: str) -> float:
        """Count and report a death and retract the result; return the pause before the restart."""
        process = self._supervisor.processes[name]
        if time.monotonic() - self._alive_since[name] > self._quiet_s:
            self._recent[name] = 0
        self.deaths[name] += 1
        self._recent[name] += 1
        pause_s = self._pause_of(name)
        report = self.diagnostics.error if self._recent[name] >= MANY_DEATHS else (
            self.diagnostics.warn)
        silent_s = self._heartbeats[name].silent_s
        how = (f'it did not answer for {silent_s:.0f} s and was killed (' if silent_s else
               f'it ended unexpectedly ({process.manner_of_death()}; ')
        report(name, 'died', f'{how}last message: {process.last_words()}); restarting it in '
               f'{pause_s:g} s, death {self.deaths[name]} since the start')
        self._heartbeats[name].reset()
        self._retractor.on_death(name)
        return pause_s

    def _pause_of(self, name: str) -> float:
        return min(self._longest_s, self._pause_s * 2 ** (self._recent[name] - 1))

    def _on_event(self, event: ParameterEvent) -> None:
        """Remember parameters that change at run time."""
        prefix = self._supervisor.namespace.rstrip('/') + '/'
        name = event.node.removeprefix(prefix)
        if event.node.startswith(prefix) and name in self._supervisor.names:
            changed = {p.name: _plain(parameter_value_to_python(p.value))
                       for p in event.changed_parameters}
            self._supervisor.remember(name, changed)
            if name == PARSING:
                self._retractor.adapt(changed)


def _plain(value: Any) -> Any:
    """Return the value of a parameter without the array types of messages."""
    return list(value) if hasattr(value, '__iter__') and not isinstance(value, str) else value
