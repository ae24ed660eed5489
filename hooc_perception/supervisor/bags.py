# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Play bags through the nodes, one after the other, and collect the results."""

from collections.abc import Callable
from pathlib import Path
import shutil
import sys
from typing import Any, TypeVar

from hooc_perception.chain import CHAIN, INGESTION, PARSING, REPLAY
from hooc_perception.core.parsing.tracking import TrackConfig
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.supervisor.answers import FrameSetResult
from hooc_perception.supervisor.collector import Collector
from hooc_perception.supervisor.recorder import Recorder
from hooc_perception.supervisor.supervisor import Supervisor

MATCH_TIMEOUT_S = 30.0
# Subscribers of every image: ingestion and the collector, and the recorder if there is one.
SUBSCRIBERS = 2
# If all nodes are idle for this many seconds without a result, the frame set was lost.
LOST_AFTER_S = 8
T = TypeVar('T')


class FrameSetLost(HoocError):
    """All nodes are idle and reported no error, but there is no result."""


class BagRunner:
    """
    Play bags through the nodes of a running Supervisor, which stay up in between.

    :param supervisor: entered Supervisor of CHAIN and REPLAY.
    :param timeout_s: how long one scene may take after its last image.
    :param record: folder for one bag per scene with all topics, or None.
    """

    def __init__(self, supervisor: Supervisor, timeout_s: float = 120.0,
                 record: str | Path | None = None) -> None:
        """Subscribe to the results."""
        self._supervisor, self._timeout_s = supervisor, timeout_s
        self._record = None if record is None else Path(record)
        self._collector = Collector(supervisor.node)
        # (parameters of the rig, max_instances, whether it is a sequence) that the chain is
        # configured for.
        self._rig: tuple[dict[str, Any], int, bool] | None = None

    @property
    def results(self) -> list[FrameSetResult]:
        """Return the results of all frame sets of the last bag, if it was a sequence."""
        self._collector.keep_results()
        return [result for _, result in sorted(self._collector.results.items())]

    def play(self, bag: BagScene) -> FrameSetResult:
        """
        Return the result of the last frame set of a bag.

        The frame sets of a sequence follow one another: the next one is sent when the last one
        is answered. Those of other bags are parsed each by itself.

        If the frame set gets lost in transport, the bag is played once more, with a warning.

        :raises HoocError: if a node reports an error, dies or is too slow.
        """
        try:
            return self._play(bag)
        except FrameSetLost as lost:
            print(f'warning: {lost}; playing it once more', file=sys.stderr, flush=True)
            self.start_over()
            if self._record:
                shutil.rmtree(self._record / bag.name)
            return self._play(bag)

    def _play(self, bag: BagScene) -> FrameSetResult:
        supervisor, collector = self._supervisor, self._collector
        self._set_up(bag)
        moving = bag.info['sequence'] is not None
        collector.expect([camera.name for camera in bag.cameras], moving)
        supervisor.set_parameters(REPLAY, {
            'bag': str(bag.path.resolve()), 'rate': 0.0 if moving else 1.0,
            'wait_for_subscribers': SUBSCRIBERS + bool(self._record)})
        recorder = None
        if self._record:
            recorder = Recorder(supervisor.node, self._record / bag.name, bag)
        began = supervisor.node.get_clock().now().nanoseconds
        supervisor.bring_up([REPLAY])
        try:
            result = self._collect(bag, began)
            if recorder:
                # Other topics of this result may still be on their way.
                supervisor.wait_a_moment(1.0)
        finally:
            if recorder:
                recorder.close()
        supervisor.bring_down([REPLAY])
        return result

    def start_over(self) -> None:
        """Bring all nodes down after a scene that failed; HoocError if one has died."""
        self._rig = None
        self._supervisor.bring_down()

    def _collect(self, bag: BagScene, began: int) -> FrameSetResult:
        """Return the result once the bag is played and the chain is done."""
        supervisor, collector = self._supervisor, self._collector
        self._wait(lambda: collector.replay.get('state') in ('finished', 'failed'), began,
                   MATCH_TIMEOUT_S + self._timeout_s + _length_s(bag),
                   f'{bag.name}: the bag could not be played to its end')
        if collector.replay['state'] == 'failed':
            supervisor.wait_a_moment()
            raise HoocError(supervisor.processes[REPLAY].last_words())
        # The last images may come after the news that they were sent. Of other bags some may be
        # lost.
        told = bag.info['sequence']
        least = 1 if told is None else len(told['frame_sets'])
        self._wait(lambda: all(len(stamps) >= least
                               for stamps in collector.image_stamps.values()), began, 10.0,
                   f'{bag.name}: not every camera of the bag published images; check it with '
                   'hooc doctor')
        return self._wait(
            lambda: self._final(bag, began), began, self._timeout_s, lambda: (
                f'{bag.name}: no objects came within {self._timeout_s:g} s of the last image; '
                'give it more time with --timeout, or use a faster profile (the nodes '
                f'report: {collector.status_report()})'))

    def _final(self, bag: BagScene, began: int) -> FrameSetResult | None:
        """Return the result of the last frame set once no newer one can come, else None."""
        collector = self._collector
        # The last set is the one with the last image of the camera that ended first.
        result = collector.result(min(stamps[-1] for stamps in collector.image_stamps.values()))
        if result or not collector.idle([INGESTION]):
            return result
        result, sent = collector.newest_result(), collector.last_sent
        image_errors, set_errors = collector.errors_since(began)
        if result and (set_errors or sent is None or result.stamp_ns >= sent):
            return result
        if sent is None:
            raise HoocError(image_errors[0] if image_errors else (
                f'{bag.name}: no moment is seen by all of its cameras; check it with hooc doctor'))
        if collector.idle(CHAIN, LOST_AFTER_S):
            raise FrameSetLost(f'{bag.name}: a frame set was sent, but all nodes are idle, so '
                               'part of it was lost in transport '
                               f'({collector.status_report()})')
        return None

    def _set_up(self, bag: BagScene) -> None:
        """Bring the chain up for the rig of a bag, unless it is configured for it already."""
        info = bag.info
        rig = {'cameras': tuple(camera.name for camera in bag.cameras),
               'target_frame': info['world_frame'] or 'table'}
        limit, moving = info['max_instances'], info['sequence'] is not None
        # A sequence begins with nothing known; so does each bag without one, frame set by set.
        if (rig, limit, moving) == self._rig and not moving:
            return
        if self._rig is not None:
            self._supervisor.bring_down(CHAIN)
        # A recorded frame set is complete, however long its images take.
        ttl_s = TrackConfig().track_ttl_s if moving else 0.0
        own = {INGESTION: {'camera_timeout_s': 0.0, 'explain_after_s': 0.0},
               PARSING: {'max_instances': limit, 'track_ttl_s': ttl_s}}
        for name in CHAIN:
            self._supervisor.set_parameters(
                name, {**rig, 'wait_for_stages': True, 'incremental': moving,
                       **own.get(name, {})})
        self._supervisor.bring_up(CHAIN)
        self._rig = rig, limit, moving

    def _wait(self, condition: Callable[[], T | None], began_ns: int, timeout_s: float,
              complaint: str | Callable[[], str]) -> T:
        """Wait, but fail at once if a node gives up a frame set and there is no result yet."""
        def settled() -> T | None:
            value = condition()
            if not value:
                _, set_errors = self._collector.errors_since(began_ns)
                if set_errors and not self._collector.newest_result():
                    raise HoocError(set_errors[0])
            return value
        return self._supervisor.wait(settled, timeout_s, complaint)


def _length_s(bag: BagScene) -> float:
    """Return an upper bound of the duration of a bag: its number of images at 1 Hz."""
    return max(bag.topics[topic].count for topic in bag.depth_topics.values())
