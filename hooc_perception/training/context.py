# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What a training step may read."""

from dataclasses import dataclass
from typing import Any, TypeAlias

from hooc_perception.core.config import Config
from hooc_perception.core.types import Camera, GenericModel
from hooc_perception.synthesis.population import Population
from tqdm import tqdm

# Arrays and numpy scalars by name, as a MODEL folder stores them.
Arrays: TypeAlias = dict[str, Any]


@dataclass(frozen=True)
class TrainingContext:
    """
    What a training step may read.

    :ivar models: tuple of GenericModel; class id c is models[c - 1].
    :ivar population: relatives of the models, () = none.
    :ivar cameras: tuple of Camera of the set; `max_instances` as in SceneSet.
    :ivar configs: the Config objects of the profile; `jobs` worker processes or threads.
    :ivar classifier: arrays of the earlier steps.
    """

    models: tuple[GenericModel, ...]
    population: Population
    cameras: tuple[Camera, ...]
    max_instances: int
    profile: str
    seed: int
    configs: tuple[Config, ...]
    jobs: int
    progress: bool
    classifier: Arrays

    def bar(self, total: int, what: str, unit: str) -> tqdm:
        """Return a progress bar; call its `update(n)`."""
        return tqdm(total=total, desc=what, unit=unit, disable=not self.progress)
