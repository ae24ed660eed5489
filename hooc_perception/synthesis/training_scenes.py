# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Labelled synthetic views of generic models, the training data of the forests."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from hooc_perception.core.arrays import Int8Array, UInt8Array
from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.memo import latest
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, GenericModel, RectifiedView
from hooc_perception.errors import HoocError
from hooc_perception.synthesis.population import Population
from hooc_perception.synthesis.reshape import reshape_placed
from hooc_perception.synthesis.rigs import jittered_rig, random_rig, undistorted
from hooc_perception.synthesis.room import draw_room, RoomConfig
from hooc_perception.synthesis.scatter import (
    models_key,
    PlacedObject,
    ScatterConfig,
    Scatterer,
)
from hooc_perception.synthesis.sensor import miscalibrated, randomised, sense, SensorConfig
import joblib
import numpy as np
from tqdm import tqdm


@dataclass(frozen=True)
class TrainingConfig(Config):
    """Properties of training scenes; the defaults are the paper's."""

    arrangement: str = param('scatter', 'Upright without overlap (scatter: the paper) or dropped '
                             'and at rest by physics (settled).', choices=('scatter', 'settled'))
    reshape_strength: float = param(0.0, 'Deviation of objects from the generic shape; 1 = as '
                                    'real objects.', '', 0.0, 3.0)
    renders: int = param(1, 'Scenes rendered from one settled arrangement, each with another '
                         'rig and other noise.', '', 1, 100)
    rig: str = param('given', 'The given cameras, the same with slightly changed poses, or other '
                     'ones anywhere around the table.', choices=('given', 'jittered', 'random'))
    cameras_low: int = param(1, 'Fewest cameras of a random rig.', '', 1, 16)
    cameras_high: int = param(4, 'Most cameras of a random rig.', '', 1, 16)
    calibration_rad: float = param(0.0015, 'Standard deviation of the calibrated rotation of a '
                                   'camera from the true one, per axis.', 'rad', 0.0, 0.2)
    calibration_m: float = param(0.0015, 'The same for its position, per axis.', 'm', 0.0, 0.2)
    randomise_sensor: bool = param(False, "Draw the sensor's parameters anew for every scene.")
    translucent: float = param(0.0, 'Share of objects that are translucent.', '', 0.0, 1.0)
    strangers: int = param(0, 'Most things of no category per scene.', '', 0, 50)
    scatter: ScatterConfig = param(ScatterConfig(), 'How scattered scenes are drawn.')
    sensor: SensorConfig = param(SensorConfig(), 'The simulated sensor.')
    room: RoomConfig = param(RoomConfig(), 'Table and surroundings.')


PAPER = TrainingConfig()
BEST = TrainingConfig(arrangement='settled', reshape_strength=1.0, renders=3, rig='jittered',
                      randomise_sensor=True, translucent=0.08)


@dataclass(frozen=True)
class TrainingScene:
    """
    One labelled synthetic scene.

    :ivar views: one per camera, with the errors of a calibration.
    :ivar labels: (H, W) uint8 class ids per view, 0 = background; also where depth is NaN.
    :ivar objects: the rendered objects.
    :ivar folds: (H, W) int8 per view, `fold` of the object at each pixel; -1 = none.
    """

    views: tuple[RectifiedView, ...]
    labels: tuple[UInt8Array, ...]
    objects: tuple[PlacedObject, ...]
    folds: tuple[Int8Array, ...]


def render_scene(objects: Sequence[PlacedObject], cameras: Sequence[Camera],
                 rng: np.random.Generator, config: TrainingConfig = TrainingConfig(),
                 translucent: Collection[int] = ()) -> TrainingScene:
    """
    Return the TrainingScene of posed objects seen by rectified cameras.

    :param translucent: indices into `objects` with the error of glass.
    """
    room = draw_room(rng, config.room).meshes()
    solid = [(o.vertices_world, o.faces) for o in objects]
    meshes = solid + room
    classes = np.zeros(len(meshes) + 1, np.uint8)
    classes[:len(objects)] = [o.category for o in objects]
    fold = np.full(len(classes), -1, np.int8)
    fold[:len(objects)] = [o.fold for o in objects]
    sensor = randomised(config.sensor, rng) if config.randomise_sensor else config.sensor
    views, labels, folds = [], [], []
    for camera in cameras:
        true = undistorted(camera)
        depth, ids = render_depth(meshes, true)
        behind = None
        if len(translucent):
            behind = render_depth([m for i, m in enumerate(meshes) if i not in translucent],
                                  true)[0]
        ids[ids >= len(objects)] = -1
        measured, seen = sense(depth, ids, true, rng, sensor, tuple(translucent), behind)
        written = miscalibrated(true, rng, config.calibration_rad, config.calibration_m)
        views.append(RectifiedView(written, measured))
        labels.append(classes[seen])
        folds.append(fold[seen])
    return TrainingScene(tuple(views), tuple(labels), tuple(objects), tuple(folds))


