# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the report shows of a scene, from results, views and the ground truth if known."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from hooc_perception.core.arrays import Float64Array, Int32Array
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import (
    Candidates,
    DepthView,
    GenericModel,
    Observation,
    PixelProbabilities,
    RectifiedView,
)
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.matching import candidate_objects, posed, PosedObject, shape_of
from hooc_perception.evaluation.scores import ObjectScore, score_objects

# Rejected candidates are distinguished from chosen ones by their position.
SAME_M = 1e-4
# What the results say of each object beside its pose.
EVIDENCE = ('visible_ratio', 'residual_m', 'energy_delta', 'n_views')


@dataclass(frozen=True)
class ReportScene:
    """
    One scene of the report; everything but the first four is optional.

    :ivar observation: the views against the empty table.
    :ivar objects: the estimate.
    :ivar models: {category: GenericModel} of at least the categories that are shown.
    :ivar truth: None where the scene is not annotated.
    :ivar evidence: one dict per object: visible_ratio, residual_m, energy_delta, n_views.
    :ivar energy: {total, depth, probability, overlap}.
    :ivar seconds: wall time; `stage_seconds` that of each stage.
    :ivar probabilities: the classifier's, for the picture of the most likely classes.
    :ivar class_names: names of the class ids 1..N, needed with probabilities.
    :ivar pool: every candidate that was considered.
    :ivar converged: False where a deadline ended the search.
    """

    name: str
    observation: Observation
    objects: tuple[PosedObject, ...]
    models: Mapping[str, GenericModel]
    truth: tuple[PosedObject, ...] | None = None
    evidence: tuple[dict[str, Any], ...] = ()
    energy: Mapping[str, float | None] | None = None
    seconds: float | None = None
    stage_seconds: Mapping[str, float] = field(default_factory=dict)
    probabilities: PixelProbabilities | None = None
    class_names: tuple[str, ...] = ()
    pool: tuple[PosedObject, ...] = ()
    converged: bool = True

    @property
    def scores(self) -> list[ObjectScore] | None:
        """Return [ObjectScore] in the order of the truth, None without truth."""
        if self.truth is None:
            return None
        return score_objects(self.objects, self.truth, self.models)

    @property
    def rejected(self) -> list[PosedObject]:
        """Return the candidates that were not chosen, best score first within each category."""
        out = []
        for candidate in self.pool:
            if not any(candidate.category == o.category
                       and max(abs(candidate.translation - o.translation)) < SAME_M
                       for o in self.objects):
                out.append(candidate)
        return sorted(out, key=lambda c: (c.category, -c.score))


@dataclass(frozen=True)
class ShownScene:
    """
    A scene with the meshes of its objects; categories without a model are only listed.

    :ivar drawn: the estimated objects that have a model; `meshes` (vertices (V, 3) world,
        faces) of each.
    :ivar true: the true objects that have a model, `true_meshes` alike.
    """

    scene: ReportScene
    drawn: list[PosedObject]
    meshes: list[tuple[Float64Array, Int32Array]]
    true: list[PosedObject]
    true_meshes: list[tuple[Float64Array, Int32Array]]

    @staticmethod
    def of(scene: ReportScene) -> 'ShownScene':
        """Return a scene with its meshes."""
        drawn = [o for o in scene.objects if o.category in scene.models]
        true = [o for o in scene.truth or () if o.category in scene.models]
        meshes, true_meshes = ([world_mesh(o, shape_of(o, scene.models)) for o in objects]
                               for objects in (drawn, true))
        return ShownScene(scene, drawn, meshes, true, true_meshes)


def report_scene(entry: Mapping[str, Any], views: Iterable[DepthView | RectifiedView],
                 models: Mapping[str, GenericModel] | Sequence[GenericModel],
                 truth: Iterable[Any] | None = None,
                 probabilities: PixelProbabilities | None = None, pool: Candidates | None = None,
                 config: ObserveConfig = ObserveConfig()) -> ReportScene:
    """
    Return the ReportScene of one scene of a results file.

    :param entry: its dict, as in `hooc-results/1` (`io.scenes.results.scene_result`).
    :param views: of a scene set or a bag.
    :param models: in the order of the class ids, or by name.
    :param truth: TrueObjects, PosedObjects or dicts with the same keys.
    :param probabilities: of the classifier.
    :param pool: the candidates that were considered; their class ids index `models`.
    :param config: of the profile that parsed the scene.
    """
    named = models if isinstance(models, Mapping) else {model.name: model for model in models}
    names = tuple(named)
    rectified = [view if isinstance(view, RectifiedView) else rectify(view, config)
                 for view in views]
    objects = tuple(posed(o) for o in entry['objects'])
    return ReportScene(
        str(entry['scene']), observe(rectified, config), objects, named,
        None if truth is None else tuple(posed(t) for t in truth),
        tuple({k: o.get(k) for k in EVIDENCE} for o in entry['objects']),
        entry.get('energy'), entry.get('seconds'), entry.get('stage_seconds') or {},
        probabilities, names, () if pool is None else tuple(candidate_objects(pool, names)),
        bool(entry.get('converged', True)))
