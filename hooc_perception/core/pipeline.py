# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The method in one screen: from depth images to the objects on the table."""

import time

from hooc_perception.core.classification.classify import classify
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.hypotheses.propose import propose, propose_more
from hooc_perception.core.parsing.calibration import finished, with_sigmas
from hooc_perception.core.parsing.parse import parse
from hooc_perception.core.parsing.verifier import Verifier
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify


class Pipeline:
    """
    The whole chain in one process; bag replay and live nodes call the same stages.

    :param models: tuple of GenericModel; class id c is models[c - 1].
    :param classifier: dict of arrays, as training wrote it.
    :param profile: core.profiles.Profile.
    :param max_instances: most objects of one category in a scene, 0 = no limit.
    :param sigmas: whether to estimate how far off the poses are.
    """

    def __init__(self, models, classifier, profile, seed=0, max_instances=0, sigmas=False):
        """Keep what all scenes share."""
        self.sigmas = sigmas
        self.models, self.classifier, self.profile = tuple(models), classifier, profile
        self.seed, self.max_instances = seed, max_instances
        self.verifier = Verifier.from_arrays(classifier)

    def parse_scene(self, views, change_pool=None):
        """
        Return the ParsedScene of one frame set.

        :param views: sequence of DepthView, raw.
        :param change_pool: callable Candidates -> Candidates between stages 3 and 4, for
            experiments such as setting B of the paper.
        """
        p, seconds, clock = self.profile, {}, time.monotonic()

        def lap(stage, result):
            nonlocal clock
            now = time.monotonic()
            seconds[stage], clock = now - clock, now
            return result

        observation = lap('observe', observe([rectify(v, p.observe) for v in views], p.observe))
        probabilities = lap('classify', classify(observation, self.classifier, p.classify))
        pool = lap('propose', propose(observation, probabilities, self.models, p.propose,
                                      self.rng('propose')))
        if change_pool is not None:
            pool = change_pool(pool)
        scene = parse(observation, probabilities, pool, self.models, p.parse, self.rng('parse'),
                      self.max_instances, self.more(observation, probabilities), self.verifier)
        if self.sigmas:
            clock = time.monotonic()
            scene = lap('sigmas', with_sigmas(scene, observation, probabilities, self.models,
                                              p.parse, self.rng('sigmas')))
        return finished(scene, observation, self.models, p.parse,
                        self.verifier).timed(**seconds)

    def more(self, observation, probabilities):
        """Return the re-proposal that `parse` calls each round."""
        return proposer(observation, probabilities, self.models, self.profile.propose, self.seed)

    def rng(self, stage):
        """Return the Generator of a stage."""
        return stage_rng(self.seed, stage)


def proposer(observation, probabilities, models, config, seed):
    """Return a callable (objects, round) -> Candidates for the unexplained, see `parse`."""
    def more(objects, turn):
        return propose_more(observation, probabilities, models, objects, config,
                            stage_rng(seed, 'propose', turn))
    return more
