# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Kinds of cases for the fuzzer: MODEL folders with valid checksums and corrupt contents."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import functools
from pathlib import Path
import shutil
from typing import NamedTuple

from hooc_perception.benchmark.fuzz_bags import small_scene
from hooc_perception.benchmark.mutate import odd_array
from hooc_perception.core.arrays import AnyArray
from hooc_perception.core.classification.classify import classify
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.profiles import profile, with_overrides
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import (
    GenericModel,
    Observation,
    PixelProbabilities,
    RectifiedView,
)
from hooc_perception.errors import HoocError
from hooc_perception.objects.catalogue import CATALOGUE
from hooc_perception.objects.derive import derive
from hooc_perception.trained.folder import load_model_folder, ModelFolder, save_model_folder
import numpy as np

# In the source tree; an installed package has none and skips the cases of classifiers.
BUNDLED = Path(__file__).resolve().parents[2] / 'models' / 'demo'
_FIELDS = ('vertices', 'faces', 'extents', 'surface_points', 'surface_normals',
           'interior_points', 'rest_rotations', 'rest_probability', 'symmetry')
# As little work as possible.
_CHEAP = {'propose.samples': 100, 'propose.pool': 5, 'propose.refine_steps': 5,
          'propose.polish': 2, 'propose.polish_steps': 2, 'propose.per_category': 2,
          'propose.round_samples': 100, 'propose.round_pool': 5, 'parse.rounds': 1,
          'parse.polish_steps': 3, 'parse.patience': 1}


class _Good(NamedTuple):
    """A small synthetic scene with everything that the stages need."""

    classifier: dict[str, AnyArray]
    models: tuple[GenericModel, ...]
    observation: Observation
    probabilities: PixelProbabilities


@functools.lru_cache
def _good() -> _Good:
    """Return the scene."""
    scene, _ = small_scene()
    K = np.array([[150.0, 0, 79.5], [0, 150, 59.5], [0, 0, 1]])
    camera = replace(scene.cameras[0], width=160, height=120, K=K)
    depth = np.ones((120, 160), np.float32)
    depth[50:70, 60:100] = 0.92
    observation = observe([RectifiedView(camera, depth)])
    models = tuple(derive(name, CATALOGUE[name](), stage_rng(0, 'fuzz/model', i))
                   for i, name in enumerate(list(CATALOGUE)[:2]))
    rows, columns = np.nonzero(observation.views[0].foreground)
    p = np.full((len(rows), 3), 85, np.uint8)
    probabilities = PixelProbabilities(np.zeros(len(rows), np.uint8),
                                       np.stack([columns, rows], -1).astype(np.uint16), p)
    classifier = dict(load_model_folder(BUNDLED).classifier) if BUNDLED.is_dir() else {}
    return _Good(classifier, models, observation, probabilities)


def _saved(folder: Path, models: Sequence[GenericModel],
           classifier: Mapping[str, AnyArray]) -> ModelFolder:
    """Return the MODEL folder with these contents, written and read back."""
    shutil.rmtree(folder / 'model', ignore_errors=True)
    try:
        return save_model_folder(folder / 'model', 'fuzz', models, classifier, 'fast', 0, ())
    except (ValueError, IndexError, TypeError) as error:
        raise HoocError('the folder cannot be written') from error


def _classifier_case(rng: np.random.Generator, folder: Path) -> None:
    """Corrupt one array of a classifier and classify with it."""
    classifier, models, observation, _ = _good()
    names = sorted(name for name in classifier if classifier[name].dtype.kind != 'U')
    name = names[rng.integers(len(names))]
    spoilt = {**classifier, name: odd_array(classifier[name], rng)}
    classify(observation, _saved(folder, models, spoilt).classifier)


def _model_case(rng: np.random.Generator, folder: Path) -> None:
    """Corrupt one array of a generic model, propose and parse with it."""
    _, models, observation, probabilities = _good()
    name = _FIELDS[rng.integers(len(_FIELDS))]
    bad = replace(models[0], **{name: odd_array(getattr(models[0], name), rng)})
    models = _saved(folder, (bad, *models[1:]), {}).models
    chosen = with_overrides(profile('fast'), _CHEAP)
    frame, method = Frame(observation, probabilities, models), chosen.method()
    method.parse(frame, method.propose(frame, 0), 0)


def model_cases() -> dict[str, Callable[[np.random.Generator, Path], None]]:
    """Return {kind: function(rng, folder)}."""
    cases = {'generic models': _model_case}
    if _good().classifier:
        cases['classifiers'] = _classifier_case
    return cases
