# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Run the chain again on scenes with truth, to see inside: classifier, pool and parsing."""

from itertools import repeat

from hooc_perception.core.classification.classify import classify
from hooc_perception.core.energy.eq1 import energy_of
from hooc_perception.core.pipeline import Pipeline
from hooc_perception.core.profiles import profile as named_profile
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.evaluation.matching import posed
from hooc_perception.evaluation.scores import score_scene
from hooc_perception.evaluation.stages import as_candidates, as_objects, pixel_scores, pool_recall
from tqdm import tqdm


class Rerun:
    """
    A model folder with its profile, ready to look at scenes stage by stage.

    :param folder: ModelFolder (`models.folder.load_model_folder`).
    :param profile: name of another profile than the one that it was trained for.
    """

    def __init__(self, folder, profile=None, seed=None):
        self.folder = folder
        self.models = self.folder.models
        self.profile = named_profile(profile or self.folder.profile)
        self.pipeline = Pipeline(self.models, self.folder.classifier, self.profile,
                                 self.folder.seed if seed is None else seed,
                                 self.folder.max_instances)

    def look(self, views):
        """Return (Observation, PixelProbabilities) of DepthViews."""
        observation = observe([rectify(view, self.profile.observe) for view in views],
                              self.profile.observe)
        return observation, classify(observation, self.folder.classifier, self.profile.classify)

    def for_report(self, views, candidates=False):
        """Return what `report_scene` takes beside the results: probabilities, pool, config."""
        out = {'probabilities': self.look(views)[1], 'config': self.profile.observe}
        if candidates:
            out['pool'] = self.pipeline.parse_scene(views).pool
        return out


def rerun(scene_set, folder, stages=False, spread=map):
    """
    Return (truth's energies, what the stages lose) of the annotated scenes of a set.

    :param folder: ModelFolder.
    :param stages: False computes the energies only.
    :param spread: as `map`; may run the calls elsewhere.
    :return: {scene: Energy}, {scene: {pixels, pool, answer}} as `pixel_scores`, StageLoss and
        SceneScore of the new answer.
    """
    again = Rerun(folder)
    annotated = [scene for scene in scene_set.scenes if scene.truth]
    done = spread(_of_scene, repeat(again), (scene.name for scene in annotated),
                  (scene.depth() for scene in annotated), (scene.truth for scene in annotated),
                  repeat(stages))
    energies, losses = {}, {}
    for scene, (energy, loss) in zip(annotated, tqdm(
            done, total=len(annotated), desc='stages' if stages else 'energy of the truth',
            unit='scene', disable=None)):
        energies[scene.name] = energy
        if stages:
            losses[scene.name] = loss
    return energies, losses


def _of_scene(again, name, views, truth, stages):
    """Return (Energy of the truth, what the stages lose of one scene or None)."""
    known = {m.name: m for m in again.models}
    truths = [t for t in map(posed, truth) if t.category in known]
    observation, probabilities = again.look(views)
    energy = energy_of(observation, probabilities, as_candidates(truths, again.models),
                       again.models)
    if not stages:
        return energy, None
    parsed = again.pipeline.parse_scene(views)
    answer = score_scene(name, as_objects(parsed.objects, again.models), truths, known,
                         sum(parsed.seconds.values()))
    return energy, {
        'pixels': pixel_scores(probabilities, observation, truths, again.models),
        'pool': pool_recall(parsed.pool, truths, again.models, answer), 'answer': answer}
