# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Feature tables for the fused forest: synthetic scenes over random rigs, in parallel."""

from dataclasses import dataclass, replace

from hooc_perception.core.classification import features
from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.segment.observe import observe
from hooc_perception.synthesis.scatter import ScatterConfig
from hooc_perception.synthesis.training_scenes import training_scene, TrainingConfig
from hooc_perception.training.fit_forest import quantise, thresholds
from joblib import delayed, Parallel
import numpy as np

GROUP = 4


@dataclass(frozen=True)
class FusedScenesConfig(Config):
    """How many scenes the fused forest sees, of what kind, and what is kept of each."""

    scenes: int = param(1200, 'Synthetic scenes.', '', 8, 100000)
    random_rigs: float = param(0.3, 'Share of scenes seen by another rig of one to four '
                               'cameras; the others by the given one, moved a little. Some '
                               'keep the forest usable on any rig.', '', 0.0, 1.0)
    reshape_low: float = param(0.5, 'Least departure of the objects of a scene from the generic '
                               'meshes; 1 = as real objects do.', '', 0.0, 3.0)
    reshape_high: float = param(1.8, 'Largest departure; scenes draw uniformly in between.', '',
                                0.0, 3.0)
    translucent: float = param(0.08, 'Share of objects with the depth error of glass.', '', 0.0,
                               1.0)
    objects_low: int = param(8, 'Fewest objects of a scene.', '', 1, 200)
    objects_high: int = param(20, 'Most objects of a scene.', '', 1, 200)
    rows_sqrt: float = param(1.2, 'Pixels kept of a class with n foreground pixels in a scene: '
                             'this times sqrt(n). Large objects would drown the small ones; '
                             'more scenes teach more than more pixels of each.', '', 0.1, 100.0)
    probes: int = param(0, 'Random points of the fused field that a pixel reads beside the rings; '
                        '192 of them cost a third of the time and gained nothing measurable.',
                        '', 0, 5000)
    quantile_scenes: int = param(24, 'First scenes that set the quantisation of the features.',
                                 '', 4, 1000)
    bins: int = param(64, 'Quantisation levels of a feature.', '', 2, 255)


@dataclass
class FusedTable:
    """
    Quantised features of labelled pixels.

    :ivar binned: (F, n) uint8; `cuts` (F, bins - 1) float32; `y` (n,) uint8 classes;
        `scene` (n,) int32; `probes` (P, 5) as in `core.classification.features.draw_probes`.
    """

    binned: np.ndarray
    cuts: np.ndarray
    y: np.ndarray
    scene: np.ndarray
    probes: np.ndarray


def scene_config(config, repeats):
    """Return the TrainingConfig of a FusedScenesConfig, its rig still the given one."""
    return TrainingConfig(
        arrangement='settled', rig='jittered',
        randomise_sensor=True, translucent=config.translucent,
        scatter=ScatterConfig(objects_low=config.objects_low, objects_high=config.objects_high,
                              repeats=repeats, pose='resting'))


def draw_rows(y, rng, rows_sqrt):
    """Return ascending rows: of each class with n entries in y, rows_sqrt * sqrt(n) at most."""
    rows = []
    for c in np.unique(y):
        members = np.flatnonzero(y == c)
        n = min(len(members), int(np.ceil(rows_sqrt * np.sqrt(len(members)))))
        rows.append(rng.choice(members, n, replace=False))
    return np.sort(np.concatenate(rows)) if rows else np.zeros(0, np.int64)


def labelled_features(observation, labels, probes, rng, rows_sqrt):
    """Return (x (n, F) float32, y (n,) uint8) of drawn foreground pixels of one scene."""
    pixels = features.foreground_pixels(observation)
    y = np.concatenate([label[view.foreground & np.isfinite(view.depth)]
                        for view, label in zip(observation.views, labels)])
    if not len(y):
        return np.zeros((0, features.feature_count(len(probes))), np.float32), y
    rows = draw_rows(y, rng, rows_sqrt)
    around = features.surroundings(observation, pixels)
    return features.pixel_features(pixels, around, probes, rows), y[rows]


def _group(models, cameras, config, repeats, seed, start, stop, probes, cuts):
    """Return a list of (x or quantised x, y) of the scenes start .. stop - 1."""
    base, out = scene_config(config, repeats), []
    for k in range(start, stop):
        rng = stage_rng(seed, 'fused scenes', k)
        rig = 'random' if rng.random() < config.random_rigs else 'jittered'
        strength = float(rng.uniform(config.reshape_low, config.reshape_high))
        scene = training_scene(models, cameras, rng,
                               replace(base, rig=rig, reshape_strength=strength))
        x, y = labelled_features(observe(scene.views), scene.labels, probes, rng,
                                 config.rows_sqrt)
        out.append((x if cuts is None else quantise(x, cuts), y))
    return out


def fused_table(models, cameras, config, seed, max_instances=0, n_jobs=1, progress=None):
    """
    Return the FusedTable of synthetic scenes; the same for any `n_jobs`.

    :param max_instances: objects of one category in a scene at most, 0 = no limit.
    :param progress: called with the number of scenes done since the last call.
    """
    probes = features.draw_probes(stage_rng(seed, 'probes'), config.probes)
    repeats = min(max_instances, 4) or 3
    first = min(config.quantile_scenes, config.scenes)
    cuts, parts = None, []
    with Parallel(n_jobs=n_jobs, return_as='generator') as parallel:
        for low, high in ((0, first), (first, config.scenes)):
            tasks = (delayed(_group)(models, cameras, config, repeats, seed, start,
                                     min(start + GROUP, high), probes, cuts)
                     for start in range(low, high, GROUP))
            batch = []
            for group in parallel(tasks):
                batch.extend(group)
                if progress:
                    progress(len(group))
            if cuts is None:
                cuts = thresholds(np.concatenate([x for x, _ in batch]), config.bins,
                                  stage_rng(seed, 'thresholds'))
                batch = [(quantise(x, cuts), y) for x, y in batch]
            parts.extend(batch)
    y = np.concatenate([y for _, y in parts])
    scene = np.repeat(np.arange(len(parts), dtype=np.int32), [len(y) for _, y in parts])
    return FusedTable(np.concatenate([x for x, _ in parts], axis=1), cuts, y, scene, probes)
