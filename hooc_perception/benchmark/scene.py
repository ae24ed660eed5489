# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The scene of all contests: like a HOOC scene of 20 objects, from our own catalogue."""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import AnyArray, BoolArray, Float64Array, Int32Array
from hooc_perception.core.geometry import posed_meshes, stage_rng
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import (
    Camera,
    Candidates,
    GenericModel,
    Observation,
    PixelProbabilities,
    RectifiedView,
)
from hooc_perception.objects.catalogue import CATALOGUE
from hooc_perception.objects.derive import derive
from hooc_perception.synthesis.rigs import ring
from hooc_perception.synthesis.scatter import PlacedObject, ScatterConfig
from hooc_perception.synthesis.training_scenes import training_scene, TrainingConfig
import numpy as np
from scipy.spatial.transform import Rotation

CANDIDATES_PER_CATEGORY = 5


@dataclass(frozen=True)
class BenchScene:
    """
    A scene with the inputs of all stages.

    :ivar cameras: three rectified Cameras of a Kinect v2's size.
    :ivar meshes: (vertices (V, 3) world metres, faces (F, 3) int32) of the objects.
    :ivar pool: five candidates per category; one of each true object is its true pose.
    :ivar truth: (n,) bool, which of the pool that is.
    """

    models: tuple[GenericModel, ...]
    cameras: Sequence[Camera]
    meshes: list[tuple[Float64Array, Int32Array]]
    views: Sequence[RectifiedView]
    observation: Observation
    probabilities: PixelProbabilities
    pool: Candidates
    truth: BoolArray


def bench_scene(seed: int = 0, n_objects: int = 20) -> BenchScene:
    """Return the BenchScene of a seed; deterministic."""
    models = tuple(derive(name, build(), stage_rng(seed, 'bench/model', i))
                   for i, (name, build) in enumerate(CATALOGUE.items()))
    cameras = ring(stage_rng(seed, 'bench/rig'), 3)
    config = TrainingConfig(scatter=ScatterConfig(objects_low=n_objects, objects_high=n_objects))
    scene = training_scene(models, cameras, stage_rng(seed, 'bench/scene'), config)
    observation = observe(scene.views)
    rng = stage_rng(seed, 'bench/pool')
    pool, truth = _pool(scene.objects, models, rng)
    return BenchScene(models, cameras, [(o.vertices_world, o.faces) for o in scene.objects],
                      scene.views, observation,
                      _probabilities(observation, scene.labels, len(models), rng), pool, truth)


def candidate_meshes(scene: BenchScene) -> list[tuple[Float64Array, Int32Array]]:
    """Return [(vertices world, faces)] of the pool of a BenchScene."""
    return posed_meshes(scene.pool, scene.models)


def _pool(objects: Sequence[PlacedObject], models: Sequence[GenericModel],
          rng: np.random.Generator) -> tuple[Candidates, BoolArray]:
    """Return (Candidates, truth): true poses, and others nearby that compete with them."""
    true = {o.category: o for o in objects}
    rows, truth = [], []
    for category, model in enumerate(models, 1):
        for i in range(CANDIDATES_PER_CATEGORY):
            is_true = i == 0 and category in true
            near = true[category] if is_true else objects[int(rng.integers(len(objects)))]
            spread = 0.0 if is_true else 0.03
            turn = Rotation.from_rotvec([0, 0, 0 if is_true else rng.uniform(-np.pi, np.pi)])
            rows.append((category, near.translation + rng.normal(0, 1, 3) * [spread, spread, 0],
                         (turn * Rotation.from_quat(near.rotation_xyzw)).as_quat(),
                         near.size if is_true else model.extents))
            truth.append(is_true)
    category, translation, rotation, size = zip(*rows)
    return Candidates(np.array(category, np.uint16), np.array(translation), np.array(rotation),
                      np.array(size, np.float32), np.ones(len(rows), np.float32)), np.array(truth)


def _probabilities(observation: Observation, labels: Sequence[AnyArray], n_classes: int,
                   rng: np.random.Generator) -> PixelProbabilities:
    """Return PixelProbabilities of a mediocre classifier: 0.4 on the truth, the rest spread."""
    cameras, uv, p = [], [], []
    for i, (view, classes) in enumerate(zip(observation.views, labels)):
        v, u = np.nonzero(view.foreground)
        row = 0.6 * rng.dirichlet(np.full(n_classes + 1, 0.3), len(v))
        row[np.arange(len(v)), classes[v, u]] += 0.4
        cameras.append(np.full(len(v), i, np.uint8))
        uv.append(np.column_stack([u, v]).astype(np.uint16))
        p.append(np.floor(255 * row).astype(np.uint8))
    return PixelProbabilities(np.concatenate(cameras), np.concatenate(uv), np.concatenate(p))
