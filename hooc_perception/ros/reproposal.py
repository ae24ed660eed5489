# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Rounds of re-proposal: parsing asks the candidate node what else may stand there.

The request holds the objects that were chosen so far; the answer has its stamp and round, or says
that it cannot be given: nobody is to wait for an answer that will not come.
"""

from collections import OrderedDict
import json
import time

from geometry_msgs.msg import PoseArray
from hooc_perception.core.types import Candidates
from hooc_perception.errors import HoocError
from hooc_perception.ros.messages.conversions import nanoseconds
from hooc_perception.ros.messages.point_clouds import cloud_rows
from hooc_perception.ros.messages.stages import candidates_from_messages, candidates_messages
import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import String

FORMAT = 'hooc-request/1'
_FIELDS = (('category', np.uint16, ()), ('translation', np.float64, (3,)),
           ('rotation_xyzw', np.float64, (4,)), ('size', np.float32, (3,)),
           ('score', np.float32, ()))
_POLL_S = 0.002
# Without rows a column can be nothing but a mark.
_NO_ANSWER = 'no_answer'


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


class Proposers:
    """
    The candidate node's side: what proposes anew, for the last few frame sets.

    Where sets do not wait for answers, younger ones come in while an older is parsed. Those that
    are asked for again stay longest.
    """

    def __init__(self, capacity=4):
        """Keep at most `capacity`: each holds the images of its set."""
        self._capacity, self._kept = capacity, OrderedDict()

    def __len__(self):
        """Return how many are kept."""
        return len(self._kept)

    def __contains__(self, stamp_ns):
        """Return whether that of a stamp is kept."""
        return stamp_ns in self._kept

    def keep(self, stamp_ns, proposer):
        """Keep the callable (objects, round) -> Candidates of a stamp; the oldest makes room."""
        self._kept[stamp_ns] = proposer
        while len(self._kept) > self._capacity:
            self._kept.popitem(last=False)

    def of(self, stamp_ns):
        """
        Return what was kept for a stamp.

        :raises HoocError: where it is not there (any more).
        """
        if stamp_ns not in self._kept:
            raise HoocError('re-proposal was asked for a frame set that is forgotten: too many '
                            'came after it; set wait_for_answer_s of the ingestion node above the '
                            'time that a parse takes')
        self._kept.move_to_end(stamp_ns)
        return self._kept[stamp_ns]


def no_answer_messages(head, turn):
    """Return empty `candidates/more/*` that say that nothing was proposed at all."""
    poses, attributes = candidates_messages(Candidates.empty(), head, turn)
    attributes.fields = [*attributes.fields, PointField(
        name=_NO_ANSWER, offset=0, datatype=PointField.UINT8, count=1)]
    return poses, attributes


class MoreCandidates:
    """
    The parsing node's side: ask, and wait for the answer within the stage's callback.

    The answers are taken from their subscriptions by hand (as rclpy.wait_for_message does):
    the executor is busy with the very callback that waits.
    """

    def __init__(self, node, n_models):
        """Create the endpoints on a StageNode whose model has so many categories."""
        self._node, self._n_models = node, n_models
        self._requests = node.publisher(String, 'candidates/requests')
        self._inputs = {part: node.subscription(kind, f'candidates/more/{part}', lambda _: None)
                        for part, kind in (('poses', PoseArray), ('attributes', PointCloud2))}

    def asker(self, stamp_ns, timeout_s):
        """Return the callable (objects, round) -> Candidates that core.parsing.parse wants."""
        def more(objects, turn):
            self._requests.publish(String(data=request_text(stamp_ns, turn, objects)))
            try:
                return self._answer(stamp_ns, turn, timeout_s)
            except HoocError as error:
                # What was proposed at first is sound: it is parsed without the round.
                self._node.diagnostics.warn('parse', 'no_more_candidates', (
                    f'round {turn} of re-proposal brought nothing: {error}'))
                return Candidates.empty()
        return more

    def _answer(self, stamp_ns, turn, timeout_s):
        """Wait for the Candidates of a round; HoocError where none come."""
        parts, deadline = {}, time.monotonic() + timeout_s
        while time.monotonic() < deadline and self._node.context.ok():
            if not self._node.count_publishers('candidates/more/poses'):
                raise HoocError('the candidate node is gone')
            for part, subscription in self._inputs.items():
                with subscription.handle:
                    taken = subscription.handle.take_message(subscription.msg_type, False)
                if taken is not None:
                    parts[part] = taken[0]
            if _belongs(parts, stamp_ns, turn):
                if any(f.name == _NO_ANSWER for f in parts['attributes'].fields):
                    raise HoocError('the candidate node could not answer; its status propose '
                                    'says why')
                return candidates_from_messages(parts['poses'], parts['attributes'],
                                                self._n_models)
            time.sleep(_POLL_S)
        raise HoocError(f'the candidate node did not answer within {timeout_s:g} s '
                        '(more_timeout_s)')


def _belongs(parts, stamp_ns, turn):
    """Return whether (poses, attributes) are whole and the answer to a round of a stamp."""
    if len(parts) < 2 or any(nanoseconds(m.header.stamp) != stamp_ns for m in parts.values()):
        return False
    return bool((cloud_rows(parts['attributes'], ['round'])['round'] == turn).all())
