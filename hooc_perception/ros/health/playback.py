# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a bag that was played as live cameras has ended: their silence is no fault then."""

import json
import time

from hooc_perception.ros.lifecycle.stage_node import StageNode
from std_msgs.msg import String

# Images may arrive after the status that was sent after them.
LATE_S = 1.0


class Playback:
    """Listen to the replay node of the namespace, if there is one."""

    def __init__(self, node: StageNode) -> None:
        """Subscribe on a StageNode until it is cleaned up."""
        self._ended: float | None = None        # time.monotonic()
        node.subscription(String, 'replay/status', self._on_status)

    def ended_since(self, heard: float) -> bool:
        """
        Return whether a bag has ended and nothing came from a camera after it.

        :param heard: time.monotonic() of the last image of the camera.
        """
        return self._ended is not None and heard < self._ended + LATE_S

    def _on_status(self, message: String) -> None:
        over = json.loads(message.data).get('state') in ('finished', 'failed')
        self._ended = time.monotonic() if over else None
