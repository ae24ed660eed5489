# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A node that configures and activates itself.

Launch files do it by events of the node otherwise, which fails after a crash: DDS keeps the dead
process's services for up to its lease (20 s), and the request goes to nobody.
"""

import time
from typing import Any, TYPE_CHECKING

from hooc_perception.ros.health.diagnostics import WARN
from hooc_perception.ros.health.downstream import Downstream, FOUND_TIMEOUT_S
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import TransitionCallbackReturn

if TYPE_CHECKING:
    from hooc_perception.ros.lifecycle.stage_node import StageNode

TICK_S = 0.1


class Autostart:
    """
    Configure a node once it spins, then activate it; then leave it alone.

    With `wait_for_stages` it is activated when the nodes that need its topics are active, so that
    nothing of a recording is lost. If configuring fails, the node stays unconfigured: its log
    says why, and it would fail again.
    """

    def __init__(self, node: 'StageNode[Any, Any]') -> None:
        """Begin with the first tick of the node's executor."""
        self._node, self._downstream = node, None
        self._waits_since = 0.0     # time.monotonic()
        self._timer = node.create_timer(TICK_S, self._on_timer,
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_timer(self) -> None:
        if self._downstream is None:
            # Anybody else may have configured it already; then it is theirs.
            if not self._node.is_unconfigured() or (
                    self._node.trigger_configure() != TransitionCallbackReturn.SUCCESS):
                self._timer.cancel()
                return
            self._downstream = Downstream(self._node, self._node.published)
            self._waits_since = time.monotonic()
        elif not self._node.is_inactive():
            self._timer.cancel()
            return
        missing = self._downstream.missing() if self._node.config.wait_for_stages else ''
        if missing:
            self._report(missing)
        else:
            self._timer.cancel()
            self._node.trigger_activate()

    def _report(self, missing: str) -> None:
        """Report what the node waits for, and after some time as a problem."""
        diagnostics = self._node.diagnostics
        verb = 'are' if ' and ' in missing else 'is'
        sentence = f'waits until {missing} {verb} active (autostart, wait_for_stages)'
        if time.monotonic() - self._waits_since > FOUND_TIMEOUT_S:
            diagnostics.warn('node', 'waits_for_stages', f'{sentence}; its log says what '
                             'prevents that, if it was started in the same namespace')
        else:
            diagnostics.state('node', 'waits_for_stages', sentence, WARN)
