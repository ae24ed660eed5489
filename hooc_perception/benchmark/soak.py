# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A soak test of the nodes: whether memory stays flat and every frame set is answered.

Images are published as by live cameras, which drop out now and then; the memory of every process
is recorded. The table is a recorded one, or a rendered one that changes: then every change must be
answered, and ids must stay with their objects.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
import time
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, TransformStamped
from hooc_perception.benchmark.change_check import ChangeCheck, Found
from hooc_perception.benchmark.changing_table import ChangingTable, RecordedTable
from hooc_perception.benchmark.soak_result import SoakResult
from hooc_perception.chain import CHAIN, PARSING
from hooc_perception.core.geometry import pose_from_matrix, stage_rng
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.ros.messages.conversions import (
    camera_info_message,
    depth_message,
    header,
    nanoseconds,
    transform_message,
)
from hooc_perception.ros.messages.point_clouds import cloud_rows
from hooc_perception.ros.qos import qos
from hooc_perception.supervisor.supervisor import Supervisor
from hooc_perception.supervisor.watchdog import Watchdog
import numpy as np
import psutil
from rclpy.publisher import Publisher
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

# Probability that a camera drops out at a frame, and for how long, s.
DROP_OUT, AWAY_S = 0.02, (3.0, 10.0)
SAMPLE_S = 1.0
# A table changes after one of these times, s: a full parse ends within the longest; but not before
# so many frame sets that show the last change have been answered.
PAUSES_S, ANSWERS = (3.0, 5.0, 8.0, 12.0, 40.0), (1, 6)


def soak(scene: str | Path | ChangingTable, parameters: Mapping[str, Mapping[str, Any]],
         seconds: float, rate: float = 1.0, seed: int = 0,
         progress: Callable[[float], object] = lambda done: None) -> SoakResult:
    """
    Run the chain on the same table again and again; return the SoakResult.

    :param scene: path of a bag, of which the first frame set is used; or a table that changes.
    :param parameters: {node: parameters} with the model.
    :param rate: frame sets per second.
    :param progress: called with the elapsed seconds.
    """
    rng = stage_rng(seed, 'soak')
    source = scene if isinstance(scene, ChangingTable) else RecordedTable(BagScene(scene))
    of_node = {name: dict(values) for name, values in parameters.items()}
    for name in CHAIN:
        of_node[name].update(cameras=tuple(c.name for c in source.cameras),
                             target_frame=source.frame)
    with Supervisor(CHAIN, of_node, isolated=True) as supervisor:
        supervisor.bring_up()
        run = _Run(supervisor, source, rng)
        run.go(seconds, rate, progress)
        # The last set may still be under way.
        run.settle(20.0)
        return run.result()


def background_mb(pid: int) -> float:
    """Return the memory of the processes that a process has started, MB."""
    total = 0.0
    with suppress(psutil.NoSuchProcess):
        for child in psutil.Process(pid).children():
            total += child.memory_info().rss / 1e6
    return total


class _CameraFeed(NamedTuple):
    """The publishers of one camera."""

    images: Publisher
    infos: Publisher


