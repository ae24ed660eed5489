# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Score a results file against a scene set: everything that the tables are made of."""

from dataclasses import dataclass, field

from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.rectify import rectified_numbers, rectify
from hooc_perception.core.types import GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.evaluation.bop import bop_score
from hooc_perception.evaluation.masks import score_masks
from hooc_perception.evaluation.matching import in_frame_of, posed
from hooc_perception.evaluation.scores import per_category, score_scene
from hooc_perception.evaluation.visibility import scene_visibility
from hooc_perception.objects.mesh import load_mesh
from hooc_perception.objects.repair import closed
from hooc_perception.objects.symmetry import axis_symmetry
import numpy as np

# Scores look at all of an image; what the chain leaves out as too far is its own business.
RECTIFY = ObserveConfig(max_depth_m=20.0)


@dataclass(frozen=True)
class Evaluation:
    """
    A results file with its scores.

    :ivar label: what the tables call it.
    :ivar setting: 'A', or 'B' where the true poses were among the candidates.
    :ivar scores: tuple of SceneScore of the scenes with poses.
    :ivar masks: tuple of MaskScore of the scenes with labels only.
    :ivar estimates: {scene: list of PosedObject}.
    :ivar energy: {scene: {total, depth, probability, overlap}} as the results say.
    :ivar bop: BopScore, or None where it was not asked for.
    """

    label: str
    setting: str
    scores: tuple
    masks: tuple
    estimates: dict
    energy: dict = field(default_factory=dict)
    bop: object = None

    def per_category(self, categories):
        """Return `scores.per_category` of all scenes with poses."""
        return per_category(self.scores, [self.estimates.get(s.name, []) for s in self.scores],
                            categories)


def scoring_models(scene_set, seed=0):
    """
    Return {category: GenericModel} of a set's meshes, with shape, extents and symmetry only.

    The samples and resting poses, which scores do not use, are empty: this takes a fraction of
    the time of deriving all.
    """
    none = np.zeros((0, 3), np.float32)
    out = {}
    for category in scene_set.categories:
        mesh = load_mesh(category.mesh_path, category.scale)
        out[category.name] = GenericModel(
            category.name, np.ascontiguousarray(mesh.vertices, np.float64),
            np.ascontiguousarray(mesh.faces, np.int32), np.array(mesh.extents, np.float64),
            none, none, none, 0.0, np.zeros((0, 4)), np.zeros(0),
            axis_symmetry(closed(mesh), stage_rng(seed, 'symmetry')))
    return out


def table_1(scene_set, models, seed=0):
    """Return {scene: [Visibility]} of every annotated scene."""
    return {scene.name: scene_visibility([posed(t) for t in scene.truth], models, scene.cameras,
                                         stage_rng(seed, 'visibility'))
            for scene in scene_set.scenes if scene.truth}


def evaluate_results(scene_set, results, models, label='', visibility=None):
    """
    Return the Evaluation of one results file.

    Scenes that the results do not hold count as empty answers; results of scenes that the set
    does not hold are left out.

    :param results: content of a results file (`scenes.results.load_results`).
    :param models: {category: GenericModel}, see `scoring_models`.
    :param visibility: {scene: [Visibility]} from `table_1`; given, BOP's recalls are computed.
    :raises HoocError: where an estimate names a category that the set does not list.
    """
    by_name = {entry['scene']: entry for entry in results['scenes']}
    scores, masks, estimates, energy, targets = [], [], {}, {}, []
    for scene in scene_set.scenes:
        entry = by_name.get(scene.name)
        found = ([posed(o) for o in in_frame_of(scene, entry)['objects']] if entry else [])
        for unknown in (o.category for o in found if o.category not in models):
            raise HoocError(f'scene {scene.name} of the results holds a {unknown!r}, which '
                            f'{scene_set.path} does not list; evaluate it against its own set')
        about = {'seconds': entry['seconds'] if entry else float('nan'), 'missing': not entry}
        estimates[scene.name] = found
        if entry and entry.get('energy'):
            energy[scene.name] = entry['energy']
        if scene.truth is not None:
            truths = [posed(t) for t in scene.truth]
            scores.append(score_scene(scene.name, found, truths, models, **about))
            if visibility and scene.name in visibility:
                views = [rectify(view, RECTIFY) for view in scene.depth()]
                targets.append((scores[-1], found, truths, views, visibility[scene.name], models))
        elif scene.label_files:
            masks.append(_masks(scene, found, models, about))
    setting = str(results.get('setting', 'A')).upper()
    return Evaluation(label, setting, tuple(scores), tuple(masks), estimates, energy,
                      bop_score(targets) if targets else None)


def _masks(scene, found, models, about):
    """Return the MaskScore of a scene with instance labels."""
    raw = {view.camera.name: view for view in scene.depth()}
    labels = {name: rectified_numbers(image, raw[name].camera)
              for name, image in scene.labels().items()}
    views = [rectify(view, RECTIFY) for view in raw.values()]
    return score_masks(scene.name, found, models, views, labels, **about)
