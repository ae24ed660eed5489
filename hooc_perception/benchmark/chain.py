# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The whole chain on the bench scene: where its time goes, and its memory."""

from dataclasses import dataclass
import resource

from hooc_perception.benchmark.scene import BenchScene
from hooc_perception.core.types import DepthView
from hooc_perception.parser import Parser
from hooc_perception.trained.folder import ModelFolder
import numpy as np

RUNS = 3


@dataclass(frozen=True)
class ChainTimes:
    """
    The time and memory of one profile.

    :ivar seconds: {stage: median s over the runs}.
    :ivar objects, candidates: their numbers, as a sign that work was done.
    :ivar peak_mb: peak memory of this process so far, everything included.
    """

    profile: str
    seconds: dict[str, float]
    objects: int
    candidates: int
    peak_mb: float


def chain_times(folder: ModelFolder, scene: BenchScene) -> ChainTimes:
    """
    Return the ChainTimes of the profile that a model was trained for.

    The first run compiles and warms up; it is not counted.
    """
    parser = Parser.load(folder, max_instances=0, sigmas=False)
    views = [DepthView(view.camera, view.depth) for view in scene.views]
    parsed = [parser.parse(views, folder.seed).parsed for _ in range(RUNS + 1)][1:]
    stages = parsed[0].seconds
    return ChainTimes(
        folder.profile,
        {stage: float(np.median([p.seconds[stage] for p in parsed])) for stage in stages},
        len(parsed[0].objects), len(parsed[0].pool),
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