class _Run:
    """One soak test: publishes, listens, measures."""

    def __init__(self, supervisor: Supervisor, source: RecordedTable | ChangingTable,
                 rng: np.random.Generator) -> None:
        self._supervisor, self._rng, node = supervisor, rng, supervisor.node
        self._source = source
        self._check = ChangeCheck(source.places()) if isinstance(
            source, ChangingTable) else None
        self._watchdog = Watchdog(supervisor)
        self._cameras: dict[str, _CameraFeed] = {}
        self._away: dict[str, float] = {}
        for camera in source.cameras:
            name = camera.name
            self._cameras[name] = _CameraFeed(
                node.create_publisher(Image, f'{name}/depth/image_raw',
                                            qos('<camera>/depth/image_raw')),
                node.create_publisher(CameraInfo, f'{name}/depth/camera_info',
                                      qos('<camera>/depth/camera_info')))
            pose = node.create_publisher(TransformStamped, f'{name}/extrinsics',
                                         qos('<camera>/extrinsics'))
            pose.publish(transform_message(
                *pose_from_matrix(camera.T_world_camera), header(0, source.frame),
                f'{name}_optical'))
        self._stamps: set[int] = set()
        self._refused: set[int] = set()
        self._values: dict[tuple[str, str], str] = {}
        self._reasons: dict[tuple[str, str], int] = {}
        self._times: list[float] = []
        self._answered: list[int] = []
        self._wanted = ANSWERS[1]   # answers before the next change
        self._frames, self._start_ns, self._background_mb = 0, 0, 0.0
        self._memory: dict[str, list[float]] = {name: [] for name in CHAIN}
        node.create_subscription(PoseArray, 'objects/poses', self._on_answer,
                                 qos('objects/poses'))
        node.create_subscription(PointCloud2, 'objects/attributes', self._on_objects,
                                 qos('objects/attributes'))
        node.create_subscription(Header, 'views/refused', self._on_refused, qos('views/refused'))
        node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 50)
        supervisor.wait(lambda: all(feed.images.get_subscription_count()
                                    for feed in self._cameras.values()), 30.0,
                        'nobody subscribes to the images')

    def go(self, seconds: float, rate: float, progress: Callable[[float], object]) -> None:
        """Publish and measure for this time."""
        start = time.monotonic()
        next_set, next_sample, next_change = start, start, start
        self._start_ns = self._now_ns()
        while (now := time.monotonic()) < start + seconds:
            if now >= next_set:
                next_set += 1 / rate
                stamp_ns = self._now_ns()
                if self._check is not None and now >= next_change and (
                        self._check.since_change >= self._wanted):
                    next_change = now + self._rng.choice(PAUSES_S)
                    self._change(stamp_ns)
                self._send(now, stamp_ns)
            if now >= next_sample:
                next_sample += SAMPLE_S
                self._sample(now - start)
                progress(now - start)
            self._watchdog.spin(0.01)

    def settle(self, timeout_s: float) -> None:
        """Wait until everything that was published is answered and counted."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline and (
                len(self._stamps | self._refused) < self._sets()):
            self._watchdog.spin(0.05)
        quiet = time.monotonic() + 2.5      # the counts come once a second
        while time.monotonic() < quiet:
            self._watchdog.spin(0.05)

    def result(self) -> SoakResult:
        """Return the SoakResult."""
        if not self._stamps:
            raise HoocError('the nodes gave no answer at all; look at their logs')
        return SoakResult(
            np.array(self._times), np.array(self._answered),
            {n: np.array(m) for n, m in self._memory.items()},
            self._frames, self._sets(), len(self._stamps), len(self._refused - self._stamps),
            sum(self._watchdog.deaths.values()), Counter(self._reasons), self._background_mb,
            self._check and self._check.result(), self._start_ns)

    def _now_ns(self) -> int:
        return self._supervisor.node.get_clock().now().nanoseconds

    def _sets(self) -> int:
        """Return how many frame sets ingestion has assembled."""
        return int(self._values.get(('ingestion_node: views', 'sets'), 0))

    def _change(self, stamp_ns: int) -> None:
        """Change the table before the frame set of this stamp."""
        if self._check is not None and isinstance(self._source, ChangingTable):
            self._check.changed(stamp_ns, self._source.change())
            self._wanted = int(self._rng.integers(*ANSWERS))

    def _send(self, now: float, stamp: int) -> None:
        """Publish the images of all cameras that are not away."""
        if self._check is not None:
            self._check.sent(stamp)
        for view in self._source.views():
            name, (images, infos) = view.camera.name, self._cameras[view.camera.name]
            if self._rng.random() < DROP_OUT:
                self._away[name] = now + self._rng.uniform(*AWAY_S)
            if self._away.get(name, 0.0) > now:
                continue
            head = header(stamp, f'{name}_optical')
            infos.publish(camera_info_message(view.camera, head))
            images.publish(depth_message(view.depth, head))
            self._frames += 1

    def _sample(self, seconds: float) -> None:
        """Record the memory of every process."""
        self._times.append(seconds)
        self._answered.append(len(self._stamps))
        for name, process in self._supervisor.processes.items():
            try:
                rss = psutil.Process(process.pid).memory_info().rss
            except psutil.NoSuchProcess:
                rss = np.nan        # the watchdog restarts it
            self._memory[name].append(rss / 1e6)
        self._background_mb = max(self._background_mb, background_mb(
            self._supervisor.processes[PARSING].pid))

    def _on_answer(self, message: PoseArray) -> None:
        """Record the stamp of an answer."""
        self._stamps.add(nanoseconds(message.header.stamp))

    def _on_objects(self, message: PointCloud2) -> None:
        """Record the objects of an answer."""
        if self._check is not None:
            self._check.answered(nanoseconds(message.header.stamp), [
                Found(int(row['id']), int(row['category']),
                      np.array([row['x'], row['y'], row['z']], float))
                for row in cloud_rows(message)], self._now_ns())

    def _on_refused(self, message: Header) -> None:
        """Record the stamp of a rejected frame set."""
        self._refused.add(nanoseconds(message.stamp))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        """Record the values and counts that the nodes report."""
        for status in message.status:
            for value in status.values:
                self._values[status.name, value.key] = value.value
                if value.key.startswith('count_'):
                    self._reasons[status.name, value.key[6:]] = int(value.value)
