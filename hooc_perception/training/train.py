# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
`hooc train`: from generic meshes and cameras to a MODEL folder, without looking at a scene.

PROFILES lists what each profile learns. Each step is a function of the TrainingContext: it
returns arrays, which are stored with the classifier, and may read those of the earlier steps.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, replace
import json
from pathlib import Path
from typing import Any, Protocol, TypeVar

from hooc_perception.core.arrays import BoolArray
from hooc_perception.core.classification.classify import FORMAT_VERSION, KIND_FUSED, KIND_PAPER
from hooc_perception.core.classification.forest import Forest
from hooc_perception.core.config import Config
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.types import Camera, GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.objects.catalogue import TRAINING
from hooc_perception.objects.derive import derive
from hooc_perception.objects.mesh import load_mesh
from hooc_perception.synthesis.population import relatives_of
from hooc_perception.synthesis.training_scenes import PAPER, training_scenes
from hooc_perception.trained.folder import check_place, ModelFolder, save_model_folder
from hooc_perception.training import fit_pixels
from hooc_perception.training.context import Arrays, TrainingContext
from hooc_perception.training.fit_forest import fit, FitConfig, unaware_of
from hooc_perception.training.fit_verifier import fit_verifier, VerifierConfig
from hooc_perception.training.fused_scenes import (
    fused_table,
    FusedScenesConfig,
    FusedTable,
    network_of,
)
import joblib
import numpy as np
from tqdm import tqdm

T = TypeVar('T')
PROFILES: dict[str, tuple[Config, ...]] = {
    'paper': (fit_pixels.PixelFitConfig(),),
    'best': (FusedScenesConfig(), FitConfig(), VerifierConfig()),
    'fast': (FusedScenesConfig(scenes=240, network=False), FitConfig(trees=24),
             VerifierConfig(unfamiliar_scenes=0)),
}


# What changes where training makes objects from relatives as well: the shapes differ by
# themselves, and every tree sees two thirds of them.
WITH_RELATIVES: dict[type[Config], dict[str, Any]] = {
    FusedScenesConfig: {'relatives': True, 'reshape_low': 0.4, 'reshape_high': 1.5},
    FitConfig: {'trees': 60}}


# What changes where training scenes contain things of no category.
WITH_STRANGERS: dict[type[Config], dict[str, Any]] = {FusedScenesConfig: {'strangers': 5}}


class TrainedCategory(Protocol):
    """What training reads of a category, as io.scenes.scene.Category has it."""

    @property
    def name(self) -> str:
        """Return the name of the class."""
        ...

    @property
    def mesh_path(self) -> Path:
        """Return the file of the generic mesh."""
        ...

    @property
    def scale(self) -> float | None:
        """Return the factor from units of the meshes to metres, None = as they document it."""
        ...

    @property
    def up(self) -> str | None:
        """Return the axis of the meshes that points up, None = as they document it."""
        ...

    @property
    def variant_paths(self) -> Sequence[Path]:
        """Return the files of its further meshes."""
        ...


class TrainingSet(Protocol):
    """What training reads of a set, as io.scenes.scene_set.SceneSet has it; never its scenes."""

    @property
    def name(self) -> str:
        """Return the name of the set."""
        ...

    @property
    def path(self) -> Path:
        """Return the folder of the set."""
        ...

    @property
    def categories(self) -> Sequence[TrainedCategory]:
        """Return the categories in class order."""
        ...

    @property
    def cameras(self) -> Sequence[Camera]:
        """Return the cameras of the rig."""
        ...

    @property
    def max_instances(self) -> int:
        """Return the most objects of one category per scene, 0 = no limit."""
        ...


