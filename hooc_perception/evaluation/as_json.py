# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Every score as plain data, for --json."""

from dataclasses import asdict, is_dataclass
import math

from hooc_perception.evaluation import paper
from hooc_perception.evaluation.paper_tables import TERMS
from hooc_perception.evaluation.scores import means
import numpy as np


def plain(value):
    """Return a value as JSON knows it: NaN and infinity become null, arrays become lists."""
    if is_dataclass(value):
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


def as_json(scene_set, evaluations, visibility, truth_energy, stages):
    """Return the content of the JSON file: results, visibility, energies, stages, paper."""
    results = []
    for e in evaluations:
        entry = {'label': e.label, 'setting': e.setting, 'energy': e.energy}
        if e.scores:
            entry |= {'mean': means(e.scores), 'scenes': [asdict(s) for s in e.scores],
                      'categories': e.per_category(scene_set.category_names)}
        if e.masks:
            entry['masks'] = [asdict(m) for m in e.masks]
        if e.bop:
            entry['bop'] = asdict(e.bop) | {'average': e.bop.average}
        results.append(entry)
    return plain({
        'format': 'hooc-scores/1', 'dataset': scene_set.name, 'results': results,
        'visibility': {name: [asdict(v) for v in rows] for name, rows in visibility.items()},
        'truth_energy': {name: {t: getattr(energy, t) for t in TERMS}
                         for name, energy in truth_energy.items()},
        'stages': stages, 'paper': {'scores': paper.SCORES, 'energy': paper.ENERGY}})
