# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Score a results file against a scene set: all figures that the tables show."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.rectify import rectified_numbers, rectify
from hooc_perception.core.types import GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.evaluation.bop import bop_score, BopScene, BopScore
from hooc_perception.evaluation.masks import Labels, MaskScore, score_masks
from hooc_perception.evaluation.matching import in_frame_of, posed, PosedObject
from hooc_perception.evaluation.named_masks import summary
from hooc_perception.evaluation.open_world import open_score, OpenScore
from hooc_perception.evaluation.scores import per_category, SceneScore, score_scene
from hooc_perception.evaluation.sequences import Frame, sequence_score, SequenceScore
from hooc_perception.evaluation.shape import shape_errors, ShapeError
from hooc_perception.evaluation.visibility import scene_visibility, Visibility
from hooc_perception.io.scenes.scene_set import RecordedScene, SceneSet
from hooc_perception.objects.mesh import load_mesh
from hooc_perception.objects.repair import closed
from hooc_perception.objects.symmetry import axis_symmetry
import numpy as np
import trimesh

# Scores use the whole image, including readings that the chain ignores as too far away.
RECTIFY = ObserveConfig(max_depth_m=20.0)


@dataclass(frozen=True)
class Evaluation:
    """
    A results file with its scores.

    :ivar label: its name in the tables.
    :ivar setting: 'A', or 'B' where the true poses were among the candidates.
    :ivar scores: of the scenes with poses.
    :ivar masks: of the scenes with labels only.
    :ivar estimates: {scene: objects}.
    :ivar energy: {scene: {total, depth, probability, overlap}} from the results.
    :ivar bop: None where it was not computed.
    :ivar shapes: {scene: errors of size and surface of its localized objects}.
    :ivar open_world: of the scenes whose things of no category are known.
    :ivar sequences: of the sequences all of whose scenes have poses.
    """

    label: str
    setting: str
    scores: tuple[SceneScore, ...]
    masks: tuple[MaskScore, ...]
    estimates: dict[str, list[PosedObject]]
    energy: dict[str, dict[str, float | None]] = field(default_factory=dict)
    bop: BopScore | None = None
    shapes: dict[str, list[ShapeError]] = field(default_factory=dict)
    open_world: tuple[OpenScore, ...] = ()
    sequences: tuple[SequenceScore, ...] = ()

    @property
    def named(self) -> dict[str, Any] | None:
        """Return `named_masks.summary` of the scenes whose labels have categories."""
        return summary([m.named for m in self.masks if m.named])

    def per_category(self, categories: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Return `scores.per_category` of all scenes with poses."""
        return per_category(self.scores, [self.estimates.get(s.name, []) for s in self.scores],
                            categories)


def scoring_models(scene_set: SceneSet, seed: int = 0,
                   trained: Iterable[GenericModel] = ()) -> dict[str, GenericModel]:
    """
    Return {category: GenericModel} of a set's meshes, with shape, extents and symmetry only.

    Samples and resting poses, which scores do not use, are empty: this takes a fraction of the
    time of deriving everything.

    :param trained: the models that the results were found with. Their variants take the place of
        the set's own.
    """
    out, known = {}, {model.name: model.variants for model in trained}
    for category in scene_set.categories:
        paths = category.variant_paths if category.name not in known else ()
        model, *variants = (_scoring_model(category.name, load_mesh(path, category.scale,
                                                                    category.up), seed)
                            for path in (category.mesh_path, *paths))
        out[category.name] = replace(model, variants=known.get(category.name, tuple(variants)))
    return out


def _scoring_model(name: str, mesh: trimesh.Trimesh, seed: int) -> GenericModel:
    """Return a GenericModel without samples and resting poses."""
    none = np.zeros((0, 3), np.float32)
    return GenericModel(
        name, np.ascontiguousarray(mesh.vertices, np.float64),
        np.ascontiguousarray(mesh.faces, np.int32), np.array(mesh.extents, np.float64),
        none, none, none, 0.0, np.zeros((0, 4)), np.zeros(0),
        axis_symmetry(closed(mesh), stage_rng(seed, 'symmetry')))


def table_1(scene_set: SceneSet, models: Mapping[str, GenericModel],
            seed: int = 0) -> dict[str, list[Visibility]]:
    """Return {scene: [Visibility]} of every annotated scene."""
    return {scene.name: scene_visibility([posed(t) for t in scene.truth], models, scene.cameras,
                                         stage_rng(seed, 'visibility'))
            for scene in scene_set.scenes if scene.truth}


def evaluate_results(scene_set: SceneSet, results: Mapping[str, Any],
                     models: Mapping[str, GenericModel], label: str = '',
                     visibility: Mapping[str, list[Visibility]] | None = None) -> Evaluation:
    """
    Return the Evaluation of one results file.

    Scenes that are missing in the results count as empty; results of scenes that are not in the
    set are ignored.

    :param results: content of a results file (`scenes.results.load_results`).
    :param models: {category: GenericModel}, see `scoring_models`.
    :param visibility: {scene: [Visibility]} from `table_1`: also compute BOP's recalls.
    :raises HoocError: where an estimate names a category that the set does not list.
    """
    by_name = {entry['scene']: entry for entry in results['scenes']}
    scores, masks, targets, opens = [], [], [], []
    estimates: dict[str, list[PosedObject]] = {}
    energy: dict[str, dict[str, float | None]] = {}
    shapes: dict[str, list[ShapeError]] = {}
    for scene in scene_set.scenes:
        entry = by_name.get(scene.name)
        here = in_frame_of(scene, entry) if entry else {'objects': []}
        found = [posed(o) for o in here['objects']]
        for unknown in (o.category for o in found if o.category not in models):
            raise HoocError(f'scene {scene.name} of the results contains a {unknown!r}, '
                            f'which {scene_set.path} does not list; evaluate it against its set')
        about = {'seconds': entry['seconds'] if entry else float('nan'), 'missing': not entry}
        estimates[scene.name] = found
        if entry and entry.get('energy'):
            energy[scene.name] = entry['energy']
        if scene.truth is not None:
            truths = [posed(t) for t in scene.truth]
            scores.append(score_scene(scene.name, found, truths, models, **about))
            if scene.strangers is not None:
                opens.append(open_score(
                    scene.name, found, [posed(u) for u in here.get('unknown') or []], truths,
                    [posed(s) for s in scene.strangers], models))
            shapes[scene.name] = shape_errors(scores[-1], found, truths, models)
            if visibility and scene.name in visibility:
                views = [rectify(view, RECTIFY) for view in scene.depth()]
                targets.append(BopScene(scores[-1], found, truths, views,
                                        visibility[scene.name], models))
        elif scene.label_files:
            masks.append(_masks(scene, found, models, about))
    setting = str(results.get('setting', 'A')).upper()
    return Evaluation(label, setting, tuple(scores), tuple(masks), estimates, energy,
                      bop_score(targets) if targets else None, shapes, tuple(opens),
                      _sequences(scene_set, scores, estimates, models))


def _sequences(scene_set: SceneSet, scores: Iterable[SceneScore],
               estimates: Mapping[str, list[PosedObject]],
               models: Mapping[str, GenericModel]) -> tuple[SequenceScore, ...]:
    """Return the SequenceScores of a set; `scores` are of its scenes with poses."""
    by_name = {score.name: score for score in scores}
    return tuple(sequence_score(sequence, [
        Frame(by_name[name], scene_set.scene(name).truth or (), estimates[name])
        for name in sequence.scenes], models)
        for sequence in scene_set.sequences if set(sequence.scenes) <= set(by_name))


def _masks(scene: RecordedScene, found: list[PosedObject], models: Mapping[str, GenericModel],
           about: dict[str, Any]) -> MaskScore:
    """Return the MaskScore of a scene with instance labels."""
    raw = {view.camera.name: view for view in scene.depth()}
    labels = Labels({name: rectified_numbers(image, raw[name].camera)
                     for name, image in (scene.labels() or {}).items()},
                    scene.label_categories, scene.well_seen)
    views = [rectify(view, RECTIFY) for view in raw.values()]
    return score_masks(scene.name, found, models, views, labels, **about)
