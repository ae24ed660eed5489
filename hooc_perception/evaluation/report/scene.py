# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the report shows of a scene, gathered from results, views and, if there is any, truth."""

from dataclasses import dataclass, field

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Observation, PixelProbabilities, RectifiedView
from hooc_perception.evaluation.matching import posed, PosedObject
from hooc_perception.evaluation.scores import score_objects

# A rejected candidate is told from a chosen one by its place.
SAME_M = 1e-4


@dataclass(frozen=True)
class ReportScene:
    """
    One scene of the report; everything but the first four is optional.

    :ivar observation: the views against the empty table.
    :ivar objects: tuple of PosedObject, the estimate.
    :ivar models: {category: GenericModel} of at least the categories that are shown.
    :ivar truth: tuple of PosedObject, None where nobody annotated.
    :ivar evidence: one dict an object: visible_ratio, residual_m, energy_delta, n_views.
    :ivar energy: {total, depth, probability, overlap}.
    :ivar seconds: wall time; `stage_seconds` that of each stage.
    :ivar probabilities: the classifier's, for the picture of the most likely classes.
    :ivar class_names: names of the class ids 1..N, needed with probabilities.
    :ivar pool: tuple of PosedObject, every candidate that was considered.
    :ivar converged: False where a deadline ended the search.
    """

    name: str
    observation: Observation
    objects: tuple
    models: dict
    truth: tuple | None = None
    evidence: tuple = ()
    energy: dict | None = None
    seconds: float | None = None
    stage_seconds: dict = field(default_factory=dict)
    probabilities: PixelProbabilities | None = None
    class_names: tuple = ()
    pool: tuple = ()
    converged: bool = True

    @property
    def scores(self):
        """Return [ObjectScore] in the order of the truth, None without truth."""
        if self.truth is None:
            return None
        return score_objects(self.objects, self.truth, self.models)

    @property
    def rejected(self):
        """Return the candidates that were not chosen, best score first within each category."""
        out = []
        for candidate in self.pool:
            if not any(candidate.category == o.category
                       and max(abs(candidate.translation - o.translation)) < SAME_M
                       for o in self.objects):
                out.append(candidate)
        return sorted(out, key=lambda c: (c.category, -c.score))


def candidate_objects(candidates, names):
    """Return Candidates as a tuple of PosedObject; `names` are those of class ids 1..N."""
    return tuple(PosedObject(names[int(c) - 1], candidates.translation[i],
                             candidates.rotation_xyzw[i], candidates.size[i].astype(float),
                             float(candidates.score[i]))
                 for i, c in enumerate(candidates.category))


def report_scene(entry, views, models, truth=None, probabilities=None, pool=None,
                 config=ObserveConfig()):
    """
    Return the ReportScene of one scene of a results file.

    :param entry: its dict, as in `hooc-results/1` (`scenes.results.scene_result`).
    :param views: sequence of DepthView (raw) or RectifiedView, of a scene set or a bag.
    :param models: sequence of GenericModel in the order of the class ids, or a mapping by name.
    :param truth: sequence of TrueObject, PosedObject or dicts with the same keys, or None.
    :param probabilities: PixelProbabilities of the scene's classifier, or None.
    :param pool: Candidates that were considered (ParsedScene.pool), or None; its class ids
        count through `models`.
    :param config: ObserveConfig of the profile that parsed the scene.
    """
    named = models if isinstance(models, dict) else {model.name: model for model in models}
    names = tuple(named)
    rectified = [view if isinstance(view, RectifiedView) else rectify(view, config)
                 for view in views]
    objects = tuple(posed(o) for o in entry['objects'])
    keys = ('visible_ratio', 'residual_m', 'energy_delta', 'n_views')
    return ReportScene(
        str(entry['scene']), observe(rectified, config), objects, named,
        None if truth is None else tuple(posed(t) for t in truth),
        tuple({k: o.get(k) for k in keys} for o in entry['objects']),
        entry.get('energy'), entry.get('seconds'), entry.get('stage_seconds') or {},
        probabilities, names, () if pool is None else candidate_objects(pool, names),
        bool(entry.get('converged', True)))
