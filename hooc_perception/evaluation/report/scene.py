# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the report shows of a scene, from results, views and the ground truth if known."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from hooc_perception.core.arrays import Float64Array, Int32Array, UInt8Array
from hooc_perception.core.parsing.unexplained import reasons
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
    UnknownObjects,
)
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.matching import (
    candidate_objects,
    member_of,
    posed,
    PosedObject,
    shape_of,
)
from hooc_perception.evaluation.scores import ObjectScore, score_objects
from hooc_perception.evaluation.stages import as_candidates
import numpy as np

# Rejected candidates are distinguished from chosen ones by their position.
SAME_M = 1e-4
# What the results say of each object beside its pose.
EVIDENCE = ('visible_ratio', 'residual_m', 'energy_delta', 'n_views')

# Stands for the category of things that have none; no category can have this name, see `fields`.
UNKNOWN = '(unknown)'


@dataclass(frozen=True)
class ReportScene:
    """
    One scene of the report; everything but the first four is optional.

    :ivar observation: the views against the empty table.
    :ivar objects: the estimate; things of no category, as UNKNOWN, come last.
    :ivar models: {category: GenericModel} of at least the categories that are shown.
    :ivar truth: None where the scene is not annotated.
    :ivar evidence: one dict per object: visible_ratio, residual_m, energy_delta, n_views.
    :ivar energy: {total, depth, probability, overlap}.
    :ivar seconds: wall time; `stage_seconds` that of each stage.
    :ivar probabilities: the classifier's, for the picture of the most likely classes.
    :ivar class_names: names of the class ids 1..N, needed with probabilities.
    :ivar pool: every candidate that was considered.
    :ivar converged: False where a deadline ended the search.
    :ivar stamp_ns: of the frame set, None where the results do not say.
    :ivar events: what happened before it, dicts as in `objects/events`; None where nobody says.
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
    stamp_ns: int | None = None
    events: tuple[Mapping[str, Any], ...] | None = None

    @property
    def known(self) -> list[PosedObject]:
        """Return the estimated objects without the things of no category."""
        return [o for o in self.objects if o.category != UNKNOWN]

    @property
    def scores(self) -> list[ObjectScore] | None:
        """Return [ObjectScore] in the order of the truth, None without truth."""
        if self.truth is None:
            return None
        # Things of no category come last: the places of the others stay.
        return score_objects(self.known, self.truth, self.models)

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

    def reasons(self, points: Float64Array) -> UInt8Array:
        """Return (n,) uint8, a Reason for each of the points (n, 3) that no object explains."""
        models = list(self.scene.models.values())
        known = as_candidates([replace(o, member=member_of(o, self.scene.models))
                               for o in self.drawn if o.category != UNKNOWN], models)
        boxes = as_candidates([o for o in self.drawn if o.category == UNKNOWN], models)
        return reasons(points, known, UnknownObjects(
            boxes.translation, boxes.rotation_xyzw, boxes.size, boxes.score, ()), models)


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
    # Things of no category are drawn as boxes.
    unknown = [posed(thing | {'category': UNKNOWN}) for thing in entry.get('unknown') or []]
    objects = (*(posed(o) for o in entry['objects']), *unknown)
    if unknown:
        named = {**named, UNKNOWN: box_model()}
    return ReportScene(
        str(entry['scene']), observe(rectified, config), objects, named,
        None if truth is None else tuple(posed(t) for t in truth),
        tuple({k: o.get(k) for k in EVIDENCE} for o in entry['objects']),
        entry.get('energy'), entry.get('seconds'), entry.get('stage_seconds') or {},
        probabilities, names, () if pool is None else tuple(candidate_objects(pool, names)),
        bool(entry.get('converged', True)), entry.get('stamp_ns'),
        None if entry.get('events') is None else tuple(entry['events']))


def box_model() -> GenericModel:
    """Return a cube of one metre as a GenericModel without samples."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                      [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], np.int32)
    none = np.zeros((0, 3), np.float32)
    return GenericModel(UNKNOWN, corners, faces, np.ones(3), none, none, none, 1.0,
                        np.zeros((0, 4)), np.zeros(0), np.array([2, 2, 2], np.int32))
