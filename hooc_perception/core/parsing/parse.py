# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 4: which of the candidates stand there.

`genetic` is the paper's search of Eq. 1; `joint` alternates a discrete search with continuous
refinement of what it chose and with new proposals where depth stays unexplained.
"""

from dataclasses import dataclass, replace
import time

from hooc_perception.core.config import param
from hooc_perception.core.energy.eq1 import energy_of, Eq1
from hooc_perception.core.energy.local_search import LocalSearchConfig
from hooc_perception.core.frame.evidence import hypotheses_of
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.frame.workspace import workspace_of
from hooc_perception.core.methods.genetic import genetic_search, GeneticConfig
from hooc_perception.core.parsing.search import search_scene, weights_of
from hooc_perception.core.parsing.verifier import features
from hooc_perception.core.types import ParsedScene
import numpy as np


@dataclass(frozen=True)
class ParseConfig(LocalSearchConfig, GeneticConfig):
    """Parameters of stage 4; GeneticConfig serves `genetic`, LocalSearchConfig `joint`."""

    search: str = param('joint', 'how the subset is found', choices=('joint', 'genetic'))
    patience: int = param(8, 'kicks in a row without a gain after which the search has '
                          'converged', low=0)
    kept: int = param(12, 'joint: candidates a category, beside the chosen, that go on to the '
                      'next round', low=1)
    finalists: int = param(8, 'joint: candidates a category, beside the chosen, that are looked '
                           'at in full resolution', low=1)
    rounds: int = param(3, 'joint: rounds of refinement and re-proposal', low=0)
    polish_steps: int = param(20, 'joint: steps of refinement of a chosen object', low=0)
    turn_steps: int = param(10, 'joint: steps of refinement of a chosen object after half a turn '
                            'about each of its axes; 0 = no such turns', low=0)
    tolerance_m: float = param(0.03, 'joint: depth residual as bad as no explanation', 'm',
                               0.002, 0.5)
    normal_weight: float = param(0.4, 'joint: cost of a perpendicular normal', '', 0.0, 2.0)
    category_weight: float = param(0.4, 'joint: cost of a category that the classifier rules out',
                                   '', 0.0, 4.0)
    free_weight: float = param(0.7, 'joint: cost of hiding what was measured farther away', '',
                               0.0, 2.0)
    complexity: float = param(0.1, 'joint: cost of a covered pixel', '', 0.0, 2.0)
    size_prior: float = param(0.05, 'joint: cost of squared log scale a covered pixel', '', 0, 2.0)
    base_cost: float = param(40.0, 'joint: cost of an object that no verifier has judged', 'px',
                             0.0, 1000.0)
    verify_weight: float = param(80.0, 'joint: worth of the odds that the verifier gives a '
                                 'candidate, each unit of their logarithm; 0 = the energy '
                                 'decides alone', 'px', 0.0, 1000.0)
    missing_against_false: float = param(3.0, 'joint: how much worse it is to miss an object than '
                                         'to report a false one', '', 0.01, 100.0)
    least_cost: float = param(40.0, 'joint: what an object costs at least, however probable, '
                              'where a category may stand there more than once', 'px', 0.0, 1e4)
    overlap: float = param(300.0, 'joint: cost of an object inside others', 'px', 0.0, 1e5)
    deadline_s: float = param(0.0, 'joint: seconds after which the best so far is the answer, '
                              '0 = none', 's', 0.0, 3600.0, runtime=True)


def parse(observation, probabilities, pool, models, config=ParseConfig(), rng=None,
          max_instances=0, more=None, verifier=None):
    """
    Return the ParsedScene: the objects that together explain the frame set best.

    :param pool: Candidates.
    :param max_instances: most objects of one category, 0 = no limit.
    :param more: callable (objects: Candidates, round: int) -> Candidates that proposes anew for
        what the objects leave unexplained; None = the pool is all there is.
    :param verifier: core.parsing.verifier.Verifier of the model, None = the energy decides alone.
    """
    start = time.monotonic()

    def late():
        return 0 < config.deadline_s < time.monotonic() - start

    if config.search == 'genetic':
        scene = _genetic(observation, probabilities, pool, models, config, rng, max_instances,
                         late)
    else:
        scene = _joint(observation, probabilities, pool, models, config, rng, max_instances,
                       more, late, verifier)
    return scene.timed(parse=time.monotonic() - start)


def _genetic(observation, probabilities, pool, models, config, rng, max_instances, late):
    """Search Eq. 1 as in the paper."""
    energy = Eq1(observation, probabilities, pool, models)
    mask, _, converged = genetic_search(len(pool), energy.evaluate, rng, config, pool.category,
                                        max_instances, late)
    energy.reset(mask)
    return _answer(observation, probabilities, models, pool, mask, energy.deltas()[mask],
                   energy.energy(mask), converged, config)


def _joint(observation, probabilities, pool, models, config, rng, max_instances, more, late,
           verifier):
    """Search the scene, ask the verifier what it thinks of the candidates, and decide."""
    state, found, considered = search_scene(observation, probabilities, pool, models, config,
                                            rng, max_instances, more, late)
    score = None
    if verifier is not None and config.verify_weight and len(state.pool):
        score = verifier.probability(features(state.evidence, state.pool, state.stats,
                                              state.lists, models, state.weighed()))
        found = state.judged(score).search(rng, late)
    return _answer(observation, probabilities, models, state.pool, state.mask, state.worth(),
                   None, found.converged and not late(), config, considered, score)


def _answer(observation, probabilities, models, pool, mask, worth, energy, converged, config,
            considered=None, probability=None):
    """Return the ParsedScene of a subset with its evidence."""
    objects = pool.take(mask)
    pool = pool if considered is None else considered
    if energy is None:
        energy = energy_of(observation, probabilities, objects, models)
    n = len(objects)
    if not n:
        none = np.zeros(0, np.float32)
        return ParsedScene(objects, energy, none, none, none, np.zeros(0, np.uint8), pool,
                           converged)
    evidence = workspace_of(observation, probabilities, models).evidence
    H = hypotheses_of(objects, models)
    _, lists = evidence.explain(H, objects.category, weights_of(config), lists=True)
    context = evidence.compose(np.arange(n), lists)
    stats = evidence.explain(H, objects.category, weights_of(config), context, me=np.arange(n))
    alone = np.maximum(stats[:, stat.SHOWN], 1)
    seen = alone - stats[:, stat.BEHIND]
    agree = stats[:, stat.AGREE]
    share = agree / np.maximum(agree + stats[:, stat.VIOLATE] + 20, 1)
    if probability is not None:
        share = probability[mask]
    objects = replace(objects, score=np.clip(share, 0, 1).astype(np.float32))
    return ParsedScene(objects, energy, (seen / alone).astype(np.float32),
                       (stats[:, stat.RESIDUAL] / np.maximum(agree, 1)).astype(np.float32),
                       np.asarray(worth, np.float32), stats[:, stat.VIEWS].astype(np.uint8), pool,
                       converged)
