# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Learn to verify candidates (core/parsing/verifier.py) from parsed synthetic scenes.

The scenes are of the same kind as those that taught the classifier, but others: a classifier
looks too good on what it has seen.
"""

from dataclasses import dataclass, replace

from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.parsing.verifier import FEATURES, features
from hooc_perception.core.profiles import profile as profile_of
from hooc_perception.errors import HoocError
from hooc_perception.parser import Parser
from hooc_perception.synthesis.training_scenes import training_scene
from hooc_perception.training.fit_forest import fit, FitConfig, quantise, thresholds
from hooc_perception.training.fused_scenes import FusedScenesConfig, scene_config
from joblib import delayed, Parallel
import numpy as np


@dataclass(frozen=True)
class VerifierConfig(Config):
    """How many scenes the verifier sees and when a candidate counts as right."""

    verifier_scenes: int = param(60, 'Synthetic scenes that are parsed.', '', 4, 100000)
    random_rigs: float = param(0.2, 'Share of them seen by another rig of one to four cameras.',
                               '', 0.0, 1.0)
    reshape_low: float = param(0.7, 'Least departure of the objects from the generic meshes.',
                               '', 0.0, 3.0)
    reshape_high: float = param(1.5, 'Largest departure.', '', 0.0, 3.0)
    right_within: float = param(0.35, "Distance of a right candidate's centre from the true one, "
                                'as a share of the longest side.', '', 0.05, 1.0)
    forest: FitConfig = param(FitConfig(trees=60, features_per_node=9, node_samples=20000,
                                        max_depth=14, min_leaf=6, prior=2.0),
                              'Growth of the forest.')


def verifier_table(models, cameras, classifier, config, scenes, profile, seed, max_instances=0,
                   n_jobs=1, progress=None):
    """
    Return (x (n, FEATURES) float32, right (n,) uint8) of all candidates in the running.

    :param scenes: FusedScenesConfig of the classifier: what its scenes look like.
    :param profile: name of the profile whose chain parses.
    :param progress: called with 1 after every scene.
    """
    chain = profile_of(profile)
    base = scene_config(scenes, min(max_instances, 4) or 3)
    with Parallel(n_jobs=n_jobs, return_as='generator') as parallel:
        parts = []
        for part in parallel(delayed(_scene)(models, cameras, classifier, config, base, chain,
                                             seed, max_instances, k)
                             for k in range(config.verifier_scenes)):
            parts.append(part)
            if progress:
                progress(1)
    return np.concatenate([x for x, _ in parts]), np.concatenate([y for _, y in parts])


def _scene(models, cameras, classifier, config, base, chain, seed, max_instances, k):
    """Return (x, right) of the synthetic scene k."""
    rng = stage_rng(seed, 'verifier scenes', k)
    rig = 'random' if rng.random() < config.random_rigs else 'jittered'
    strength = float(rng.uniform(config.reshape_low, config.reshape_high))
    scene = training_scene(models, cameras, rng,
                           replace(base, rig=rig, reshape_strength=strength))
    parser = Parser(models, classifier, chain, max_instances)
    method = parser.method
    if not isinstance(method, JointMethod):
        raise HoocError(f'the profile {chain.name} has no verifier; train without one')
    observation = parser.observe(scene.views)
    frame = parser.frame(observation, parser.classify(observation))
    search = method.search(frame, method.propose(frame, seed), seed, max_instances)
    x = features(search)
    right = np.zeros(len(x), np.uint8)
    for o in scene.objects:
        reach = config.right_within * models[o.category - 1].longest_side
        right |= ((search.pool.category == o.category)
                  & (np.linalg.norm(search.pool.translation - o.translation, axis=1) < reach))
    return x, right


def fit_verifier(context, config):
    """Return the arrays of a verifier, `verifier_*`; see training/train.py for the context."""
    scenes = next((c for c in context.configs if isinstance(c, FusedScenesConfig)),
                  FusedScenesConfig())
    with context.bar(config.verifier_scenes, 'parsed scenes', 'scene') as bar:
        x, right = verifier_table(context.models, context.cameras, context.classifier, config,
                                  scenes, context.profile, context.seed,
                                  context.max_instances, context.jobs, bar.update)
    if not len(x) or right.min() == right.max():
        return {}
    rng = stage_rng(context.seed, 'verifier')
    cuts = thresholds(x, config.forest.bins, rng)
    forest = fit(quantise(x, cuts), right, 2, cuts, config.forest, rng, context.jobs)
    return {'verifier_features': np.uint8(len(FEATURES)), **forest.arrays('verifier_')}
