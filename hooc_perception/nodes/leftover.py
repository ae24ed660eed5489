# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What no object explains, computed once for frame sets that show the same."""

from collections.abc import Sequence
from typing import Any

from hooc_perception.core.parsing.unexplained import Unexplained, unexplained
from hooc_perception.core.types import Candidates, GenericModel, Observation, UnknownObjects
import numpy as np


class Leftover:
    """
    The points that the objects of the last answer leave unexplained.

    :param models: generic models; class id c is models[c - 1].
    """

    def __init__(self, models: Sequence[GenericModel]) -> None:
        self._models = models
        # What stood on the table, and what of it the objects left unexplained.
        self._last: tuple[tuple[Any, ...], Unexplained] | None = None

    def of(self, observation: Observation, objects: Candidates,
           unknown: UnknownObjects) -> Unexplained:
        """
        Return the points that no object explains, in the target frame.

        :param observation: as it came, in the table frame.
        :param objects, unknown: in the target frame.
        """
        key = (observation, objects.translation, objects.rotation_xyzw, objects.size,
               unknown.translation, unknown.rotation_xyzw, unknown.size)
        if self._last is None or self._last[0][0] is not observation or not all(
                map(np.array_equal, key[1:], self._last[0][1:])):
            self._last = key, unexplained(observation.in_target_frame(), objects, unknown,
                                          self._models)
        return self._last[1]
