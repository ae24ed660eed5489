# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A soak test of the nodes: whether memory stays flat and every frame set is answered.

Recorded images are published as by live cameras, which drop out now and then; the memory of
every process is recorded.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
import time
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, TransformStamped
from hooc_perception.chain import CHAIN
from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.core.geometry import pose_from_matrix, stage_rng
from hooc_perception.core.types import DepthView
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.ros.messages.conversions import (
    camera_info_message,
    depth_message,
    header,
    nanoseconds,
    transform_message,
)
from hooc_perception.ros.qos import qos
from hooc_perception.supervisor.supervisor import Supervisor
from hooc_perception.supervisor.watchdog import Watchdog
import numpy as np
import psutil
from rclpy.publisher import Publisher
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

# Probability that a camera drops out at a frame, and for how long, s.
DROP_OUT, AWAY_S = 0.02, (3.0, 10.0)
SAMPLE_S = 1.0
# The first answers compile, load and fill caches: growth counts after this many of them and after
# this share of the time.
WARM_ANSWERS, WARM_UP = 8, 0.3


@dataclass
class SoakResult:
    """
    The result of a soak test.

    :ivar seconds: (n,) time of each sample since the first image; answered: (n,) frame sets
        that were answered by then.
    :ivar memory_mb: {process: (n,) resident memory, MB}.
    :ivar frames: published images; sets: frame sets that ingestion assembled; answers: those
        that were answered; refused: those that a stage rejected; deaths: of nodes.
    :ivar reasons: (thing, reason) -> number, as the nodes count them.
    """

    seconds: Float64Array
    answered: Int64Array
    memory_mb: dict[str, Float64Array]
    frames: int
    sets: int
    answers: int
    refused: int
    deaths: int
    reasons: Counter[tuple[str, str]] = field(default_factory=Counter)

    def growth_mb(self, name: str) -> float:
        """Return the growth of a process after warm-up: last quarter minus first quarter."""
        rows = self.memory_mb[name][self._warm():]
        quarter = max(1, len(rows) // 4)
        return float(np.median(rows[-quarter:]) - np.median(rows[:quarter]))

    def growth_mb_per_hour(self, name: str) -> float:
        """Return the slope of a line through the memory of a process after warm-up."""
        start = self._warm()
        if len(self.seconds) - start < 2:
            return float('nan')
        return float(3600 * np.polyfit(self.seconds[start:], self.memory_mb[name][start:], 1)[0])

    def _warm(self) -> int:
        """Return the first sample at which growth counts, the last one at the latest."""
        warm = max(int(WARM_UP * len(self.seconds)),
                   int(np.searchsorted(self.answered, WARM_ANSWERS)))
        return min(warm, len(self.seconds) - 1)


def soak(bag: str | Path, parameters: Mapping[str, Mapping[str, Any]], seconds: float,
         rate: float = 1.0, seed: int = 0,
         progress: Callable[[float], object] = lambda done: None) -> SoakResult:
    """
    Run the chain on the first frame set of a bag again and again; return the SoakResult.

    :param bag: path of a bag.
    :param parameters: {node: parameters} with the model.
    :param rate: frame sets per second.
    :param progress: called with the elapsed seconds.
    """
    scene, rng = BagScene(bag), stage_rng(seed, 'soak')
    of_node = {name: dict(values) for name, values in parameters.items()}
    for name in CHAIN:
        of_node[name].update(cameras=tuple(c.name for c in scene.cameras),
                                target_frame=scene.info['world_frame'] or 'table')
    with Supervisor(CHAIN, of_node, isolated=True) as supervisor:
        supervisor.bring_up()
        run = _Run(supervisor, scene, rng)
        run.go(seconds, rate, progress)
        # The last set may still be under way.
        run.settle(20.0)
        return run.result()


class _CameraFeed(NamedTuple):
    """What is published of one camera, and its publishers."""

    view: DepthView
    images: Publisher
    infos: Publisher


class _Run:
    """One soak test: publishes, listens, measures."""

    def __init__(self, supervisor: Supervisor, scene: BagScene, rng: np.random.Generator) -> None:
        self._supervisor, self._rng, node = supervisor, rng, supervisor.node
        self._watchdog = Watchdog(supervisor)
        self._cameras: dict[str, _CameraFeed] = {}
        self._away: dict[str, float] = {}
        for view in scene.views():
            name = view.camera.name
            self._cameras[name] = _CameraFeed(
                view, node.create_publisher(Image, f'{name}/depth/image_raw',
                                            qos('<camera>/depth/image_raw')),
                node.create_publisher(CameraInfo, f'{name}/depth/camera_info',
                                      qos('<camera>/depth/camera_info')))
            pose = node.create_publisher(TransformStamped, f'{name}/extrinsics',
                                         qos('<camera>/extrinsics'))
            pose.publish(transform_message(
                *pose_from_matrix(view.camera.T_world_camera),
                header(0, scene.info['world_frame'] or 'table'), f'{name}_optical'))
        self._stamps: set[int] = set()
        self._refused: set[int] = set()
        self._values: dict[tuple[str, str], str] = {}
        self._reasons: dict[tuple[str, str], int] = {}
        self._times: list[float] = []
        self._answered: list[int] = []
        self._frames = 0
        self._memory: dict[str, list[float]] = {name: [] for name in CHAIN}
        node.create_subscription(PoseArray, 'objects/poses', self._on_answer,
                                 qos('objects/poses'))
        node.create_subscription(Header, 'views/refused', self._on_refused, qos('views/refused'))
        node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 50)
        supervisor.wait(lambda: all(feed.images.get_subscription_count()
                                    for feed in self._cameras.values()), 30.0,
                        'nobody subscribes to the images')

    def go(self, seconds: float, rate: float, progress: Callable[[float], object]) -> None:
        """Publish and measure for this time."""
        start = time.monotonic()
        next_set, next_sample = start, start
        while (now := time.monotonic()) < start + seconds:
            if now >= next_set:
                next_set += 1 / rate
                self._send(now)
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
            sum(self._watchdog.deaths.values()), Counter(self._reasons))

    def _sets(self) -> int:
        """Return how many frame sets ingestion has assembled."""
        return int(self._values.get(('ingestion_node: views', 'sets'), 0))

    def _send(self, now: float) -> None:
        """Publish the images of all cameras that are not away."""
        stamp = self._supervisor.node.get_clock().now().nanoseconds
        for name, (view, images, infos) in self._cameras.items():
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

    def _on_answer(self, message: PoseArray) -> None:
        """Record the stamp of an answer."""
        self._stamps.add(nanoseconds(message.header.stamp))

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


def write_plot(path: str | Path, result: SoakResult) -> None:
    """Draw the memory of every process over time as a PNG."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(8, 4), dpi=120)
    for name, rows in result.memory_mb.items():
        axes.plot(result.seconds / 60, rows, label=name)
    axes.set(xlabel='minutes', ylabel='resident memory, MB', ylim=(0, None),
             title=f'{result.answers} frame sets answered, {result.deaths} deaths')
    axes.legend(loc='lower right')
    axes.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(path)
    pyplot.close(figure)
