# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The nodes beside a robot for a long time: whether memory stays flat and every set is answered.

Recorded images go out as live cameras do, which now and then drop out; the memory of every
process is written down.
"""

from collections import Counter
from dataclasses import dataclass, field
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, TransformStamped
from hooc_perception.chain import CHAIN
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
from hooc_perception.ros.qos import qos
from hooc_perception.supervisor.supervisor import Supervisor
from hooc_perception.supervisor.watchdog import Watchdog
import numpy as np
import psutil
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

# Drop-outs: how often a camera begins one at a frame, and how long it is away, s.
DROP_OUT, AWAY_S = 0.02, (3.0, 10.0)
SAMPLE_S = 1.0
# The first answers compile, load and fill caches: growth counts after so many of them, and after
# this share of the time.
WARM_ANSWERS, WARM_UP = 8, 0.3


@dataclass
class SoakResult:
    """
    What a soak has shown.

    :ivar seconds: (n,) time of each sample since the first image; answered: (n,) frame sets
        that were answered by then.
    :ivar memory_mb: {process: (n,) resident memory, MB}.
    :ivar frames: images published; sets: frame sets that ingestion sent on; answers: those
        that were answered; refused: that a stage refused; deaths: of nodes.
    :ivar reasons: (thing, reason) -> number, as the nodes count them.
    """

    seconds: np.ndarray
    answered: np.ndarray
    memory_mb: dict
    frames: int
    sets: int
    answers: int
    refused: int
    deaths: int
    reasons: Counter = field(default_factory=Counter)

    def growth_mb(self, name):
        """Return by how much a process grew after warming up: last quarter over second."""
        rows = self.memory_mb[name][self._warm():]
        quarter = max(1, len(rows) // 4)
        return float(np.median(rows[-quarter:]) - np.median(rows[:quarter]))

    def growth_mb_an_hour(self, name):
        """Return the slope of a line through a process's memory after warming up."""
        start = self._warm()
        if len(self.seconds) - start < 2:
            return float('nan')
        return float(3600 * np.polyfit(self.seconds[start:], self.memory_mb[name][start:], 1)[0])

    def _warm(self):
        """Return the sample from which on growth counts, the last one at the latest."""
        warm = max(int(WARM_UP * len(self.seconds)),
                   int(np.searchsorted(self.answered, WARM_ANSWERS)))
        return min(warm, len(self.seconds) - 1)


def soak(bag, parameters, seconds, rate=1.0, seed=0, progress=lambda done: None):
    """
    Run the chain on a bag's first frame set again and again; return the SoakResult.

    :param bag: path of a bag.
    :param parameters: {node: parameters} with the model.
    :param rate: frame sets a second.
    :param progress: called with the seconds done.
    """
    scene, rng = BagScene(bag), stage_rng(seed, 'soak')
    parameters = {name: dict(values) for name, values in parameters.items()}
    for name in CHAIN:
        parameters[name].update(cameras=tuple(c.name for c in scene.cameras),
                                target_frame=scene.info['world_frame'] or 'table')
    with Supervisor(CHAIN, parameters, isolated=True) as supervisor:
        supervisor.bring_up()
        run = _Run(supervisor, scene, rng)
        run.go(seconds, rate, progress)
        # The last set may still be under way.
        run.settle(20.0)
        return run.result()


class _Run:
    """One soak: feeds, listens, measures."""

    def __init__(self, supervisor, scene, rng):
        self._supervisor, self._rng, node = supervisor, rng, supervisor.node
        self._watchdog = Watchdog(supervisor)
        self._cameras, self._away = {}, {}
        for view in scene.views():
            name = view.camera.name
            self._cameras[name] = (
                view, node.create_publisher(Image, f'{name}/depth/image_raw',
                                            qos('<camera>/depth/image_raw')),
                node.create_publisher(CameraInfo, f'{name}/depth/camera_info',
                                      qos('<camera>/depth/camera_info')))
            pose = node.create_publisher(TransformStamped, f'{name}/extrinsics',
                                         qos('<camera>/extrinsics'))
            pose.publish(transform_message(
                *pose_from_matrix(view.camera.T_world_camera),
                header(0, scene.info['world_frame'] or 'table'), f'{name}_optical'))
        self._stamps, self._refused = set(), set()
        self._values, self._reasons = {}, {}
        self._frames, self._times, self._answered = 0, [], []
        self._memory = {name: [] for name in CHAIN}
        node.create_subscription(PoseArray, 'objects/poses', self._on_answer,
                                 qos('objects/poses'))
        node.create_subscription(Header, 'views/refused', self._on_refused, qos('views/refused'))
        node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 50)
        supervisor.wait(lambda: all(p.get_subscription_count() for _, p, _ in
                                    self._cameras.values()), 30.0, 'nobody listens to the images')

    def go(self, seconds, rate, progress):
        """Feed and measure for so long."""
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

    def settle(self, timeout_s):
        """Wait until what was sent is answered and counted."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline and (
                len(self._stamps | self._refused) < self._sets()):
            self._watchdog.spin(0.05)
        quiet = time.monotonic() + 2.5      # the counts come once a second
        while time.monotonic() < quiet:
            self._watchdog.spin(0.05)

    def result(self):
        """Return the SoakResult."""
        if not self._stamps:
            raise HoocError('the nodes gave no answer at all; look at what they log')
        return SoakResult(
            np.array(self._times), np.array(self._answered),
            {n: np.array(m) for n, m in self._memory.items()},
            self._frames, self._sets(), len(self._stamps), len(self._refused - self._stamps),
            sum(self._watchdog.deaths.values()), Counter(self._reasons))

    def _sets(self):
        return int(self._values.get(('ingestion_node: views', 'sets'), 0))

    def _send(self, now):
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

    def _sample(self, seconds):
        self._times.append(seconds)
        self._answered.append(len(self._stamps))
        for name, process in self._supervisor.processes.items():
            try:
                rss = psutil.Process(process.pid).memory_info().rss
            except psutil.NoSuchProcess:
                rss = np.nan        # the watchdog restarts it
            self._memory[name].append(rss / 1e6)

    def _on_answer(self, message):
        self._stamps.add(nanoseconds(message.header.stamp))

    def _on_refused(self, message):
        self._refused.add(nanoseconds(message.stamp))

    def _on_diagnostics(self, message):
        for status in message.status:
            for value in status.values:
                self._values[status.name, value.key] = value.value
                if value.key.startswith('count_'):
                    self._reasons[status.name, value.key[6:]] = int(value.value)


def write_plot(path, result):
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
