# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""When the next frame set may go out: as soon as the last one is answered or refused."""

from collections.abc import Callable
import time
from typing import Any

from geometry_msgs.msg import PoseArray
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import nanoseconds
from std_msgs.msg import Header


class Pace:
    """
    Remember the frame set that the chain works on, and listen for its end.

    :param on_free: called when the chain is free again.
    :ivar stamp_ns: of the frame set that is to be answered, None while the chain is free.
    """

    def __init__(self, node: StageNode[Any, Any], on_free: Callable[[], object]) -> None:
        """Subscribe on a StageNode."""
        self._node, self._on_free = node, on_free
        self.stamp_ns: int | None = None
        self._since = 0.0       # monotonic seconds
        node.subscription(PoseArray, 'objects/poses', self._on_answer)
        node.subscription(Header, 'views/refused', self._on_refused)

    def sent(self, stamp_ns: int) -> None:
        """Note that a frame set has gone out."""
        self.stamp_ns, self._since = stamp_ns, time.monotonic()

    def forget(self) -> None:
        """Wait for nothing any more."""
        self.stamp_ns = None

    def is_busy(self, wait_s: float) -> bool:
        """
        Return whether the last frame set is still to be answered.

        :param wait_s: stop waiting after this time, with a warning; 0 never waits.
        """
        if self.stamp_ns is None or not (wait_s and self._node.publishers_of('objects/poses')):
            return False
        # Not by the node's clock: it may be set back, or stand still.
        if time.monotonic() - self._since < wait_s:
            return True
        self._node.diagnostics.warn(
            'chain', 'no_answer', f'no objects came for a frame set within {wait_s:g} s '
            '(wait_for_answer_s), so the next one is sent; is a later node inactive, slower than '
            'that, or parsing disabled?')
        self.stamp_ns = None
        return False

    def _on_answer(self, message: PoseArray) -> None:
        if self.stamp_ns is not None and nanoseconds(message.header.stamp) >= self.stamp_ns:
            self.stamp_ns = None
            self._node.diagnostics.ok('chain')
            self._on_free()

    def _on_refused(self, message: Header) -> None:
        """Go on without an answer; the stage that refused the set reports why."""
        if nanoseconds(message.stamp) == self.stamp_ns:
            self.stamp_ns = None
            self._node.diagnostics.count('chain', 'refused')
            self._on_free()
