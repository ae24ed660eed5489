# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Learn to verify candidates (core/parsing/verifier.py) from parsed synthetic scenes.

The scenes are not those that the classifier was trained on. On shapes that it knows, a classifier
looks better than it is; that is why the objects of half of the scenes are made from relatives
(synthesis/population.py), which the classifier has never seen. Where it was trained on relatives,
all objects of a scene are made from those of one fold, and only the trees that have never seen
this fold take part.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from hooc_perception.core.arrays import Float32Array, UInt8Array
from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.parsing.verifier import FEATURES, features
from hooc_perception.core.profiles import profile
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.objects.catalogue import TRAINING
from hooc_perception.parser import Parser
from hooc_perception.synthesis.population import FOLDS, Population, relatives_of
from hooc_perception.synthesis.strangers import STRANGER
from hooc_perception.synthesis.training_scenes import training_scene, TrainingConfig
from hooc_perception.training.context import Arrays, TrainingContext
from hooc_perception.training.fit_forest import (
    fit,
    FitConfig,
    quantise,
    thresholds,
    unaware_of,
)
from hooc_perception.training.fused_scenes import FusedScenesConfig, scene_config
from joblib import delayed, Parallel
import numpy as np

# The fold of the relatives in unfamiliar scenes: a third of the shapes is enough for them.
UNFAMILIAR = 0
# A verifier that may ask for the category learns how its objects look in training.
NOT_LEARNED = ('category',)


@dataclass(frozen=True)
class VerifierConfig(Config):
    """How many scenes the verifier sees and when a candidate counts as right."""

    verifier_scenes: int = param(60, 'Synthetic scenes to parse.', '', 4, 100000)
    unfamiliar_scenes: int = param(60, 'Further scenes, of objects that share only the name with '
                                   'the generic meshes. Where the classifier was trained on such '
                                   'objects, all scenes consist of them, and there are no '
                                   'further ones.', '', 0, 100000)
    random_rigs: float = param(0.2, 'Share of scenes seen by another rig of one to four cameras.',
                               '', 0.0, 1.0)
    reshape_low: float = param(0.7, 'Smallest deformation of the objects.',
                               '', 0.0, 3.0)
    reshape_high: float = param(1.5, 'Largest deformation.', '', 0.0, 3.0)
    right_within: float = param(0.35, "Largest distance of a right candidate's centre from the "
                                'true one, as a share of the longest side.', '', 0.05, 1.0)
    forest: FitConfig = param(FitConfig(trees=60, features_per_node=9, node_samples=20000,
                                        max_depth=14, min_leaf=6, prior=2.0),
                              'Growth of the forest.')


@dataclass(frozen=True)
class _Scenes:
    """
    Synthetic scenes, parsed by the chain that the verifier is for.

    :ivar parsers: for each fold, with the trees that have not seen it; one where there are no
        relatives.
    :ivar base: what the scenes look like, before rig and deformation are drawn.
    """

    parsers: tuple[Parser, ...]
    population: Population
    cameras: tuple[Camera, ...]
    config: VerifierConfig
    base: TrainingConfig
    seed: int

    def parsed(self, k: int) -> tuple[Float32Array, UInt8Array]:
        """
        Return (x (n, FEATURES), right (n,)) of the candidates on the shortlist of scene k.

        :raises HoocError: where the parser's method has no verifier.
        """
        config, seed, fold = self.config, self.seed, k % len(self.parsers)
        parser = self.parsers[fold]
        rng = stage_rng(seed, 'verifier scenes', k)
        rig = 'random' if rng.random() < config.random_rigs else 'jittered'
        strength = float(rng.uniform(config.reshape_low, config.reshape_high))
        scene = training_scene(parser.models, self.cameras, rng,
                               replace(self.base, rig=rig, reshape_strength=strength),
                               population=self.population, fold=fold)
        method = parser.method
        if not isinstance(method, JointMethod):
            raise HoocError(f'the profile {parser.profile.name} has no verifier; train '
                            'without one')
        observation = parser.observe(scene.views)
        frame = parser.frame(observation, parser.classify(observation))
        search = method.search(frame, method.propose(frame, seed), seed, parser.max_instances)
        x = features(search)
        right = np.zeros(len(x), np.uint8)
        for o in (o for o in scene.objects if o.category != STRANGER):
            reach = config.right_within * parser.models[o.category - 1].longest_side
            right |= ((search.pool.category == o.category)
                      & (np.linalg.norm(search.pool.translation - o.translation, axis=1) < reach))
        return x, right


def verifier_table(context: TrainingContext, config: VerifierConfig,
                   progress: Callable[[int], object] | None = None,
                   ) -> tuple[Float32Array, UInt8Array]:
    """
    Return (x (n, FEATURES) float32, right (n,) uint8) of the candidates of all scenes.

    :param progress: called with 1 after every scene.
    """
    groups = [_scenes_of(context, config, context.population)]
    counts = [config.verifier_scenes]
    if config.unfamiliar_scenes and not context.population:
        groups.append(_scenes_of(context, config, relatives_of(
            context.models, context.seed, context.jobs, TRAINING, UNFAMILIAR), UNFAMILIAR))
        counts.append(config.unfamiliar_scenes)
    parts = []
    with Parallel(n_jobs=context.jobs, return_as='generator') as parallel:
        for part in parallel(delayed(_Scenes.parsed)(scenes, k)
                             for scenes, n in zip(groups, counts) for k in range(n)):
            parts.append(part)
            if progress:
                progress(1)
    return np.concatenate([x for x, _ in parts]), np.concatenate([y for _, y in parts])


def _scenes_of(context: TrainingContext, config: VerifierConfig, population: Population,
               fold: int | None = None) -> _Scenes:
    """
    Return the _Scenes of a population.

    :param fold: all relatives are of this fold, and the classifier knows none of them; None = it
        knows those of all folds.
    """
    fused = next((c for c in context.configs if isinstance(c, FusedScenesConfig)),
                 FusedScenesConfig())
    limit = context.max_instances
    judges = ([unaware_of(context.classifier, each, 'forest_') for each in range(FOLDS)]
              if population and fold is None else [context.classifier])
    return _Scenes(
        tuple(Parser(context.models, judge, profile(context.profile), limit) for judge in judges),
        population, context.cameras, config, scene_config(fused, min(limit, 4) or 3),
        context.seed)


def fit_verifier(context: TrainingContext, config: VerifierConfig) -> Arrays:
    """Return the arrays of a verifier, `verifier_*`."""
    further = 0 if context.population else config.unfamiliar_scenes
    with context.bar(config.verifier_scenes + further, 'parsed scenes', 'scene') as bar:
        x, right = verifier_table(context, config, bar.update)
    if not len(x) or right.min() == right.max():
        return {}
    x[:, [FEATURES.index(name) for name in NOT_LEARNED]] = 0
    rng = stage_rng(context.seed, 'verifier')
    cuts = thresholds(x, config.forest.bins, rng)
    forest = fit(quantise(x, cuts), right, 2, cuts, config.forest, rng, context.jobs)
    return {'verifier_features': np.uint8(len(FEATURES)), **forest.arrays('verifier_')}
