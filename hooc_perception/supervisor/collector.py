# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Collect what the nodes publish about a played bag, as any client could do it."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
import json
from typing import Any, TypeAlias

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseArray
from hooc_perception.chain import INGESTION
from hooc_perception.ros.messages.conversions import nanoseconds
from hooc_perception.ros.qos import qos
from hooc_perception.supervisor.answers import (
    frame_set_result,
    FrameSetResult,
    images_of,
    OBJECT_PARTS,
)
from rclpy.node import Node
from rclpy.subscription import Subscription
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import String

_INGESTION = f'{INGESTION}: '
_PARTS: dict[str, Any] = {
    **OBJECT_PARTS,
    'candidates/poses': PoseArray, 'candidates/attributes': PointCloud2,
    'pixels/probabilities': PointCloud2}
# Of a message: rclpy's annotation of callbacks leaves it out.
Info: TypeAlias = Mapping[str, int]


class Collector:
    """
    Subscribe to the raw images, for their arrival, and to the results.

    :param node: a node in the namespace of the chain.
    :ivar image_stamps: {camera: stamps of its images}, ns.
    :ivar last_sent: stamp of the last frame set of the ingestion node, None before the first.
    :ivar replay: the last content of `replay/status`.
    :ivar errors: (time in ns, sentence) of the errors in /diagnostics.
    :ivar results: {stamp in ns: FrameSetResult} of all frame sets, where `expect` asked for them.
    """

    def __init__(self, node: Node) -> None:
        """Subscribe to everything but the cameras."""
        self._node, self.last_sent = node, None
        self._images: list[Subscription] = []
        for topic, kind in _PARTS.items():
            node.create_subscription(kind, topic, self._taker(topic), qos(topic))
        on_status: Callable[..., None] = self._on_status
        on_diagnostics: Callable[..., None] = self._on_diagnostics
        node.create_subscription(String, 'replay/status', on_status, qos('replay/status'))
        node.create_subscription(DiagnosticArray, '/diagnostics', on_diagnostics, 10)
        self.expect(())

    def expect(self, cameras: Iterable[str], every: bool = False) -> None:
        """
        Forget the last bag and subscribe to these cameras.

        :param every: whether the results of all frame sets are kept, not only the last ones.
        """
        self._every, self.results = every, dict[int, FrameSetResult]()
        for subscription in self._images:
            self._node.destroy_subscription(subscription)
        # Topic -> {stamp: message}, and what follows from the messages, by stamp.
        self._parts: dict[str, dict[int, Any]] = {topic: {} for topic in _PARTS}
        self._published: dict[int, int] = {}    # time (ns) of the publication of objects/poses
        self.image_stamps: dict[str, list[int]] = {camera: [] for camera in cameras}
        self._arrived: dict[int, int] = {}      # time (ns) of the latest arrival of an image
        self._sent_before, self.last_sent = self.last_sent, None
        self._news_ns = 0                       # when the last message was sent
        self._reports: Counter[str] = Counter()     # node -> reports since then
        self.replay: dict[str, Any] = {}
        self.errors: list[tuple[int, str]] = []
        self._statuses: dict[str, str] = {}     # name of a status -> its message
        self._images = [self._node.create_subscription(
            Image, f'{camera}/depth/image_raw', self._image_taker(camera),
            qos('<camera>/depth/image_raw')) for camera in self.image_stamps]

    def _image_taker(self, camera: str) -> Callable[..., None]:
        def take(message: Image, info: Info) -> None:
            stamp = nanoseconds(message.header.stamp)
            self.image_stamps[camera].append(stamp)
            self._note_news(info)
            self._arrived[stamp] = max(self._arrived.get(stamp, 0), info['received_timestamp'])
        return take

    def _taker(self, topic: str) -> Callable[..., None]:
        def take(message: Any, info: Info) -> None:
            if topic == 'scene/summary':
                message = json.loads(message.data)
                stamp = message['stamp_ns']
            else:
                stamp = nanoseconds(message.header.stamp)
            self._parts[topic][stamp] = message
            self._note_news(info)
            while len(self._parts[topic]) > 8:
                del self._parts[topic][min(self._parts[topic])]
            if topic == 'objects/poses':
                self._published[stamp] = info['source_timestamp']
        return take

    def _note_news(self, info: Info) -> None:
        if self._every:
            self.keep_results()
        self._news_ns = max(self._news_ns, info['source_timestamp'])
        self._reports.clear()

    def _on_status(self, message: String, info: Info) -> None:
        self.replay = json.loads(message.data)
        self._note_news(info)

    def _on_diagnostics(self, message: DiagnosticArray, info: Info) -> None:
        stamp = nanoseconds(message.header.stamp)
        # By the time of sending: messages of different topics may overtake each other.
        if info['source_timestamp'] > self._news_ns:
            self._reports.update({s.name.partition(':')[0] for s in message.status})
        for status in message.status:
            self._statuses[status.name] = status.message
            if status.level == DiagnosticStatus.ERROR:
                self.errors.append((stamp, f'{status.name}: {status.message}'))
            for value in status.values if status.name == f'{_INGESTION}views' else ():
                # Until it sends again it reports the last frame set of the last bag.
                if value.key == 'stamp_ns' and int(value.value) != self._sent_before:
                    self.last_sent = int(value.value)

    def idle(self, names: Collection[str], reports: int = 2) -> bool:
        """
        Return whether nodes have nothing left to do: each reported this often since the last news.

        A node reports once per second, but not while it computes. Between two reports it has
        processed all messages that had arrived.
        """
        return all(self._reports[name] >= reports for name in names)

    def errors_since(self, since_ns: int) -> tuple[list[str], list[str]]:
        """
        Return the errors ([of ingestion], [of the other nodes]) since a time.

        An error of ingestion costs one image, one of the other nodes a frame set.
        """
        sentences = [sentence for when, sentence in self.errors if when > since_ns]
        own = [sentence for sentence in sentences if sentence.startswith(_INGESTION)]
        return own, [sentence for sentence in sentences if sentence not in own]

    def status_report(self) -> str:
        """Return in words what every node reported last, without the parts that are fine."""
        nodes: dict[str, list[str]] = {}
        for name, sentence in sorted(self._statuses.items()):
            node, _, thing = name.partition(': ')
            nodes.setdefault(node, []).extend([] if sentence == 'ok' else [f'{thing} {sentence}'])
        return '; '.join(f'{node}: {", ".join(said) or "ok"}' for node, said in nodes.items()) or (
            'no node has reported anything')

    def keep_results(self) -> None:
        """Keep the results that have become whole in `results`."""
        for stamp in self._published.keys() - self.results.keys():
            result = self.result(stamp)
            if result is not None:
                self.results[stamp] = result

    def newest_result(self) -> FrameSetResult | None:
        """Return the result of the newest frame set that has one, None if none has."""
        return next(filter(None, map(self.result, sorted(self._published, reverse=True))), None)

    def result(self, stamp_ns: int) -> FrameSetResult | None:
        """Return the result of the frame set of a stamp, None while parts are missing."""
        if any(stamp_ns not in self._parts[topic] for topic in OBJECT_PARTS):
            return None
        arrived = max((t for s, t in self._arrived.items() if s >= stamp_ns), default=0)
        parts = {topic: kept[stamp_ns] for topic, kept in self._parts.items() if stamp_ns in kept}
        return frame_set_result(stamp_ns, parts, max(
            0.0, (self._published[stamp_ns] - arrived) * 1e-9), self.images_of(stamp_ns))

    def images_of(self, stamp_ns: int) -> dict[str, int]:
        """Return {camera: index of its image} of a frame set: the first ones not before it."""
        return images_of(stamp_ns, self.image_stamps)
