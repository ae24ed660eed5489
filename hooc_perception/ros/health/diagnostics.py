# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The health of a node on /diagnostics, once per second, with reason codes."""

from collections import Counter
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
# A persistent problem is logged again after this time, then less and less often: a camera that is
# off for a night should not fill the disk.
THROTTLE_S, LONGEST_PAUSE_S = 5.0, 300.0
# A problem that does not recur within this time is over.
HOLD_S = 5.0


class Diagnostics:
    """
    Collect reports about named subjects (a camera, a stage, the model) and publish them.

    Problems are also logged here, and only here: each (subject, code) at most every five seconds,
    then every ten and so on up to five minutes, no matter how often it occurs, and once when it
    is over.
    """

    def __init__(self, node: Node) -> None:
        """Publish for a node from now on, in every lifecycle state."""
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        # By the steady clock: simulated time may stand still, which is worth a report.
        self._timer = node.create_timer(1.0, self._publish,
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))
        # Subject -> (level, code, sentence, monotonic seconds).
        self._state: dict[str, tuple[bytes, str, str, float]] = {}
        self._values: dict[str, dict[str, Any]] = {}
        self._counts: Counter[tuple[str, str]] = Counter()      # (subject, code) -> number
        # (subject, code) -> (monotonic seconds, pause until the next).
        self._logged: dict[tuple[str, str], tuple[float, float]] = {}

    def ok(self, subject: str, **values: Any) -> None:
        """Report that a subject works; `values` are published with it."""
        level, _, _, when = self._state.get(subject, (OK, '', '', 0.0))
        # A warning stays visible for a while; at 1 Hz it would be missed otherwise.
        if level == OK or time.monotonic() - when > HOLD_S:
            self._state[subject] = (OK, 'ok', 'ok', time.monotonic())
            if level != OK:
                self._node.get_logger().info(f'{subject}: works again')
                self._logged = {key: v for key, v in self._logged.items() if key[0] != subject}
        self._values.setdefault(subject, {}).update(values)

    def over(self, subject: str, code: str) -> None:
        """Report that a subject works if this code is the last that was reported of it."""
        if self._state.get(subject, (OK, ''))[1] == code:
            self.ok(subject)

    def values(self, subject: str, **values: Any) -> None:
        """Publish values with a subject, whatever its state."""
        self._values.setdefault(subject, {}).update(values)

    def state(self, subject: str, code: str, sentence: str, level: bytes = OK) -> None:
        """Report an intended state until the next report; it is neither logged nor counted."""
        self._state[subject] = (level, code, sentence, time.monotonic() - HOLD_S)

    def count(self, subject: str, code: str, number: int = 1) -> None:
        """Count an event that is normal but worth knowing, such as a superseded frame."""
        self._counts[subject, code] += number
        self._state.setdefault(subject, (OK, 'ok', 'ok', time.monotonic()))

    def warn(self, subject: str, code: str, sentence: str) -> None:
        """Report and log a problem that is temporary or loses a frame."""
        self._problem(WARN, subject, code, sentence)

    def error(self, subject: str, code: str, sentence: str) -> None:
        """Report and log a problem that prevents results."""
        self._problem(ERROR, subject, code, sentence)

    def failed(self, code: str, sentence: str) -> None:
        """Report that the node itself failed to do what was requested; always logged."""
        self._logged.pop(('node', code), None)
        self._problem(ERROR, 'node', code, sentence)

    def _problem(self, level: bytes, subject: str, code: str, sentence: str) -> None:
        now = time.monotonic()
        self._counts[subject, code] += 1
        self._state[subject] = (level, code, sentence, now)
        logged, pause = self._logged.get((subject, code), (-LONGEST_PAUSE_S, 0.0))
        if now - logged >= pause:
            self._logged[subject, code] = now, min(max(THROTTLE_S, 2 * pause), LONGEST_PAUSE_S)
            logger = self._node.get_logger()
            text = sentence if subject == 'node' else f'{subject}: {sentence}'
            # Two calls: rclpy allows one severity per line of code.
            if level == ERROR:
                logger.error(text)
            else:
                logger.warning(text)

    def statuses(self) -> list[DiagnosticStatus]:
        """Return the current DiagnosticStatus of every subject."""
        name, result = self._node.get_name(), []
        for subject, (level, code, sentence, _) in sorted(self._state.items()):
            values = {'reason': code, **self._values.get(subject, {}),
                      **{f'count_{c}': n for (t, c), n in sorted(self._counts.items())
                         if t == subject}}
            result.append(DiagnosticStatus(
                level=level, name=f'{name}: {subject}', message=sentence,
                hardware_id=self._node.get_namespace(),
                values=[KeyValue(key=k, value=_text(v)) for k, v in values.items()]))
        return result

    def _check_clock(self) -> None:
        """Warn if the node uses simulated time that nobody publishes."""
        node = self._node
        if not (node.has_parameter('use_sim_time') and node.get_parameter('use_sim_time').value):
            return
        if not node.count_publishers('/clock'):
            self.warn('clock', 'no_clock', 'use_sim_time is set, but nobody publishes /clock, so '
                      'time stands still; play the recording with its clock (ros2 bag play '
                      '--clock), or set use_sim_time to false')
        else:
            self.ok('clock')

    def _publish(self) -> None:
        try:
            self._check_clock()
        except Exception as error:      # what is to be reported must go out whatever happens
            self.warn('clock', 'unexpected', f'unexpected {type(error).__name__}: {error}')
        message = DiagnosticArray(status=self.statuses())
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)


def _text(value: object) -> str:
    """Return a value as short text."""
    return f'{value:.6g}' if isinstance(value, float) else str(value)
