# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scores and stage losses as plain data, for --json."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
import math
from typing import Any

from hooc_perception.core.types import Energy
from hooc_perception.evaluation import open_world, paper, sequences
from hooc_perception.evaluation.certainty import certainty_summary
from hooc_perception.evaluation.evaluate import Evaluation
from hooc_perception.evaluation.paper_tables import TERMS
from hooc_perception.evaluation.scores import means
from hooc_perception.evaluation.shape import shape_summary
from hooc_perception.evaluation.visibility import Visibility
from hooc_perception.io.scenes.scene_set import SceneSet
import numpy as np


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: NaN and infinity become null, arrays become lists."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def as_json(scene_set: SceneSet, evaluations: Sequence[Evaluation],
            visibility: Mapping[str, Sequence[Visibility]],
            truth_energy: Mapping[str, Energy]) -> dict[str, Any]:
    """Return the content of the scores file: results, visibility, energies, the paper."""
    results = []
    for e in evaluations:
        entry: dict[str, Any] = {'label': e.label, 'setting': e.setting, 'energy': e.energy}
        if e.scores:
            entry |= {'mean': means(e.scores), 'scenes': [asdict(s) for s in e.scores],
                      'categories': e.per_category(scene_set.category_names),
                      'certainty': certainty_summary(e), 'shape': _shape(e)}
        if e.open_world:
            entry['open_world'] = open_world.summary(e.open_world)
        if e.sequences:
            entry['sequences'] = sequences.summary(e.sequences)
        if e.masks:
            entry['masks'] = [asdict(m) for m in e.masks]
        if e.named:
            entry['named'] = e.named
        if e.bop:
            entry['bop'] = asdict(e.bop) | {'average': e.bop.average}
        results.append(entry)
    return plain({
        'format': 'hooc-scores/1', 'dataset': scene_set.name, 'results': results,
        'visibility': {name: [asdict(v) for v in rows] for name, rows in visibility.items()},
        'truth_energy': {name: {t: getattr(energy, t) for t in TERMS}
                         for name, energy in truth_energy.items()},
        'paper': {'scores': paper.SCORES, 'energy': paper.ENERGY}})


def _shape(evaluation: Evaluation) -> dict[str, Any]:
    """Return the errors of size and surface: their means, and every object of every scene."""
    every = [error for errors in evaluation.shapes.values() for error in errors]
    return shape_summary(every) | {
        'scenes': {name: [asdict(e) for e in errors] for name, errors in
                   evaluation.shapes.items()}}


def stages_as_json(scene_set: SceneSet, losses: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of the stages file, from what `rerun` says that the stages lose."""
    return plain({'format': 'hooc-stages/1', 'dataset': scene_set.name, 'stages': losses})
