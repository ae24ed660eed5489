# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Feature tables for the fused forest: synthetic scenes over random rigs, in parallel."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import cast, TypeAlias

from hooc_perception.core.arrays import (
    AnyArray,
    Float32Array,
    Float64Array,
    Int8Array,
    Int32Array,
    Int64Array,
    UInt8Array,
)
from hooc_perception.core.classification import features
from hooc_perception.core.classification.table_network import from_arrays, TableNetwork
from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.profiles import profile
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import Camera, GenericModel, Observation
from hooc_perception.synthesis.population import Population
from hooc_perception.synthesis.scatter import ScatterConfig
from hooc_perception.synthesis.training_scenes import (
    training_scene,
    TrainingConfig,
    TrainingScene,
)
from hooc_perception.training.context import Arrays, TrainingContext
from hooc_perception.training.fit_forest import quantise, thresholds
from hooc_perception.training.network.weights import bundled
from joblib import delayed, Parallel
import numpy as np

# Scenes per parallel task.
GROUP = 4
# Of n pixels: x (n, F) float32, y (n,) uint8 classes, fold (n,) int8 of the objects' shapes.
Rows: TypeAlias = tuple[Float32Array, UInt8Array, Int8Array]


@dataclass(frozen=True)
class FusedScenesConfig(Config):
    """How many scenes the fused forest is trained on, of what kind, and what is kept of each."""

    scenes: int = param(600, 'Synthetic scenes.', '', 8, 100000)
    random_rigs: float = param(0.3, 'Share of scenes seen by a random rig of one to four cameras '
                               'instead of the given one, moved a little; they keep the forest '
                               'usable on any rig.', '', 0.0, 1.0)
    reshape_low: float = param(0.5, 'Smallest deviation of the objects of a scene from the '
                               'generic meshes; 1 = as real objects.', '', 0.0, 3.0)
    reshape_high: float = param(1.8, 'Largest deviation; scenes draw uniformly in between.', '',
                                0.0, 3.0)
    relatives: bool = param(False, 'Whether objects are also made from the families of the '
                            'built-in catalogue that bear the names of the categories, or, where '
                            'there is none, from strongly reshaped copies.')
    translucent: float = param(0.08, 'Share of objects with the depth error of glass.', '', 0.0,
                               1.0)
    objects_low: int = param(8, 'Fewest objects per scene.', '', 1, 200)
    objects_high: int = param(20, 'Most objects per scene.', '', 1, 200)
    strangers: int = param(0, 'Most things of no category per scene: random shapes, and members '
                           'of families of the built-in catalogue that the set does not have. '
                           'They are background to the classifier and wrong to the verifier.', '',
                           0, 50)
    rows_sqrt: float = param(1.2, 'Pixels kept of a class with n foreground pixels in a scene: '
                             'this times sqrt(n). Large objects would outweigh small ones, and '
                             'more scenes help more than more pixels of each.', '', 0.1, 100.0)
    probes: int = param(0, 'Random points of the fused field that a pixel reads in addition to '
                        'the rings; 192 of them took a third of the time without a measurable '
                        'gain.', '', 0, 5000)
    network: bool = param(True, 'Whether the forest reads what the network over the table says '
                          'of a pixel.')
    quantile_scenes: int = param(24, 'First scenes, which set the quantisation of the features.',
                                 '', 4, 1000)
    bins: int = param(64, 'Quantisation levels of a feature.', '', 2, 255)


@dataclass
class FusedTable:
    """
    Quantised features of labelled pixels.

    :ivar binned: (F, n) uint8; `cuts` (F, bins - 1) float32; `y` (n,) uint8 classes; `fold` (n,)
        int8 of the shapes (synthesis/population.py); `scene` (n,) int32; `probes` (P, 5) as in
        `core.classification.features.draw_probes`.
    """

    binned: UInt8Array
    cuts: Float32Array
    y: UInt8Array
    fold: Int8Array
    scene: Int32Array
    probes: Float64Array


def scene_config(config: FusedScenesConfig, repeats: int) -> TrainingConfig:
    """Return the TrainingConfig of a FusedScenesConfig, its rig still the given one."""
    return TrainingConfig(
        arrangement='settled', rig='jittered',
        randomise_sensor=True, translucent=config.translucent, strangers=config.strangers,
        scatter=ScatterConfig(objects_low=config.objects_low, objects_high=config.objects_high,
                              repeats=repeats, pose='resting'))


def network_of(config: FusedScenesConfig) -> Arrays:
    """Return the arrays of the network that the forest reads, {} = none."""
    return bundled() if config.network else {}


