# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Rounds of re-proposal: parsing asks the candidate node what else may stand there.

The request holds the objects that were chosen so far; the answer has its stamp and round.
"""

import json
import time

from geometry_msgs.msg import PoseArray
from hooc_perception.core.types import Candidates
from hooc_perception.errors import HoocError
from hooc_perception.ros.conversions import nanoseconds
from hooc_perception.ros.point_clouds import cloud_rows
from hooc_perception.ros.stage_messages import candidates_from_messages
import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String

FORMAT = 'hooc-request/1'
_FIELDS = (('category', np.uint16, ()), ('translation', np.float64, (3,)),
           ('rotation_xyzw', np.float64, (4,)), ('size', np.float32, (3,)),
           ('score', np.float32, ()))
_POLL_S = 0.002


def request_text(stamp_ns, turn, objects):
    """Return the JSON of a request; Python's shortest digits bring every float back exactly."""
    return json.dumps({'format': FORMAT, 'stamp_ns': stamp_ns, 'round': turn,
                       **{name: getattr(objects, name).tolist() for name, _, _ in _FIELDS}})


def parsed_request(text):
    """
    Return (stamp_ns, round, Candidates) of a request.

    :raises HoocError: where it is none.
    """
    try:
        content = json.loads(text)
        if content['format'] != FORMAT:
            raise ValueError(content['format'])
        columns = [np.array(content[name], kind).reshape(-1, *shape)
                   for name, kind, shape in _FIELDS]
        return int(content['stamp_ns']), int(content['round']), Candidates(*columns)
    except (ValueError, KeyError, TypeError) as error:
        raise HoocError(f'a message on candidates/requests is no {FORMAT} ({error}); is another '
                        'version of the parsing node running?') from error


class MoreCandidates:
    """
    The parsing node's side: ask, and wait for the answer within the stage's callback.

    The answers are taken from their subscriptions by hand (as rclpy.wait_for_message does):
    the executor is busy with the very callback that waits.
    """

    def __init__(self, node):
        """Create the endpoints on a StageNode."""
        self._node = node
        self._requests = node.publisher(String, 'candidates/requests')
        self._inputs = {part: node.subscription(kind, f'candidates/more/{part}', lambda _: None)
                        for part, kind in (('poses', PoseArray), ('attributes', PointCloud2))}

    def asker(self, stamp_ns, timeout_s):
        """Return the callable (objects, round) -> Candidates that core.parse wants."""
        def more(objects, turn):
            self._requests.publish(String(data=request_text(stamp_ns, turn, objects)))
            parts, deadline = {}, time.monotonic() + timeout_s
            while time.monotonic() < deadline and self._node.context.ok():
                if not self._node.count_publishers('candidates/more/poses'):
                    break       # the candidate node has died: nobody else will answer
                for part, subscription in self._inputs.items():
                    with subscription.handle:
                        taken = subscription.handle.take_message(subscription.msg_type, False)
                    if taken is not None:
                        parts[part] = taken[0]
                if _belongs(parts, stamp_ns, turn):
                    return candidates_from_messages(parts['poses'], parts['attributes'])
                time.sleep(_POLL_S)
            self._node.diagnostics.warn(
                'parse', 'no_more_candidates', f'the candidate node did not answer round {turn} '
                f'of re-proposal within {timeout_s:g} s or is gone; going on without')
            return Candidates.empty()
        return more


def _belongs(parts, stamp_ns, turn):
    """Return whether (poses, attributes) are whole and the answer to a round of a stamp."""
    if len(parts) < 2 or any(nanoseconds(m.header.stamp) != stamp_ns for m in parts.values()):
        return False
    return bool((cloud_rows(parts['attributes'], ['round'])['round'] == turn).all())
