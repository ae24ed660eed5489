# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Run the chain again on scenes with ground truth, stage by stage."""

from collections.abc import Callable, Iterable, Sequence
from itertools import repeat
from typing import Any

from hooc_perception.core.energy.eq1 import energy_of
from hooc_perception.core.types import (
    DepthView,
    Energy,
    Observation,
    ParsedScene,
    PixelProbabilities,
)
from hooc_perception.evaluation.matching import posed
from hooc_perception.evaluation.scores import score_scene
from hooc_perception.evaluation.stages import as_candidates, as_objects, pixel_scores, pool_recall
from hooc_perception.io.scenes.scene import TrueObject
from hooc_perception.io.scenes.scene_set import SceneSet
from hooc_perception.parser import Parser
from hooc_perception.trained.folder import ModelFolder
from tqdm import tqdm


class Rerun:
    """
    A model folder with its profile, which parses scenes stage by stage.

    :param folder: ModelFolder (`trained.folder.load_model_folder`).
    :param profile: name of another profile than the one that it was trained for.
    """

    def __init__(self, folder: ModelFolder, profile: str | None = None,
                 seed: int | None = None) -> None:
        self.parser = Parser.load(folder, profile, sigmas=False)
        self.models = self.parser.models
        self.seed = folder.seed if seed is None else seed

    def look(self, views: Sequence[DepthView]) -> tuple[Observation, PixelProbabilities]:
        """Return stages 1 and 2 of raw depth images."""
        observation = self.parser.observe(views)
        return observation, self.parser.classify(observation)

    def parse(self, views: Sequence[DepthView]) -> ParsedScene:
        """Return the result of all stages."""
        return self.parser.parse(views, self.seed).parsed

    def for_report(self, views: Sequence[DepthView], candidates: bool = False) -> dict[str, Any]:
        """Return what `report_scene` takes beside the results: probabilities, pool, config."""
        out: dict[str, Any] = {'probabilities': self.look(views)[1],
                               'config': self.parser.profile.observe}
        if candidates:
            out['pool'] = self.parse(views).pool
        return out


def rerun(scene_set: SceneSet, folder: ModelFolder, stages: bool = False,
          spread: Callable[..., Iterable[Any]] = map,
          ) -> tuple[dict[str, Energy], dict[str, dict[str, Any]]]:
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


def _of_scene(again: Rerun, name: str, views: Sequence[DepthView], truth: Sequence[TrueObject],
              stages: bool) -> tuple[Energy, dict[str, Any] | None]:
    """Return (Energy of the truth, what the stages lose of one scene or None)."""
    known = {m.name: m for m in again.models}
    truths = [t for t in map(posed, truth) if t.category in known]
    observation, probabilities = again.look(views)
    energy = energy_of(observation, probabilities, as_candidates(truths, again.models),
                       again.models)
    if not stages:
        return energy, None
    parsed = again.parse(views)
    answer = score_scene(name, as_objects(parsed.objects, again.models), truths, known,
                         sum(parsed.seconds.values()))
    return energy, {
        'pixels': pixel_scores(probabilities, observation, truths, again.models),
        'pool': pool_recall(parsed.pool, truths, again.models, answer), 'answer': answer}
