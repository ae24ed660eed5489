# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that die come back: started again, configured, activated; their answers are taken back."""

from collections import Counter
import time

from hooc_perception.chain import CHAIN, PARSING
from hooc_perception.ros.health.diagnostics import Diagnostics
from hooc_perception.supervisor.displayed import Displayed
from hooc_perception.supervisor.heartbeat import Heartbeat
from hooc_perception.supervisor.retraction import Retraction
from hooc_perception.supervisor.shared_memory import free_orphans
from hooc_perception.supervisor.supervisor import (
    RETRY_S,
    START_TIMEOUT_S,
    TRANSITION_TIMEOUT_S,
)
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import Trigger

# What the watchdog has to know of the parsing node to speak in its place.
_OF_PARSING = ('target_frame', 'use_sim_time', 'publish_detections', 'planning_scene')
_NEXT = {State.PRIMARY_STATE_UNCONFIGURED: Transition.TRANSITION_CONFIGURE,
         State.PRIMARY_STATE_INACTIVE: Transition.TRANSITION_ACTIVATE}
# How often and how long the empty answer is said: subscribers need a moment to be found.
REPEAT_S, SAID_FOR_S = 0.5, 3.0
MANY_DEATHS = 5


class Watchdog:
    """
    Keep the nodes of a Supervisor alive; call `spin` in place of Supervisor.spin.

    Make it before the nodes are brought up, while all of them answer at once.

    A node that dies is started again after a pause that doubles with each death and is
    forgotten after a quiet minute, with the parameters that it had, changes at run time
    included. A node that lives but does not answer any more is ended and counts as dead. Each
    death is counted and said on the log and in /diagnostics.

    :param supervisor: an entered Supervisor.
    :param pause_s: before the first restart.
    :param longest_s: the pause never grows beyond this.
    :param quiet_s: a node that has lived so long is regarded as healthy again.
    :param hung_s: a node that has not answered for so long hangs: far longer than any frame set
        takes. 0 = never.
    """

    def __init__(self, supervisor, pause_s=1.0, longest_s=30.0, quiet_s=60.0, hung_s=120.0):
        """Watch from now on."""
        self._supervisor, self._node = supervisor, supervisor.node
        self._pause_s, self._longest_s, self._quiet_s = pause_s, longest_s, quiet_s
        self.diagnostics = Diagnostics(self._node)
        self.deaths = Counter()         # name -> deaths ever
        self._recent = Counter()        # name -> deaths since it was last healthy
        self._alive_since = dict.fromkeys(supervisor.names, time.monotonic())
        self._revivals = {}             # name -> generator that brings it back
        self._heartbeats = {name: Heartbeat(supervisor, name, hung_s) for name in supervisor.names}
        self._empty, self._empty_until, self._said = None, 0.0, 0.0
        self._shown = Displayed(self._node)
        self._parsing = {}              # parameters of the parsing node
        self._reset = self._node.create_client(Trigger, 'reset')
        self._node.create_subscription(ParameterEvent, '/parameter_events', self._on_event, 100)
        if PARSING in supervisor.names:
            self._adapt(supervisor.get_parameters(PARSING, _OF_PARSING))

    def spin(self, seconds=0.05):
        """Serve callbacks for a moment, then do what is due for those who have died."""
        self._supervisor.spin_unchecked(seconds)
        for name, pulse in self._heartbeats.items():
            if name not in self._revivals and not pulse.beats():
                self._supervisor.processes[name].kill()
        for name in self._supervisor.dead():
            if name not in self._revivals:
                self._revivals[name] = self._revive(name)
        for name, revival in list(self._revivals.items()):
            if next(revival, 'done') == 'done':
                del self._revivals[name]
                # Whoever waits for an answer that died with the node need not wait longer.
                self._take_back(name, once=True)
        self._report()
        self._keep_empty()

    def reviving(self):
        """Return the names of the nodes that are not back yet."""
        return list(self._revivals)

    # One node's way back. The generator yields whenever it has to wait.

    def _revive(self, name):
        """Bring a dead node back to active, however often that takes."""
        while True:
            if self._supervisor.processes[name].exit_code() is not None:
                yield from self._pause(self._mourn(name))
                free_orphans()
                self._supervisor.start_process(name)
            began = time.monotonic()
            refused = yield from self._bring_up(name)
            if refused is None:
                self._alive_since[name] = time.monotonic()
                self._heartbeats[name].start_anew()
                self._node.get_logger().info(
                    f'{name} is active again, {time.monotonic() - began:.1f} s after its start')
                return
            if self._supervisor.processes[name].exit_code() is None:
                self._recent[name] += 1
                pause = self._pause_of(name)
                self.diagnostics.error(name, 'not_up', f'{refused}; it is tried again in '
                                       f'{pause:g} s')
                yield from self._pause(pause)

    def _mourn(self, name):
        """Count a death, say it, take the answer back; return the pause before the restart."""
        process = self._supervisor.processes[name]
        if time.monotonic() - self._alive_since[name] > self._quiet_s:
            self._recent[name] = 0
        self.deaths[name] += 1
        self._recent[name] += 1
        pause = self._pause_of(name)
        tell = self.diagnostics.error if self._recent[name] >= MANY_DEATHS else (
            self.diagnostics.warn)
        silent_s = self._heartbeats[name].silent_s
        how = (f'it ended unexpectedly ({process.manner_of_death()}; ' if not silent_s else
               f'it did not answer for {silent_s:.0f} s and was ended (')
        tell(name, 'died', f'{how}last words: '
             f'{process.last_words()}); it is started again in {pause:g} s, death '
             f'{self.deaths[name]} since the start')
        self._heartbeats[name].start_anew()
        self._take_back(name)
        return pause

    def _pause_of(self, name):
        return min(self._longest_s, self._pause_s * 2 ** (self._recent[name] - 1))

    def _bring_up(self, name):
        """Configure and activate; return None, or the reason why it is not active."""
        process = self._supervisor.processes[name]
        wanted = None
        while process.exit_code() is None:
            # A node that is being configured answers when it is through with it.
            state = yield from self._ask(name, GetState, GetState.Request(),
                                         START_TIMEOUT_S if wanted is None
                                         else TRANSITION_TIMEOUT_S)
            if state is None:
                break
            if state.current_state.id == State.PRIMARY_STATE_ACTIVE:
                return None
            wanted = _NEXT.get(state.current_state.id)
            if wanted is None:
                yield
                continue
            # Where the answer is lost, the state says how it went.
            request = ChangeState.Request(transition=Transition(id=wanted))
            result = yield from self._ask(name, ChangeState, request, RETRY_S)
            if result is not None and not result.success:
                yield from self._pause(0.3)     # the reason comes through a pipe
                break
        if process.exit_code() is None and wanted is None:
            process.kill()
            return f'it did not answer {START_TIMEOUT_S:g} s after its start and is ended'
        return process.last_words()

    def _ask(self, name, kind, request, timeout_s):
        """Return the response to a request, None after `timeout_s` or where the node died."""
        client = self._supervisor.client(name, kind)
        futures, deadline, asked = [], time.monotonic() + timeout_s, -RETRY_S
        while time.monotonic() < deadline:
            if self._supervisor.processes[name].exit_code() is not None:
                return None
            # Requests to a node that is just being found get lost.
            if kind is GetState and time.monotonic() - asked > RETRY_S or not futures:
                asked = time.monotonic()
                futures.append(client.call_async(request))
            for future in futures:
                if future.done():
                    return future.result()
            yield
        return None

    @staticmethod
    def _pause(seconds):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            yield

    # What the dead have said.

    def _take_back(self, name, once=False):
        """Empty the latched results: of the parsing node for others, in its place if it died."""
        if name not in CHAIN or PARSING not in self._supervisor.names:
            return
        if self._empty is None:
            self._empty = Retraction(self._node, self._shown,
                                      self._parsing['publish_detections'])
        self._empty.publish(self._parsing['target_frame'])
        self._said = time.monotonic()
        self._empty_until = self._said + (REPEAT_S if once else SAID_FOR_S)
        if not once and name != PARSING and self._reset.service_is_ready():
            self._reset.call_async(Trigger.Request())

    def _keep_empty(self):
        """Repeat the empty answer for a while and for as long as there is no parsing node."""
        now = time.monotonic()
        if self._empty is None:
            return
        if now > self._empty_until and PARSING not in self._revivals:
            self._empty.close()
            self._empty = None
        elif now - self._said > REPEAT_S:
            self._empty.publish(self._parsing['target_frame'])
            self._said = now

    # What should survive.

    def _on_event(self, event):
        """Remember what is changed at run time."""
        prefix = self._supervisor.namespace.rstrip('/') + '/'
        name = event.node.removeprefix(prefix)
        if event.node.startswith(prefix) and name in self._supervisor.names:
            changed = {p.name: _plain(parameter_value_to_python(p.value))
                       for p in event.changed_parameters}
            self._supervisor.remember(name, changed)
            if name == PARSING:
                self._adapt(changed)

    def _adapt(self, parameters):
        """Do as the parsing node does: its frame, its clock, its topics."""
        self._parsing.update((name, parameters[name]) for name in _OF_PARSING
                             if name in parameters)
        known = self._parsing
        if known['use_sim_time'] != self._node.get_parameter('use_sim_time').value:
            self._node.set_parameters([Parameter('use_sim_time', value=known['use_sim_time'])])
        if known['planning_scene'] != 'off':
            self._shown.watch_planning_scene()

    def _report(self):
        for name, process in self._supervisor.processes.items():
            if name not in self._revivals:
                self.diagnostics.ok(name, pid=process.pid, deaths=self.deaths[name])


def _plain(value):
    """Return a parameter's value without the arrays of messages."""
    return list(value) if hasattr(value, '__iter__') and not isinstance(value, str) else value