def draw_rows(y: UInt8Array, rng: np.random.Generator, rows_sqrt: float) -> Int64Array:
    """Return ascending rows: of each class with n entries in y, rows_sqrt * sqrt(n) at most."""
    rows: list[Int64Array] = []
    for c in np.unique(y):
        members = np.flatnonzero(y == c)
        n = min(len(members), int(np.ceil(rows_sqrt * np.sqrt(len(members)))))
        rows.append(rng.choice(members, n, replace=False))
    return np.sort(np.concatenate(rows)) if rows else np.zeros(0, np.int64)


def at_foreground(observation: Observation, images: Sequence[AnyArray]) -> AnyArray:
    """Return (n,) the values of images, (H, W) per view, at the pixels of `foreground_pixels`."""
    return np.concatenate([image[view.foreground & np.isfinite(view.depth)]
                           for image, view in zip(images, observation.views)])


def labelled_features(observation: Observation, scene: TrainingScene, probes: Float64Array,
                      rng: np.random.Generator, rows_sqrt: float,
                      network: TableNetwork | None = None) -> Rows:
    """Return the Rows of drawn foreground pixels of one scene and its Observation."""
    pixels = features.foreground_pixels(observation)
    y = at_foreground(observation, scene.labels)
    fold = at_foreground(observation, scene.folds)
    if not len(y):
        return np.zeros((0, features.feature_count(len(probes), network)), np.float32), y, fold
    rows = draw_rows(y, rng, rows_sqrt)
    around = features.surroundings(observation, pixels, table=network is not None)
    x = features.pixel_features(pixels, around, probes, rows, network)
    return x, y[rows], fold[rows]


@dataclass(frozen=True)
class _Source:
    """
    Where synthetic scenes come from.

    :ivar population: relatives of the models.
    :ivar repeats: most objects of one category per scene.
    """

    models: Sequence[GenericModel]
    population: Population
    cameras: Sequence[Camera]
    config: FusedScenesConfig
    repeats: int
    seed: int
    observe: ObserveConfig

    def features(self, k: int, probes: Float64Array) -> Rows:
        """Return the Rows of drawn foreground pixels of scene k."""
        rng, config = stage_rng(self.seed, 'fused scenes', k), self.config
        rig = 'random' if rng.random() < config.random_rigs else 'jittered'
        strength = float(rng.uniform(config.reshape_low, config.reshape_high))
        scene = training_scene(self.models, self.cameras, rng,
                               replace(scene_config(config, self.repeats), rig=rig,
                                       reshape_strength=strength),
                               population=self.population)
        return labelled_features(observe(scene.views, self.observe), scene, probes, rng,
                                 config.rows_sqrt, from_arrays(network_of(config)))


def _raw_group(source: _Source, start: int, stop: int, probes: Float64Array) -> list[Rows]:
    """Return the Rows of the scenes start .. stop - 1."""
    return [source.features(k, probes) for k in range(start, stop)]


def _binned_group(source: _Source, start: int, stop: int, probes: Float64Array,
                  cuts: Float32Array) -> list[tuple[UInt8Array, UInt8Array, Int8Array]]:
    """Return (quantised x, y, fold) of the scenes start .. stop - 1."""
    return [(quantise(x, cuts), y, fold)
            for x, y, fold in _raw_group(source, start, stop, probes)]


def fused_table(context: TrainingContext, config: FusedScenesConfig,
                progress: Callable[[int], object] | None = None) -> FusedTable:
    """
    Return the FusedTable of synthetic scenes; the same for any number of jobs.

    :param progress: called with the number of scenes done since the last call.
    """
    seed, limit = context.seed, context.max_instances
    source = _Source(context.models, context.population, context.cameras, config,
                     min(limit, 4) or 3, seed, profile(context.profile).observe)
    probes = features.draw_probes(stage_rng(seed, 'probes'), config.probes)
    first = min(config.quantile_scenes, config.scenes)
    with Parallel(n_jobs=context.jobs, return_as='generator') as parallel:
        def scenes(work: Callable[..., list], low: int, high: int, *arrays: object) -> list:
            done = []
            groups = parallel(delayed(work)(source, start, min(start + GROUP, high), *arrays)
                              for start in range(low, high, GROUP))
            for group in cast(Iterable[list], groups):
                done.extend(group)
                if progress:
                    progress(len(group))
            return done

        raw = scenes(_raw_group, 0, first, probes)
        cuts = thresholds(np.concatenate([x for x, *_ in raw]), config.bins,
                          stage_rng(seed, 'thresholds'))
        parts = [(quantise(x, cuts), y, fold) for x, y, fold in raw]
        parts.extend(scenes(_binned_group, first, config.scenes, probes, cuts))
    y = np.concatenate([y for _, y, _ in parts])
    fold: Int8Array = np.concatenate([fold for *_, fold in parts])
    scene = np.repeat(np.arange(len(parts), dtype=np.int32), [len(y) for _, y, _ in parts])
    return FusedTable(np.concatenate([x for x, *_ in parts], axis=1), cuts, y, fold, scene,
                      probes)
