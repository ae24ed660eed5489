# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Play bags through the nodes, one after the other, and bring the answers back."""

from pathlib import Path
import shutil
import sys

from hooc_perception.chain import CHAIN, INGESTION, PARSING, REPLAY
from hooc_perception.errors import HoocError
from hooc_perception.supervisor.collector import Collector
from hooc_perception.supervisor.recorder import Recorder

MATCH_TIMEOUT_S = 30.0
# Ingestion and the collector listen to every image; where all is recorded, the recorder too.
LISTENERS = 2
# All nodes idle for so many seconds, and no answer: nobody works on the frame set any more.
LOST_AFTER_S = 8


class FrameSetLost(HoocError):
    """Every node is idle, nobody has complained, and there is no answer."""


class BagRunner:
    """
    Play bags through the nodes of a running Supervisor, which stay up in between.

    :param supervisor: Supervisor of CHAIN and REPLAY, entered.
    :param timeout_s: how long one scene may take from its last image on.
    """

    def __init__(self, supervisor, timeout_s=120.0, record=None):
        """
        Listen.

        :param record: folder for a bag a scene of all that goes over the topics, or None.
        """
        self._supervisor, self._timeout_s = supervisor, timeout_s
        self._record = None if record is None else Path(record)
        self._collector = Collector(supervisor.node)
        self._rig = None

    def play(self, bag):
        """
        Return the Answer to the last frame set of a bag.

        A bag whose frame set gets lost on its way is played once more, with a warning.

        :param bag: BagScene.
        :raises HoocError: where a node refuses, dies or does not answer in time.
        """
        try:
            return self._play(bag)
        except FrameSetLost as lost:
            print(f'warning: {lost}; it is played once more', file=sys.stderr, flush=True)
            self.start_over()
            if self._record:
                shutil.rmtree(self._record / bag.name)
            return self._play(bag)

    def _play(self, bag):
        supervisor, collector = self._supervisor, self._collector
        self._set_up(bag)
        collector.expect([camera.name for camera in bag.cameras])
        supervisor.set_parameters(REPLAY, {
            'bag': str(bag.path.resolve()),
            'wait_for_subscribers': LISTENERS + bool(self._record)})
        recorder = None
        if self._record:
            recorder = Recorder(supervisor.node, self._record / bag.name,
                                [camera.name for camera in bag.cameras])
        began = supervisor.node.get_clock().now().nanoseconds
        supervisor.bring_up([REPLAY])
        try:
            answer = self._listen(bag, began)
            if recorder:
                # What else is of this answer is under way.
                supervisor.wait_a_moment(1.0)
        finally:
            if recorder:
                recorder.close()
        supervisor.bring_down([REPLAY])
        return answer

    def start_over(self):
        """Bring all nodes down after a scene that failed; HoocError where one has died."""
        self._rig = None
        self._supervisor.bring_down()

    def _listen(self, bag, began):
        """Return the Answer once the bag is played and the chain has answered."""
        supervisor, collector = self._supervisor, self._collector
        self._wait(lambda: collector.replay.get('state') in ('finished', 'failed'), began,
                   MATCH_TIMEOUT_S + self._timeout_s + _length_s(bag),
                   f'{bag.name}: the bag could not be played to its end')
        if collector.replay['state'] == 'failed':
            supervisor.wait_a_moment()
            raise HoocError(supervisor.processes[REPLAY].last_words())
        self._wait(lambda: all(collector.heard.values()), began, 10.0,
                   f'{bag.name}: not every camera of the bag was heard')
        return self._wait(
            lambda: self._final(bag, began), began, self._timeout_s, lambda: (
                f'{bag.name}: no objects came within {self._timeout_s:g} s of the last image; '
                'give it more time with --timeout, or a faster profile (the nodes say: '
                f'{collector.standing()})'))

    def _final(self, bag, began):
        """Return the Answer to the last frame set once no newer one can come, else None."""
        collector = self._collector
        # A set with the last image of the camera that fell silent first is the last one.
        answer = collector.answer(min(stamps[-1] for stamps in collector.heard.values()))
        if answer or not collector.idle([INGESTION]):
            return answer
        answer = collector.newest_answer()
        refused, given_up = collector.complaints(began)
        if answer and (given_up or collector.sent is None or answer.stamp_ns >= collector.sent):
            return answer
        if collector.sent is None:
            raise HoocError(refused[0] if refused else (
                f'{bag.name}: no moment is seen by all of its cameras; hooc doctor says more'))
        if collector.idle(CHAIN, LOST_AFTER_S):
            raise FrameSetLost(f'{bag.name}: a frame set went out and no node works on it any '
                               f'more, so part of it was lost on its way ({collector.standing()})')
        return None

    def _set_up(self, bag):
        """Bring the chain up for the bag's rig, anew where it differs from the last one."""
        info = bag.info
        rig = {'cameras': tuple(camera.name for camera in bag.cameras),
               'target_frame': info['world_frame'] or 'table'}
        limit = info['max_instances']
        if (rig, limit) == self._rig:
            return
        if self._rig is not None:
            self._supervisor.bring_down(CHAIN)
        # A recorded frame set is whole however long its images take.
        own = {INGESTION: {'camera_timeout_s': 0.0, 'explain_after_s': 0.0},
               PARSING: {'max_instances': limit}}
        for name in CHAIN:
            self._supervisor.set_parameters(
                name, {**rig, 'wait_for_stages': True, **own.get(name, {})})
        self._supervisor.bring_up(CHAIN)
        self._rig = rig, limit

    def _wait(self, condition, began_ns, timeout_s, complaint):
        """Wait, but no longer once a node gives up a frame set and there is no answer yet."""
        def settled():
            value = condition()
            if not value:
                _, given_up = self._collector.complaints(began_ns)
                if given_up and not self._collector.newest_answer():
                    raise HoocError(given_up[0])
            return value
        return self._supervisor.wait(settled, timeout_s, complaint)


def _length_s(bag):
    """Return how many seconds a bag lasts at most, by its number of images at 1 Hz."""
    return max(bag.topics[topic].count for topic in bag.depth_topics.values())