def train(scene_set: TrainingSet, out: str | Path, profile: str = 'best', seed: int = 0,
          progress: bool = True, configs: Sequence[Config] | None = None,
          jobs: int = 0) -> ModelFolder:
    """
    Train a model from a set's generic meshes and cameras, and write it as a MODEL folder.

    :param scene_set: its scenes are never read.
    :param out: folder to write.
    :param configs: Config objects instead of the profile's own, for tests and experiments.
    :param jobs: parallel workers, 0 = all cores; the result does not depend on it.
    :raises HoocError: no categories, no cameras, an unknown profile, or an unreadable mesh.
    """
    if profile not in PROFILES:
        raise HoocError(f'there is no profile {profile!r}; choose one of {", ".join(PROFILES)}')
    if not scene_set.categories:
        raise HoocError(f'{scene_set.path} lists no categories; name at least one in dataset.yaml')
    if not scene_set.cameras:
        raise HoocError(f"{scene_set.path} names no cameras; training needs the cameras' layout")
    check_place(out, [category.name for category in scene_set.categories])
    models = generic_models(scene_set, seed, progress)
    classifier = train_classifier(models, scene_set.cameras, profile, seed,
                                  scene_set.max_instances, configs, jobs, progress)
    return save_model_folder(Path(out), scene_set.name, models, classifier, profile, seed,
                             scene_set.cameras, scene_set.max_instances)


def configs_of(profile: str, relatives: bool = False,
               strangers: bool = False) -> tuple[Config, ...]:
    """
    Return the Config objects by which a profile is trained.

    :param relatives: whether objects are also made from the built-in catalogue's families.
    :param strangers: whether scenes contain things of no category.
    :raises HoocError: where the profile knows neither.
    """
    configs = PROFILES[profile]
    for wanted, option, changes in ((relatives, '--relatives', WITH_RELATIVES),
                                    (strangers, '--strangers', WITH_STRANGERS)):
        if wanted and not any(isinstance(c, FusedScenesConfig) for c in configs):
            raise HoocError(f'profile {profile} is trained on the generic meshes alone; leave '
                            f'out {option} or choose another profile')
        if wanted:
            configs = tuple(c.changed(changes.get(type(c), {})) for c in configs)
    return configs


def generic_models(scene_set: TrainingSet, seed: int,
                   progress: bool = False) -> tuple[GenericModel, ...]:
    """Return the generic models of a set's categories with their variants, in class order."""
    models = []
    for index, category in enumerate(tqdm(scene_set.categories, desc='generic models',
                                          unit='model', disable=not progress)):
        first, *variants = (
            derive(category.name, load_mesh(path, category.scale, category.up),
                   stage_rng(seed, 'derive', index, member))
            for member, path in enumerate((category.mesh_path, *category.variant_paths)))
        models.append(replace(first, variants=tuple(variants)))
    return tuple(models)


def train_classifier(models: Sequence[GenericModel], cameras: Sequence[Camera],
                     profile: str = 'best', seed: int = 0, max_instances: int = 0,
                     configs: Sequence[Config] | None = None, jobs: int = 0,
                     progress: bool = False) -> Arrays:
    """Return the classifier's dict of arrays, from a step for each of the configs."""
    configs = tuple(configs or PROFILES[profile])
    jobs = jobs or joblib.cpu_count()
    wide = any(isinstance(c, FusedScenesConfig) and c.relatives for c in configs)
    context = TrainingContext(tuple(models),
                              relatives_of(models, seed, jobs, TRAINING if wide else None),
                              tuple(cameras), max_instances, profile, seed, configs, jobs,
                              progress, {})
    for config in configs:
        if type(config) in STEPS:
            context.classifier.update(STEPS[type(config)](context, config))
    return dict(context.classifier)


def _head(context: TrainingContext, kind: int,
          held_out: dict[str, float | None]) -> Arrays:
    """Return the arrays that describe a classifier and how it was trained."""
    settings = {**{type(c).__name__: asdict(c) for c in context.configs},
                'profile': context.profile, 'seed': context.seed, **held_out}
    return {'kind': np.uint8(kind), 'version': np.uint8(FORMAT_VERSION),
            'classes': np.uint8(len(context.models)),
            'settings': np.array(json.dumps(settings, sort_keys=True))}


