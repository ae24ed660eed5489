# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One frame set as proposing and parsing see it: what both derive from it, derived once."""

from dataclasses import dataclass
from functools import cached_property

from hooc_perception.core.arrays import Int32Array
from hooc_perception.core.frame.evidence import Evidence
from hooc_perception.core.frame.field import build_field, Cloud, Field, fuse_cloud
from hooc_perception.core.frame.patches import smooth_patches
from hooc_perception.core.shapes import Shapes
from hooc_perception.core.types import GenericModel, Observation, PixelProbabilities


@dataclass(frozen=True, eq=False)
class Frame:
    """
    An observation with its class probabilities, and what is derived from them on demand.

    Stages 3 and 4 take it instead of the single parts. It holds tens of megabytes once all is
    derived: drop it with the answer.

    :ivar observation: Observation of all views.
    :ivar probabilities: PixelProbabilities of the same views.
    :ivar models: generic models; class id c is models[c - 1].
    :ivar unknown_weight: PixelCosts.unknown_weight.
    """

    observation: Observation
    probabilities: PixelProbabilities
    models: tuple[GenericModel, ...]
    unknown_weight: float = 0.0

    @cached_property
    def cloud(self) -> Cloud:
        """Return the foreground of all views as one thinned cloud."""
        return fuse_cloud(self.observation, self.probabilities)

    @cached_property
    def patch(self) -> Int32Array:
        """Return (n,) int32, the smooth patch that each point of the cloud belongs to."""
        return smooth_patches(self.cloud)

    @cached_property
    def field(self) -> Field | None:
        """Return the voxel field around the cloud, None where nothing stands on the table."""
        return build_field(self.observation, self.cloud) if len(self.patch) else None

    @cached_property
    def evidence(self) -> Evidence:
        """Return the stacked pixels of all views."""
        return self._evidence(1)

    @cached_property
    def coarse(self) -> Evidence:
        """Return every second row and column of all views."""
        return self._evidence(2)

    @cached_property
    def coarsest(self) -> Evidence:
        """Return every fourth row and column of all views."""
        return self._evidence(4)

    @cached_property
    def shapes(self) -> Shapes:
        """Return all meshes of the models' families."""
        return Shapes(self.models)

    def _evidence(self, stride: int) -> Evidence:
        return Evidence(self.observation, self.probabilities, self.shapes, self.cloud,
                        self.patch, stride, self.unknown_weight)
