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

from collections.abc import Callable, Mapping, Sequence
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

    verifier_scenes: int = param(30, 'Synthetic scenes to parse.', '', 4, 100000)
    unfamiliar_scenes: int = param(30, 'Further scenes, of objects that share only the name with '
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

    :ivar parsers: by fold of the population, with a classifier that has not seen it; by None
        where there is no population.
    :ivar base: what the scenes look like, before rig and deformation are drawn.
    """

    parsers: dict[int | None, Parser]
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
        config, seed = self.config, self.seed
        fold, parser = list(self.parsers.items())[k % len(self.parsers)]
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


def verifier_table(groups: Sequence[tuple[_Scenes, int]], jobs: int,
                   progress: Callable[[int], object]) -> tuple[Float32Array, UInt8Array]:
    """
    Return (x (n, FEATURES) float32, right (n,) uint8) of the candidates of all scenes.

    :param groups: scenes, and how many of them.
    :param progress: called with 1 after every scene.
    """
    parts = []
    with Parallel(n_jobs=jobs, return_as='generator') as parallel:
        for part in parallel(delayed(_Scenes.parsed)(scenes, k)
                             for scenes, n in groups for k in range(n)):
            parts.append(part)
            progress(1)
    return np.concatenate([x for x, _ in parts]), np.concatenate([y for _, y in parts])


def _groups(context: TrainingContext, config: VerifierConfig) -> list[tuple[_Scenes, int]]:
    """Return the kinds of scenes that a verifier learns from, and how many of each."""
    fused = next((c for c in context.configs if isinstance(c, FusedScenesConfig)),
                 FusedScenesConfig())
    limit = context.max_instances

    def scenes(population: Population, judges: Mapping[int | None, Arrays]) -> _Scenes:
        parsers = {fold: Parser(context.models, judge, profile(context.profile), limit)
                   for fold, judge in judges.items()}
        return _Scenes(parsers, population, context.cameras, config,
                       scene_config(fused, min(limit, 4) or 3), context.seed)

    if context.population:
        judges: dict[int | None, Arrays] = {
            fold: unaware_of(context.classifier, fold, 'forest_') for fold in range(FOLDS)}
        return [(scenes(context.population, judges), config.verifier_scenes)]
    groups = [(scenes((), {None: context.classifier}), config.verifier_scenes)]
    if config.unfamiliar_scenes:
        shapes = relatives_of(context.models, context.seed, context.jobs, TRAINING, UNFAMILIAR)
        groups.append((scenes(shapes, {UNFAMILIAR: context.classifier}),
                       config.unfamiliar_scenes))
    return groups


def fit_verifier(context: TrainingContext, config: VerifierConfig) -> Arrays:
    """Return the arrays of a verifier, `verifier_*`."""
    groups = _groups(context, config)
    with context.bar(sum(n for _, n in groups), 'parsed scenes', 'scene') as bar:
        x, right = verifier_table(groups, context.jobs, bar.update)
    if not len(x) or right.min() == right.max():
        return {}
    x[:, [FEATURES.index(name) for name in NOT_LEARNED]] = 0
    rng = stage_rng(context.seed, 'verifier')
    cuts = thresholds(x, config.forest.bins, rng)
    forest = fit(quantise(x, cuts), right, 2, cuts, config.forest, rng, context.jobs)
    return {'verifier_features': np.uint8(len(FEATURES)), **forest.arrays('verifier_')}