def training_scene(models: Sequence[GenericModel], cameras: Sequence[Camera],
                   rng: np.random.Generator, config: TrainingConfig = TrainingConfig(),
                   scatterer: Scatterer | None = None,
                   objects: Sequence[PlacedObject] | None = None,
                   population: Population = (), fold: int | None = None) -> TrainingScene:
    """
    Return one random TrainingScene.

    :param models: class id c is models[c - 1].
    :param cameras: of the set; lens distortion is ignored.
    :param scatterer: of the same models, kept between calls for speed.
    :param objects: an existing arrangement to render instead of a new one.
    :param population: relatives of the models; settled objects are made from them as well.
    :param fold: make objects only from relatives of this fold, where there are any.
    """
    if not cameras:
        raise HoocError('training scenes need at least one camera, but there are none; add '
                        'cameras to the set')
    if objects is None and config.arrangement == 'settled':
        objects = _settled(models, rng, config, population, fold)
    elif objects is None:
        objects = (scatterer or Scatterer(models, config.scatter)).scene(rng)
        if config.reshape_strength > 0:
            objects = [reshape_placed(o, rng, config.reshape_strength,
                                      models[o.category - 1].symmetry) for o in objects]
    if config.rig == 'random':
        cameras = random_rig(cameras, rng, config.cameras_low, config.cameras_high)
    elif config.rig == 'jittered':
        cameras = jittered_rig(cameras, rng)
    translucent = tuple(np.flatnonzero(rng.random(len(objects)) < config.translucent).tolist())
    return render_scene(objects, cameras, rng, config, translucent)


def training_scenes(models: Sequence[GenericModel], cameras: Sequence[Camera],
                    config: TrainingConfig = TrainingConfig(), seed: int = 0, n: int = 500,
                    progress: bool = False, stage: str = 'training',
                    jobs: int = 1) -> Iterator[TrainingScene]:
    """
    Yield n TrainingScenes; with given settings, scene k depends only on (seed, stage, k).

    :param stage: name of the random stream; other scenes, such as those that fill the leaves
        of a forest, use another name.
    :param jobs: processes; the order and the scenes are the same for any number.
    """
    settled = config.arrangement == 'settled'
    group = config.renders if settled else 8
    starts = range(0, n, group)
    run = joblib.delayed(_group)
    parallel = joblib.Parallel(n_jobs=jobs, return_as='generator')
    scenes: Any = parallel(run(tuple(models), tuple(cameras), config, seed, stage, start,
                          min(start + group, n)) for start in starts)
    with tqdm(total=n, disable=not progress, unit='scene', desc='synthetic scenes') as bar:
        for batch in scenes:
            bar.update(len(batch))
            yield from batch


@latest(1, key=lambda models, config: (models_key(models), config))
def _scatterer(models: Sequence[GenericModel], config: ScatterConfig) -> Scatterer:
    """Return this process's Scatterer of the models, so that shapes are built only once."""
    return Scatterer(models, config)


def _group(models: Sequence[GenericModel], cameras: Sequence[Camera], config: TrainingConfig,
           seed: int, stage: str, start: int, stop: int) -> list[TrainingScene]:
    """Return the scenes start..stop - 1; in a settled group they share one arrangement."""
    objects = scatterer = None
    if config.arrangement == 'settled':
        objects = _settled(models, stage_rng(seed, stage + '/settle', start), config)
    else:
        scatterer = _scatterer(models, config.scatter)
    return [training_scene(models, cameras, stage_rng(seed, stage, k), config, scatterer,
                           objects) for k in range(start, stop)]


def _settled(models: Sequence[GenericModel], rng: np.random.Generator,
             config: TrainingConfig, population: Population = (),
             fold: int | None = None) -> list[PlacedObject]:
    """Return a settled arrangement of reshaped models and relatives."""
    # Imported late: the paper's scenes do not need physics.
    from hooc_perception.synthesis.settle import settled_models
    return settled_models(models, rng, config.scatter, config.reshape_strength,
                          population=population, fold=fold, strangers=config.strangers)
