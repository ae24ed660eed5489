# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What no object explains, computed once for frame sets that show the same."""

from collections.abc import Sequence
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.parsing.unexplained import unexplained_points
from hooc_perception.core.types import Candidates, GenericModel, Observation
import numpy as np


class Leftover:
    """
    The points that the objects of the last answer leave unexplained.

    :param models: generic models; class id c is models[c - 1].
    """

    def __init__(self, models: Sequence[GenericModel]) -> None:
        self._models = models
        # What stood on the table, and what of it the objects left unexplained.
        self._last: tuple[tuple[Any, ...], Float64Array] | None = None

    def of(self, observation: Observation, objects: Candidates) -> Float64Array:
        """
        Return (n, 3) metres in the target frame, the points that no object explains.

        :param observation: as it came, in the table frame.
        :param objects: in the target frame.
        """
        key = observation, objects.translation, objects.rotation_xyzw, objects.size
        if self._last is None or self._last[0][0] is not observation or not all(
                map(np.array_equal, key[1:], self._last[0][1:])):
            self._last = key, unexplained_points(observation.in_target_frame(), objects,
                                                 self._models)
        return self._last[1]
