# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The topics views/* as the later nodes read them: the observation of ingestion, bit for bit."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
import time
from typing import Any

from hooc_perception.chain import TOPICS
from hooc_perception.core.types import Observation
from hooc_perception.errors import HoocError
from hooc_perception.ros.health.upstream import Upstream
from hooc_perception.ros.inputs.stamp_join import StampJoin
from hooc_perception.ros.lifecycle.stage_config import StageConfig
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import header, nanoseconds
from hooc_perception.ros.messages.observations import observation_from_messages, ViewMessages
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

EXPLAIN_AFTER_S = 3.0
_KINDS = {'camera_info': CameraInfo, 'segments': Image, 'depth_rect': Image}
_POSES = 'views/poses'
# Called with the stamp in ns, the Observation and {part: message}; the part `frames` holds
# {camera: frame_id of its optical frame}.
SetCallback = Callable[[int, Observation, dict[str, Any]], None]


class ViewInput:
    """
    Receive observations and join whatever else a stage needs for the same stamp.

    If a set gets no further, `views/refused` says that no result will follow, so that nobody
    waits for one; for sets that arrived while the node was inactive or unwilling, as soon as it
    works again.

    :param stage: what the callback does, as /diagnostics names it.
    :param others: {part: (message type, topic)} that are joined with the observation by stamp.
    :param callback: called for each whole set; a HoocError refuses the set.
    :param willing: whether the active node wants frame sets at all.
    """

    def __init__(self, node: StageNode[StageConfig, Any], names: Sequence[str], stage: str,
                 others: Mapping[str, tuple[type, str]], callback: SetCallback,
                 willing: Callable[[], bool] = lambda: True) -> None:
        """Create the subscriptions on a StageNode."""
        self._node, self._names, self._stage, self._callback = node, names, stage, callback
        self._willing = willing
        self._views = StampJoin(
            [_POSES, *(f'{name}/{suffix}' for name in names for suffix in _KINDS)])
        self._whole = StampJoin(['observation', 'frames', *others])
        for name in names:
            for suffix, kind in _KINDS.items():
                node.subscription(kind, f'views/<camera>/{suffix}',
                                  self._taker(self._views, f'{name}/{suffix}', self._observed),
                                  f'views/{name}/{suffix}')
        node.subscription(PointCloud2, _POSES, self._taker(self._views, _POSES, self._observed))
        for part, (kind, topic) in others.items():
            node.subscription(kind, topic, self._taker(self._whole, part, self._deliver))
        self._refused = node.publisher(Header, 'views/refused')
        # The content of the last set's messages, and what was made of it.
        self._last: tuple[list[Any], Observation] | None = None
        self._ignored: int | None = None        # stamp of the last set that was ignored
        # Monotonic seconds since which an observation waits for the other parts.
        self._waits_since: float | None = None
        topics = [topic for _, topic in others.values()]
        self._needed = {**{f'views/{name}/depth_rect': 'views/<camera>/depth_rect'
                           for name in names}, **{topic: topic for topic in topics}}
        self._upstream = Upstream(node, topics)
        self.wait()
        node.steady_timer(1.0, self._on_timer)

    def clear(self) -> None:
        """Forget what waits."""
        self._views.clear()
        self._whole.clear()
        self._waits_since = None

    def wait(self) -> None:
        """Report that the stage has nothing to do yet."""
        self._node.diagnostics.state(self._stage, 'waiting', 'waits for the first frame set')

    def refuse(self, stamp_ns: int) -> None:
        """Announce that a frame set will not be answered."""
        self._refused.publish(header(stamp_ns, self._node.config.target_frame))

    def resume(self) -> None:
        """Announce that the last ignored set will not be answered, once the node is willing."""
        if self._ignored is not None and self._node.active and self._willing():
            self.refuse(self._ignored)
            self._ignored = None

    def _on_timer(self) -> None:
        self.resume()
        if self._node.active and time.monotonic() - self._node.since > EXPLAIN_AFTER_S:
            self._explain()
            if self._waits_since and time.monotonic() - self._waits_since > EXPLAIN_AFTER_S:
                self._upstream.ask()

    def _explain(self) -> None:
        """Report which node is missing, or works for other cameras."""
        node = self._node
        silent = [topic for topic in self._needed if not node.publishers_of(topic)]
        if not silent:
            return
        makers = dict.fromkeys(TOPICS[self._needed[topic]].publisher for topic in silent)
        sentence = (f'nobody publishes {", ".join(map(node.resolve_topic_name, silent))}, so '
                    f'nothing can be done; start {" and ".join(makers)}')
        if silent[0].startswith('views/'):
            sentence += (', with the same parameter cameras in every node (here: '
                         f'{", ".join(self._names)})')
        node.diagnostics.warn('input', 'no_publisher', sentence)

    def _taker(self, join: StampJoin, part: str,
               then: Callable[[int, dict[str, Any]], None]) -> Callable[[Any], None]:
        def take(message: Any) -> None:
            self._add(join, part, nanoseconds(message.header.stamp), message, then)
        return take

    def _add(self, join: StampJoin, part: str, stamp_ns: int, value: Any,
             then: Callable[[int, dict[str, Any]], None]) -> None:
        before = sum(join.drops.values())
        whole = join.add(part, stamp_ns, value)
        dropped = sum(join.drops.values()) - before
        if dropped:
            self._node.diagnostics.count('input', 'incomplete', dropped)
        if whole and self._node.active and self._willing():
            then(stamp_ns, whole)
        elif whole:
            # Announced when the node is willing again: until then nobody need work for it.
            self._ignored = stamp_ns
            self._node.diagnostics.count('input', 'ignored')

    @contextmanager
    def _refusing(self, stamp_ns: int, thing: str) -> Iterator[None]:
        """Refuse the frame set if anything is raised; a HoocError is reported for `thing`."""
        try:
            yield
        except HoocError as error:
            self._node.diagnostics.error(thing, 'refused', str(error))
            self.refuse(stamp_ns)
        except Exception:
            self.refuse(stamp_ns)
            raise

    def _observed(self, stamp_ns: int, parts: dict[str, Any]) -> None:
        """Rebuild the observation at once, while earlier stages still work."""
        frames = {name: parts[f'{name}/depth_rect'].header.frame_id for name in self._names}
        with self._refusing(stamp_ns, 'views'):
            self._check_frame(parts[_POSES])
            observation = self._observation(
                {name: ViewMessages(parts[f'{name}/camera_info'], parts[f'{name}/depth_rect'],
                                    parts[f'{name}/segments']) for name in self._names},
                parts[_POSES])
            self._node.diagnostics.ok('views')
            self._waits_since = self._waits_since or time.monotonic()
            self._add(self._whole, 'frames', stamp_ns, frames, self._deliver)
            self._add(self._whole, 'observation', stamp_ns, observation, self._deliver)

    def _observation(self, views: dict[str, ViewMessages], poses: PointCloud2) -> Observation:
        """Return the Observation; the same object as last time where nothing in it differs."""
        # While the scene stands still, ingestion sends the same views with new stamps.
        content = [poses.data, *(part for view in views.values() for part in (
            view.depth.data, view.segments.data, view.info.k.tobytes(), tuple(view.info.d),
            view.info.width, view.info.height))]
        if self._last is None or self._last[0] != content:
            self._last = content, observation_from_messages(views, poses)
        return self._last[1]

    def _check_frame(self, poses: PointCloud2) -> None:
        """Raise HoocError if the views are in another frame than the results would be."""
        mine, theirs = self._node.config.target_frame, poses.header.frame_id
        if theirs != mine:
            raise HoocError(
                f'the views are in the frame {theirs!r}, but target_frame of '
                f'{self._node.get_name()} is {mine!r}; set the same target_frame in all nodes')

    def _deliver(self, stamp_ns: int, parts: dict[str, Any]) -> None:
        self._waits_since = None
        self._upstream.forget()
        self._node.diagnostics.ok('input')
        with self._refusing(stamp_ns, self._stage):
            self._callback(stamp_ns, parts['observation'], parts)
