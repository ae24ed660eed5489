# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""From the subset that a search has chosen to a ParsedScene with its evidence."""

from dataclasses import dataclass, replace

from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.core.energy.eq1 import energy_of
from hooc_perception.core.frame.costs import PixelCosts
from hooc_perception.core.frame.evidence import hypotheses_of
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.types import Candidates, Energy, ParsedScene
import numpy as np


@dataclass(frozen=True)
class Choice:
    """
    A subset of a pool.

    :ivar mask: (n,) bool, the chosen rows of `pool`.
    :ivar marginal_energy: (chosen,) how much the search's energy rises without each object.
    :ivar converged: False where a deadline ended the search.
    :ivar considered: all candidates that were compared on the way; None = `pool`.
    :ivar probability: (n,) of the verifier, None where there is none.
    :ivar energy: Eq. 1 of the subset, None where it is still to be computed.
    """

    pool: Candidates
    mask: BoolArray
    marginal_energy: Float64Array
    converged: bool
    considered: Candidates | None = None
    probability: Float64Array | None = None
    energy: Energy | None = None


def parsed_scene(frame: Frame, choice: Choice, costs: PixelCosts) -> ParsedScene:
    """
    Return the ParsedScene of a choice.

    `score` is the verifier's probability where there is one, else the share of the object's
    pixels that agree with the measured depth.
    """
    objects = choice.pool.take(choice.mask)
    considered = choice.pool if choice.considered is None else choice.considered
    energy = choice.energy
    if energy is None:
        energy = energy_of(frame.observation, frame.probabilities, objects, frame.models)
    n = len(objects)
    if not n:
        none = np.zeros(0, np.float32)
        return ParsedScene(objects, energy, none, none, none, np.zeros(0, np.uint8), considered,
                           choice.converged, runners_up=choice.pool)
    evidence, weights = frame.evidence, costs.weights()
    H, shape = hypotheses_of(objects, frame.shapes), frame.shapes.of(objects)
    _, lists = evidence.compare_pixels(H, shape, weights)
    context = evidence.compose(np.arange(n), lists)
    stats = evidence.compare(H, shape, weights, context, np.arange(n))
    alone = np.maximum(stats[:, stat.SHOWN], 1)
    seen = alone - stats[:, stat.BEHIND]
    agree = stats[:, stat.AGREE]
    share = agree / np.maximum(agree + stats[:, stat.VIOLATE] + 20, 1)
    if choice.probability is not None:
        share = choice.probability[choice.mask]
    objects = replace(objects, score=np.clip(share, 0, 1).astype(np.float32))
    return ParsedScene(
        objects, energy, (seen / alone).astype(np.float32),
        (stats[:, stat.RESIDUAL] / np.maximum(agree, 1)).astype(np.float32),
        np.asarray(choice.marginal_energy, np.float32), stats[:, stat.VIEWS].astype(np.uint8),
        considered, choice.converged, runners_up=choice.pool.take(~choice.mask))
