# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Labelled maps of synthetic tables, from which the network learns.

Its categories are those of the built-in catalogue; a model's own categories are learned by the
forest, from what the network says of them. No set takes part. Objects are made from nominal and
other members of the families, and vary in size more than in the forest's scenes: the network is to
tell a category by its form.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import cast

from hooc_perception.core.arrays import Float16Array, Float32Array, Int8Array, UInt8Array
from hooc_perception.core.classification import features, table_network
from hooc_perception.core.classification.table_network import Surface
from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.profiles import profile
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import Camera, GenericModel
from hooc_perception.synthesis.population import Population
from hooc_perception.synthesis.scatter import ScatterConfig
from hooc_perception.synthesis.training_scenes import (
    training_scene,
    TrainingConfig,
    TrainingScene,
)
from hooc_perception.training.fused_scenes import at_foreground, draw_rows
from joblib import delayed, Parallel
import numpy as np

# Arrangements per parallel task.
GROUP = 8


@dataclass(frozen=True)
class ExamplesConfig(Config):
    """How many maps the network learns from, and of what kind of scenes."""

    arrangements: int = param(1600, 'Synthetic arrangements of objects.', '', 1, 100000)
    renders: int = param(2, 'Maps of each, with other cameras and other noise.', '', 1, 100)
    relatives: float = param(0.6, 'Share of arrangements whose objects are also made from other '
                             'members of the families.', '', 0.0, 1.0)
    strangers: float = param(0.35, 'Share of arrangements with things of no category.', '', 0.0,
                             1.0)
    most_strangers: int = param(4, 'Most of them.', '', 0, 50)
    size_spread: float = param(0.15, "Standard deviation of the logarithm of an object's size, "
                               'on top of its deformation.', '', 0.0, 0.5)
    reshape_low: float = param(0.5, 'Smallest deviation of the objects from their meshes.', '',
                               0.0, 3.0)
    reshape_high: float = param(1.6, 'Largest deviation.', '', 0.0, 3.0)
    random_rigs: float = param(0.3, 'Share of maps seen by a random rig of one to four cameras.',
                               '', 0.0, 1.0)
    translucent: float = param(0.08, 'Share of objects with the depth error of glass.', '', 0.0,
                               1.0)
    rows_sqrt: float = param(2.5, 'Pixels kept of a class with n foreground pixels: this times '
                             'sqrt(n).', '', 0.1, 100.0)


@dataclass(frozen=True)
class Example:
    """
    A map of a table with labelled points of its foreground.

    :ivar slices: (S, n, n) int8 and `layers` (L, n, n) float16 as those of a FusedMap.
    :ivar points: (p, 3) float32 metres, x and y from the map's first cell, z above the table;
        `normals` (p, 3) and `residual` (p,) float16 as in Surface; `y` (p,) uint8 classes.
    """

    slices: Int8Array
    layers: Float16Array
    points: Float32Array
    normals: Float16Array
    residual: Float16Array
    y: UInt8Array

    @property
    def surface(self) -> Surface:
        """Return the points as the network takes them."""
        return Surface(self.points.astype(np.float64), self.normals.astype(np.float32),
                       self.residual.astype(np.float32))


@dataclass(frozen=True)
class _Source:
    """
    Where the arrangements come from.

    :ivar population: relatives of the models.
    """

    models: Sequence[GenericModel]
    population: Population
    cameras: Sequence[Camera]
    config: ExamplesConfig
    seed: int

    def examples(self, k: int) -> list[Example]:
        """Return the Examples of arrangement k."""
        rng, config = stage_rng(self.seed, 'network scenes', k), self.config
        population = self.population if rng.random() < config.relatives else ()
        strangers = config.most_strangers if rng.random() < config.strangers else 0
        base = TrainingConfig(
            arrangement='settled', randomise_sensor=True, translucent=config.translucent,
            strangers=strangers,
            reshape_strength=float(rng.uniform(config.reshape_low, config.reshape_high)),
            scatter=ScatterConfig(objects_low=8, objects_high=20, pose='resting',
                                  size_spread=config.size_spread))
        made, objects = [], None
        for _ in range(config.renders):
            rig = 'random' if rng.random() < config.random_rigs else 'jittered'
            scene = training_scene(self.models, self.cameras, rng, replace(base, rig=rig),
                                   objects=objects, population=population)
            objects = scene.objects
            example = labelled(scene, rng, config.rows_sqrt)
            if example is not None:
                made.append(example)
        return made


def labelled(scene: TrainingScene, rng: np.random.Generator, rows_sqrt: float) -> Example | None:
    """Return the Example of a scene, None where it shows no object."""
    observation = observe(scene.views, profile('best').observe)
    pixels = features.foreground_pixels(observation)
    if not len(pixels.points):
        return None
    y = at_foreground(observation, scene.labels)
    rows = draw_rows(y, rng, rows_sqrt)
    n = table_network.FEWEST_CELLS
    middle = (pixels.points[:, :2].min(0) + pixels.points[:, :2].max(0)) / 2
    grid = table_network.centred(middle, table_network.CELL_M, (n, n))
    fused = table_network.fuse(*features.depth_images(observation.views), grid)
    return Example(fused.slices, fused.layers.astype(np.float16),
                   (pixels.points[rows] - grid.origin).astype(np.float32),
                   pixels.normals[rows].astype(np.float16),
                   pixels.residual[rows].astype(np.float16), y[rows])


def _group(source: _Source, start: int, stop: int) -> list[Example]:
    """Return the Examples of the arrangements start .. stop - 1."""
    return [example for k in range(start, stop) for example in source.examples(k)]


def examples(models: Sequence[GenericModel], population: Population, cameras: Sequence[Camera],
             config: ExamplesConfig, seed: int, jobs: int,
             progress: Callable[[int], object]) -> list[Example]:
    """
    Return the Examples of all arrangements; the same for any number of jobs.

    :param models: class id c is models[c - 1].
    :param population: relatives of the models.
    :param progress: called with the number of arrangements done since the last call.
    """
    source = _Source(tuple(models), population, tuple(cameras), config, seed)
    made: list[Example] = []
    with Parallel(n_jobs=jobs, return_as='generator') as parallel:
        starts = range(0, config.arrangements, GROUP)
        groups = parallel(delayed(_group)(source, a, min(a + GROUP, config.arrangements))
                          for a in starts)
        for start, group in zip(starts, cast(Iterable[list[Example]], groups)):
            made.extend(group)
            progress(min(GROUP, config.arrangements - start))
    return made
