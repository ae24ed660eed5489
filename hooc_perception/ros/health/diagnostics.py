# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A node's health, once a second on /diagnostics: one status a thing, with reason codes."""

from collections import Counter
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
# Trouble that goes on is logged again after this time, then ever more seldom: a camera that is
# gone for the night should not fill the disk.
THROTTLE_S, MOST_SELDOM_S = 5.0, 300.0
# How long a report stays current: a trouble that does not come back is over.
HOLD_S = 5.0


class Diagnostics:
    """
    Collect reports about named things (a camera, the stage, the model) and publish them.

    Also the one way to log trouble: each (thing, code) is logged at most every five seconds, then
    every ten and so on up to five minutes, however often it is counted; and once when it is over.
    """

    def __init__(self, node):
        """Publish for `node` from now on, whatever its lifecycle state."""
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        # By the steady clock: simulated time may stand still, which is when one wants to know.
        self._timer = node.create_timer(1.0, self._publish,
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._state = {}            # thing -> (level, code, sentence, monotonic seconds)
        self._values = {}           # thing -> {key: value}
        self._counts = Counter()    # (thing, code) -> number
        self._logged = {}           # (thing, code) -> (monotonic seconds, pause until the next)

    def ok(self, thing, **values):
        """Report that `thing` works; `values` are shown with it."""
        level, _, _, when = self._state.get(thing, (OK, '', '', 0.0))
        # A warning stays visible for a while, or nobody would ever see it at 1 Hz.
        if level == OK or time.monotonic() - when > HOLD_S:
            self._state[thing] = (OK, 'ok', 'ok', time.monotonic())
            if level != OK:
                self._node.get_logger().info(f'{thing}: works again')
                self._logged = {key: v for key, v in self._logged.items() if key[0] != thing}
        self._values.setdefault(thing, {}).update(values)

    def state(self, thing, code, sentence, level=OK):
        """Report what is so, on purpose, until something else is: neither logged nor counted."""
        self._state[thing] = (level, code, sentence, time.monotonic() - HOLD_S)

    def count(self, thing, code, number=1):
        """Count what is normal but worth knowing (frames superseded)."""
        self._counts[thing, code] += number
        self._state.setdefault(thing, (OK, 'ok', 'ok', time.monotonic()))

    def warn(self, thing, code, sentence):
        """Report and log trouble that passes by itself or loses a frame."""
        self._trouble(WARN, thing, code, sentence)

    def error(self, thing, code, sentence):
        """Report and log trouble that stops the node from giving answers."""
        self._trouble(ERROR, thing, code, sentence)

    def failed(self, code, sentence):
        """Report that the node itself could not do what it was asked to; always logged."""
        self._logged.pop(('node', code), None)
        self._trouble(ERROR, 'node', code, sentence)

    def _trouble(self, level, thing, code, sentence):
        now = time.monotonic()
        self._counts[thing, code] += 1
        self._state[thing] = (level, code, sentence, now)
        logged, pause = self._logged.get((thing, code), (-MOST_SELDOM_S, 0.0))
        if now - logged >= pause:
            self._logged[thing, code] = now, min(max(THROTTLE_S, 2 * pause), MOST_SELDOM_S)
            logger = self._node.get_logger()
            text = sentence if thing == 'node' else f'{thing}: {sentence}'
            # Two calls: rclpy wants one severity a line of code.
            if level == ERROR:
                logger.error(text)
            else:
                logger.warning(text)

    def statuses(self):
        """Return the list of DiagnosticStatus as of now."""
        name, result = self._node.get_name(), []
        for thing, (level, code, sentence, _) in sorted(self._state.items()):
            values = {'reason': code, **self._values.get(thing, {}),
                      **{f'count_{c}': n for (t, c), n in sorted(self._counts.items())
                         if t == thing}}
            result.append(DiagnosticStatus(
                level=level, name=f'{name}: {thing}', message=sentence,
                hardware_id=self._node.get_namespace(),
                values=[KeyValue(key=k, value=_text(v)) for k, v in values.items()]))
        return result

    def _look_at_clock(self):
        """Say that nobody gives the simulated time that the node is to keep."""
        node = self._node
        if not (node.has_parameter('use_sim_time') and node.get_parameter('use_sim_time').value):
            return
        if not node.count_publishers('/clock'):
            self.warn('clock', 'no_clock', 'use_sim_time is set, but nobody publishes /clock, so '
                      'time stands still; start what plays the recording with its clock (ros2 '
                      'bag play --clock), or set use_sim_time to false')
        else:
            self.ok('clock')

    def _publish(self):
        self._look_at_clock()
        message = DiagnosticArray(status=self.statuses())
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)


def _text(value):
    """Return a value as short text."""
    return f'{value:.6g}' if isinstance(value, float) else str(value)