def _paper(context: TrainingContext, config: fit_pixels.PixelFitConfig) -> Arrays:
    """Learn one multi-view forest per view (Basevi & Leonardis 2016, section 4)."""
    n_classes = len(context.models) + 1

    def pool(stage: str, n: int, pixels: int) -> fit_pixels.PixelPool:
        scenes = training_scenes(context.models, context.cameras, PAPER, context.seed, n,
                                 stage=stage, jobs=context.jobs)
        with context.bar(n, f'scenes for {stage}', 'scene') as bar:
            return fit_pixels.pool(_counted(scenes, bar), n, pixels, config, context.seed, stage)

    structure = pool('structure', config.structure_scenes, config.structure_pixels)
    leaves = pool('leaves', config.leaf_scenes, config.leaf_pixels)
    arrays: Arrays = {'views': np.uint8(len(context.cameras))}
    with context.bar(config.trees * len(context.cameras), 'trees', 'tree') as bar:
        for view in range(len(context.cameras)):
            forest = fit_pixels.fit_view(structure, leaves, view, n_classes, config,
                                         context.seed, context.jobs, bar.update)
            arrays.update(forest.arrays(f'view{view}_'))
    return {**_head(context, KIND_PAPER, {}), **arrays}


def _fused(context: TrainingContext, scenes: FusedScenesConfig) -> Arrays:
    """Learn one forest over fused features, and its accuracy on scenes that are held out."""
    forest_config = next(c for c in context.configs if isinstance(c, FitConfig))
    with context.bar(scenes.scenes, 'synthetic scenes', 'scene') as bar:
        table = fused_table(context, scenes, bar.update)
    kept = table.scene < scenes.scenes - max(1, scenes.scenes // 25)
    with context.bar(forest_config.trees, 'trees', 'tree') as bar:
        forest = fit(np.ascontiguousarray(table.binned[:, kept]), table.y[kept],
                     len(context.models) + 1, table.cuts, forest_config,
                     stage_rng(context.seed, 'fused forest'), context.jobs, bar.update,
                     table.fold[kept])
    held_out = {'held_out_accuracy': _accuracy(forest, table, ~kept)}
    arrays = {**_head(context, KIND_FUSED, held_out), 'probes': table.probes,
              **forest.arrays('forest_'), **network_of(scenes)}
    # The background class stands for things of no category as well.
    return {**arrays, 'strangers': np.uint8(1)} if scenes.strangers else arrays


def _accuracy(forest: Forest, table: FusedTable, rows: BoolArray) -> float | None:
    """
    Return the share of held-out object pixels whose class is the most likely one.

    Each fold of shapes is judged by the trees that have not seen it.
    """
    rows &= table.y > 0
    if not rows.any():
        return None
    # Any value strictly inside of a bin takes the same branches as the original did.
    edges = np.concatenate([table.cuts, np.full((len(table.cuts), 1), np.inf, np.float32)], 1)
    right = 0
    for fold in np.unique(table.fold[rows]):
        mine = rows & (table.fold == fold)
        judges = forest if fold < 0 else Forest.from_arrays(unaware_of(forest.arrays(), fold, ''))
        x = np.take_along_axis(edges, table.binned[:, mine].astype(np.int64), axis=1).T
        right += int((judges.predict(x).argmax(1) == table.y[mine]).sum())
    return round(right / int(rows.sum()), 4)


def _counted(items: Iterable[T], bar: tqdm) -> Iterator[T]:
    """Yield the items and advance a progress bar."""
    for item in items:
        yield item
        bar.update(1)


# What is learned, by the type of the Config that describes it; in the order of the configs.
STEPS: dict[type[Config], Callable[[TrainingContext, Any], Arrays]] = {
    fit_pixels.PixelFitConfig: _paper, FusedScenesConfig: _fused,
    VerifierConfig: fit_verifier}
