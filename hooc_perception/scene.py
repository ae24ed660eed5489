# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The result of a parse: the objects on the table, as Python values and as arrays."""

from dataclasses import dataclass, field
from typing import Any

from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array
from hooc_perception.core.geometry import matrix_from_pose, posed_meshes
from hooc_perception.core.incremental.memory import Past
from hooc_perception.core.parsing.unexplained import TOLERANCE_M, Unexplained, unexplained
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, Energy, GenericModel, Observation, ParsedScene
import numpy as np


@dataclass(frozen=True)
class SceneObject:
    """
    One object on the table.

    :ivar category: name of its category.
    :ivar translation: (3,) float64, centre of its bounding box, world frame, metres.
    :ivar rotation_xyzw: (4,) float64 unit quaternion, model axes to world.
    :ivar size: (3,) float32, its extents along the model axes, metres.
    :ivar score: probability that an object of this category stands here, 0 to 1.
    :ivar visible_ratio: share of its pixels that no other object hides.
    :ivar residual_m: mean absolute depth residual where it agrees with the measured depth.
    :ivar energy_delta: how much the energy rises without it.
    :ivar n_views: number of views that show it.
    :ivar sigma_t: metres, and `sigma_r` radians, within which 68 % of the errors lie; NaN where
        that is unknown, as for the rotation of a ball.
    :ivar member: which mesh of its category's family was found, see GenericModel.members; 0 is
        the generic one.
    """

    category: str
    translation: Float64Array
    rotation_xyzw: Float64Array
    size: Float32Array
    score: float
    visible_ratio: float
    residual_m: float
    energy_delta: float
    n_views: int
    sigma_t: float = float('nan')
    sigma_r: float = float('nan')
    member: int = 0

    @property
    def T_world_object(self) -> Float64Array:
        """Return the (4, 4) rigid transform from the model's axes to the world frame."""
        return matrix_from_pose(self.translation, self.rotation_xyzw)


@dataclass(frozen=True)
class UnknownObject:
    """
    Something of no category: an upright box.

    :ivar translation: (3,) float64, centre of the box, world frame, metres.
    :ivar rotation_xyzw: (4,) float64 unit quaternion, box axes to world.
    :ivar size: (3,) float32, sides of the box along its axes, metres.
    :ivar score: how sure the classifier is of something else here, 0 to 1; NaN where the model
        was not trained among things of no category.
    :ivar hull: (k, 3) float64 corners of the convex hull of what was seen of it and its shadow on
        the bottom of the box, world frame, metres.
    """

    translation: Float64Array
    rotation_xyzw: Float64Array
    size: Float32Array
    score: float
    hull: Float64Array


@dataclass(frozen=True)
class Scene:
    """
    All objects that one frame set shows.

    :ivar objects: in no particular order.
    :ivar unknown: things of no category that stand there as well.
    :ivar parsed: the same as arrays, with all candidates that were considered.
    :ivar observation: the rectified views that were parsed, with foreground and background.
    :ivar models: generic models of all categories.
    :ivar past: what `Parser.update` remembers for the next frame set; None = it was `parse`.
    """

    objects: tuple[SceneObject, ...]
    unknown: tuple[UnknownObject, ...]
    parsed: ParsedScene = field(repr=False)
    observation: Observation = field(repr=False)
    models: tuple[GenericModel, ...] = field(repr=False)
    past: Past | None = field(default=None, repr=False)

    @property
    def energy(self) -> Energy:
        """Return the energy of the objects by Eq. 1 of the paper, term by term."""
        return self.parsed.energy

    @property
    def seconds(self) -> dict[str, float]:
        """Return the wall time of each stage."""
        return self.parsed.seconds

    @property
    def converged(self) -> bool:
        """Return False where a deadline ended the search."""
        return self.parsed.converged

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return one sentence per camera that does not see the table where it should be."""
        return self.observation.troubles

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists, as a scene of a results file (docs/scene_sets.md)."""
        from hooc_perception.io.scenes.results import parsed_entry
        entry = parsed_entry(self.parsed, [model.name for model in self.models])
        return {**entry, 'warnings': list(self.warnings)} if self.warnings else entry

    def meshes(self) -> list[tuple[Float64Array, Int32Array]]:
        """Return (vertices (V, 3) world, metres; faces (F, 3)) of each object, in place."""
        return posed_meshes(self.parsed.objects, self.models)

    def depth(self, camera: Camera) -> tuple[Float32Array, Int32Array]:
        """
        Render the objects into a rectified camera, for instance `observation.views[0].camera`.

        :return: depth (H, W) float32 metres, inf where no object is; ids (H, W) int32, index of
            the object seen there, -1 = none.
        """
        return render_depth(self.meshes(), camera)

    def unexplained(self, tolerance_m: float = TOLERANCE_M) -> Float64Array:
        """Return (n, 3) measured points above the table that no object explains, world frame."""
        return self.leftover(tolerance_m).points

    def leftover(self, tolerance_m: float = TOLERANCE_M) -> Unexplained:
        """Return the same with the reason of each point: noise, residue, or an unknown thing."""
        return unexplained(self.observation, self.parsed.objects, self.parsed.unknown,
                           self.models, tolerance_m)


def scene_of(parsed: ParsedScene, observation: Observation, models: tuple[GenericModel, ...],
             ) -> Scene:
    """Return the Scene of a ParsedScene; class id c of its objects is models[c - 1]."""
    found = parsed.objects
    unknown = np.full(len(found), np.nan, np.float32)
    sigma_t = unknown if parsed.sigma_t is None else parsed.sigma_t
    sigma_r = unknown if parsed.sigma_r is None else parsed.sigma_r
    return Scene(tuple(
        SceneObject(models[int(found.category[k]) - 1].name, found.translation[k],
                    found.rotation_xyzw[k], found.size[k], float(found.score[k]),
                    float(parsed.visible_ratio[k]), float(parsed.residual_m[k]),
                    float(parsed.energy_delta[k]), int(parsed.n_views[k]), float(sigma_t[k]),
                    float(sigma_r[k]), int(found.member[k]))
        for k in range(len(found))), tuple(
            UnknownObject(*row) for row in zip(
                parsed.unknown.translation, parsed.unknown.rotation_xyzw, parsed.unknown.size,
                parsed.unknown.score.tolist(), parsed.unknown.hulls)), parsed, observation, models)
