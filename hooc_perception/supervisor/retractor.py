# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""When to retract the results of the chain, and on behalf of which parsing node."""

from collections.abc import Mapping
import time
from typing import Any

from hooc_perception.chain import CHAIN, PARSING
from hooc_perception.ros.lifecycle.parameters import switch_text
from hooc_perception.ros.outputs.adapters.guard import is_on
from hooc_perception.supervisor.displayed import Displayed
from hooc_perception.supervisor.retraction import Retraction
from hooc_perception.supervisor.supervisor import Supervisor
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

# Parameters of the parsing node that messages on its behalf depend on.
SWITCHES = ('publish_detections', 'planning_scene')
OF_PARSING = ('target_frame', 'use_sim_time', *SWITCHES)
# Period and duration of the retraction: subscribers take a moment to be discovered.
REPEAT_S, DURATION_S = 0.5, 3.0


class Retractor:
    """
    Retract the last result when a node of the chain has died.

    If the parsing node is alive it is asked to `reset`; otherwise empty results are published on
    its behalf, in its target frame and by its clock.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        """Subscribe to the results in the namespace of an entered Supervisor."""
        self._supervisor, self._node = supervisor, supervisor.node
        self._possible = PARSING in supervisor.names
        self._displayed = Displayed(self._node)
        self._retraction: Retraction | None = None      # while it lasts
        self._until = self._published = 0.0             # time.monotonic()
        self._parsing: dict[str, Any] = {}
        self._reset = self._node.create_client(Trigger, 'reset')

    def ask_parsing(self) -> None:
        """Adapt to the current parameters of the parsing node, if there is one."""
        if self._possible:
            self.adapt(self._supervisor.get_parameters(PARSING, OF_PARSING))

    def adapt(self, parameters: Mapping[str, Any]) -> None:
        """Follow changed parameters of the parsing node: its frame, its clock, its topics."""
        self._parsing.update((name, switch_text(parameters[name]) if name in SWITCHES
                              else parameters[name]) for name in OF_PARSING if name in parameters)
        known = self._parsing
        if len(known) < len(OF_PARSING):
            return      # a change before `ask_parsing` knows the rest
        if known['use_sim_time'] != self._node.get_parameter('use_sim_time').value:
            self._node.set_parameters([Parameter('use_sim_time', value=known['use_sim_time'])])
        if known['planning_scene'] != 'off':
            self._displayed.watch_planning_scene()

    def on_death(self, name: str) -> None:
        """Retract the result because a node has died."""
        if self._publish(name, DURATION_S) and name != PARSING and self._reset.service_is_ready():
            self._reset.call_async(Trigger.Request())

    def on_return(self, name: str) -> None:
        """Retract once more: clients that wait for a result that died with a node go on."""
        self._publish(name, REPEAT_S)

    def spin(self, parsing_is_back: bool) -> None:
        """Repeat the retraction for a while, and for as long as there is no parsing node."""
        now = time.monotonic()
        if self._retraction is None:
            return
        if now > self._until and parsing_is_back:
            self._retraction.close()
            self._retraction = None
        elif now - self._published > REPEAT_S:
            self._retraction.publish(self._parsing['target_frame'])
            self._published = now

    def _publish(self, name: str, duration_s: float) -> bool:
        """Start to retract, or go on with it; return False if the node is not of the chain."""
        if name not in CHAIN or not self._possible:
            return False
        if self._retraction is None:
            self._retraction = Retraction(self._node, self._displayed,
                                          is_on(self._parsing['publish_detections'],
                                                'vision_msgs'))
        self._retraction.publish(self._parsing['target_frame'])
        self._published = time.monotonic()
        self._until = self._published + duration_s
        return True
