# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The whole chain on the bench scene: where its time goes, and its memory."""

from dataclasses import dataclass
import resource

from hooc_perception.core.types import DepthView
from hooc_perception.parser import Parser
import numpy as np

RUNS = 3


@dataclass(frozen=True)
class ChainTimes:
    """
    What one profile took.

    :ivar seconds: {stage: median s over the runs}.
    :ivar objects, candidates: how many there were, as a sign that work was done.
    :ivar peak_mb: most memory that this process has had so far, everything included.
    """

    profile: str
    seconds: dict
    objects: int
    candidates: int
    peak_mb: float


def chain_times(folder, scene):
    """
    Return the ChainTimes of a ModelFolder's own profile on a BenchScene.

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
