# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Incremental parsing beside a parse of each frame set, on the bench scene."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from time import perf_counter as now
from typing import Any, TypeVar

from hooc_perception.benchmark.scene import BenchScene
from hooc_perception.core.arrays import AnyArray
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import DepthView, Observation, RectifiedView
from hooc_perception.parser import Parser
from hooc_perception.trained.folder import ModelFolder
import numpy as np

T = TypeVar('T')
# Frame sets without change; objects that are taken and put back.
STILL, CHANGES = 8, 4
# Noise of the readings from one frame set to the next, in metres at 1 m: a Kinect v2's.
NOISE_M = 0.0015


@dataclass(frozen=True)
class FollowingTime:
    """
    Seconds per frame set.

    :ivar what: the kind of frame set.
    :ivar seconds: median; `slowest` the longest of them.
    :ivar ratio: how many times faster than a parse of the frame set by itself.
    """

    what: str
    seconds: float
    slowest: float
    ratio: float


def live_times(folder: ModelFolder, scene: BenchScene, seed: int = 0) -> list[FollowingTime]:
    """Return the times of frame sets that show no change, an object taken, an object put."""
    parser, rng = Parser.load(folder, max_instances=0, sigmas=False), stage_rng(seed, 'bench/live')
    nothing: set[int] = set()

    def update(gone: set[int], previous: Any) -> tuple[Any, float]:
        views = views_without(scene.views, scene.observation, scene.meshes, gone, rng)
        return _timed(lambda: parser.update(views, previous, folder.seed))

    _, whole = zip(*(_timed(lambda: parser.parse(views_without(
        scene.views, scene.observation, scene.meshes, nothing, rng), folder.seed))
        for _ in range(3)))
    last, _ = update(nothing, None)
    still, taken, put = [], [], []
    for _ in range(STILL):
        last, seconds = update(nothing, last)
        still.append(seconds)
    for k in range(CHANGES):
        for gone, times in (({k}, taken), (nothing, put)):
            last, seconds = update(gone, last)
            times.append(seconds)
    alone = float(np.median(whole[1:]))
    kinds = {'every frame set by itself': list(whole[1:]), 'no change': still,
             'an object taken': taken, 'an object put': put}
    return [FollowingTime(what, float(np.median(times)), max(times),
                          alone / float(np.median(times))) for what, times in kinds.items()]


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    start = now()
    result = work()
    return result, now() - start


def views_without(given: Sequence[RectifiedView], observation: Observation,
                  meshes: Sequence[tuple[AnyArray, AnyArray]], gone: Collection[int],
                  rng: np.random.Generator) -> list[DepthView]:
    """
    Return raw views of a scene without some of its objects, with new noise.

    :param given: the views with all objects; `observation` is what they show.
    :param meshes: (vertices world, faces) of the objects; `gone` are indices into them.
    """
    views = []
    left = [mesh for k, mesh in enumerate(meshes) if k not in gone]
    for view, seen in zip(given, observation.views):
        depth = view.depth.copy()
        _, owner = render_depth(meshes, view.camera)
        behind, _ = render_depth(left, view.camera)
        pixels = np.isin(owner, list(gone))
        depth[pixels] = np.fmin(behind, seen.background)[pixels]
        depth += rng.normal(0, NOISE_M, depth.shape).astype(np.float32) * depth ** 2
        views.append(DepthView(view.camera, depth.astype(np.float32)))
    return views
