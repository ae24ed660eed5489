# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Listen to what the nodes say about a played bag; written as any user could write it."""

from collections import Counter
from dataclasses import dataclass
import json

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseArray
from hooc_perception.chain import INGESTION
from hooc_perception.core.types import Energy, ParsedScene, PixelProbabilities
from hooc_perception.ros.messages.conversions import nanoseconds
from hooc_perception.ros.messages.point_clouds import cloud_rows
from hooc_perception.ros.messages.stages import (
    candidates_from_messages,
    probabilities_from_message,
)
from hooc_perception.ros.qos import qos
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import String


@dataclass(frozen=True)
class Answer:
    """
    What the nodes found for one frame set.

    :ivar seconds: from the last depth image's arrival to the objects' publication.
    :ivar parsed: its pool holds the first proposals, not those of later rounds.
    :ivar probabilities: PixelProbabilities, None if they were not heard.
    :ivar images: {camera: which of its images, from 0 on} the frame set is made of.
    """

    stamp_ns: int
    parsed: ParsedScene
    seconds: float
    probabilities: PixelProbabilities | None
    images: dict


_INGESTION = f'{INGESTION}: '
_PARTS = {'objects/poses': PoseArray, 'objects/attributes': PointCloud2,
          'scene/summary': String, 'candidates/poses': PoseArray,
          'candidates/attributes': PointCloud2, 'pixels/probabilities': PointCloud2}


class Collector:
    """
    Subscribe to the raw images (for their arrival) and to the answers.

    :param node: rclpy Node in the namespace of the chain.
    """

    def __init__(self, node):
        """Subscribe to all but the cameras."""
        self._node, self._images, self.sent = node, [], None
        for topic, kind in _PARTS.items():
            node.create_subscription(kind, topic, self._taker(topic), qos(topic))
        node.create_subscription(String, 'replay/status', self._on_status, qos('replay/status'))
        node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        self.expect(())

    def expect(self, cameras):
        """Forget the last bag; listen to these cameras."""
        for subscription in self._images:
            self._node.destroy_subscription(subscription)
        self._parts = {topic: {} for topic in _PARTS}
        self._published = {}        # stamp -> ns of the publication of objects/poses
        self.heard = {camera: [] for camera in cameras}     # stamps of its images
        self._arrived = {}          # stamp of an image -> ns of its latest arrival
        self._before, self.sent = self.sent, None   # stamp of ingestion's latest frame set
        self._news_ns, self._reports = 0, Counter()     # when sent; node -> reports since then
        self.replay, self.errors = {}, []
        self._said = {}             # name of a status -> what it says
        self._images = [self._node.create_subscription(
            Image, f'{camera}/depth/image_raw', self._image_taker(camera),
            qos('<camera>/depth/image_raw')) for camera in cameras]

    def _image_taker(self, camera):
        def take(message, info):
            stamp = nanoseconds(message.header.stamp)
            self.heard[camera].append(stamp)
            self._note_news(info)
            self._arrived[stamp] = max(self._arrived.get(stamp, 0), info['received_timestamp'])
        return take

    def _taker(self, topic):
        def take(message, info):
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

    def _note_news(self, info):
        self._news_ns = max(self._news_ns, info['source_timestamp'])
        self._reports.clear()

    def _on_status(self, message, info):
        self.replay = json.loads(message.data)
        self._note_news(info)

    def _on_diagnostics(self, message, info):
        stamp = nanoseconds(message.header.stamp)
        # By the time of sending: topics do not keep the order among each other.
        if info['source_timestamp'] > self._news_ns:
            self._reports.update({s.name.partition(':')[0] for s in message.status})
        for status in message.status:
            self._said[status.name] = status.message
            if status.level == DiagnosticStatus.ERROR:
                self.errors.append((stamp, f'{status.name}: {status.message}'))
            for value in status.values if status.name == f'{_INGESTION}views' else ():
                # Until it sends again it reports the last set of the last bag.
                if value.key == 'stamp_ns' and int(value.value) != self._before:
                    self.sent = int(value.value)

    def idle(self, names, reports=2):
        """
        Say whether nodes have nothing left to do: each has reported so often since the last news.

        A node reports once a second, but not while it computes. Between two reports it has been
        given all that had arrived.
        """
        return all(self._reports[name] >= reports for name in names)

    def complaints(self, since_ns):
        """
        Return ([sentence] of ingestion, [sentence] of the other nodes), errors since a time.

        What ingestion refuses costs one image; the others then have given up a frame set.
        """
        sentences = [sentence for when, sentence in self.errors if when > since_ns]
        own = [sentence for sentence in sentences if sentence.startswith(_INGESTION)]
        return own, [sentence for sentence in sentences if sentence not in own]

    def standing(self):
        """Return in words what every node has said last, without what is all right."""
        nodes = {}
        for name, sentence in sorted(self._said.items()):
            node, _, thing = name.partition(': ')
            nodes.setdefault(node, []).extend([] if sentence == 'ok' else [f'{thing} {sentence}'])
        return '; '.join(f'{node}: {", ".join(said) or "ok"}' for node, said in nodes.items()) or (
            'no node has said anything')

    def newest_answer(self):
        """Return the Answer to the newest frame set that has one, None where none has."""
        return next(filter(None, map(self.answer, sorted(self._published, reverse=True))), None)

    def answer(self, stamp_ns):
        """Return the Answer to the frame set of a stamp, None while parts are missing."""
        poses, attributes, summary = (self._parts[topic].get(stamp_ns) for topic in (
            'objects/poses', 'objects/attributes', 'scene/summary'))
        if poses is None or attributes is None or summary is None:
            return None
        found = candidates_from_messages(poses, attributes)
        rows = cloud_rows(attributes)
        pool = self._pool(stamp_ns)
        pool = found if pool is None else pool
        energy = summary['energy']
        parsed = ParsedScene(
            found, Energy(energy['depth'], energy['probability'], energy['overlap']),
            rows['visible_ratio'].copy(), rows['residual_m'].copy(), rows['energy_delta'].copy(),
            rows['n_views'].copy(), pool, converged=summary['converged'],
            seconds=summary['seconds'], sigma_t=rows['sigma_t'].copy(),
            sigma_r=rows['sigma_r'].copy())
        probabilities = self._parts['pixels/probabilities'].get(stamp_ns)
        arrived = max((t for s, t in self._arrived.items() if s >= stamp_ns), default=0)
        return Answer(stamp_ns, parsed, max(0.0, (self._published[stamp_ns] - arrived) * 1e-9),
                      probabilities and probabilities_from_message(probabilities),
                      self.images_of(stamp_ns))

    def images_of(self, stamp_ns):
        """Return {camera: which of its images} of a frame set: the first ones not before it."""
        return {camera: sum(stamp < stamp_ns for stamp in stamps)
                for camera, stamps in self.heard.items()}

    def _pool(self, stamp_ns):
        poses = self._parts['candidates/poses'].get(stamp_ns)
        attributes = self._parts['candidates/attributes'].get(stamp_ns)
        if poses is None or attributes is None:
            return None
        return candidates_from_messages(poses, attributes)
