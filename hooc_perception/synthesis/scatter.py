# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The paper's training scenes: some of the generic models, upright, close but not overlapping.

Section 4 of Basevi & Leonardis 2016: random subsets of the models at random places without
physical overlap. The paper does not say how close; here they are as dense as on its table.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
import zlib

import fcl
from hooc_perception.core.arrays import AnyArray, Float64Array, Int32Array
from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import posed_vertices
from hooc_perception.core.types import GenericModel
from hooc_perception.errors import HoocError
import numba as nb
import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class ScatterConfig(Config):
    """How many objects a scattered scene has and how close they are."""

    objects_low: int = param(5, 'Fewest objects in a scene.', '', 0, 200)
    objects_high: int = param(20, 'Most objects in a scene.', '', 1, 200)
    repeats: int = param(1, 'Most objects of one category in a scene.', '', 1, 50)
    pose: str = param('upright', 'Model z axis up (upright) or a stable resting pose of the '
                      'model (resting); the yaw is free in both.',
                      choices=('upright', 'resting'))
    size_spread: float = param(0.0, "Standard deviation of the logarithm of an object's size "
                               "over its model's; 0 = the model's own.", '', 0.0, 0.5)
    crowding: float = param(0.90, 'Share of the occupied disc that footprints would cover; '
                            'large = close together.', '', 0.02, 1.5)
    tries: int = param(40, 'Places tried for an object before it is skipped.', '', 1, 1000)


@dataclass(frozen=True)
class PlacedObject:
    """
    One object of a synthetic scene.

    :ivar category: class id 1..N, of models[category - 1].
    :ivar translation: (3,) float64 centre of the bounding box along the model axes, world.
    :ivar rotation_xyzw: (4,) float64, model axes to world.
    :ivar size: (3,) float64 true extents along the model axes, metres.
    :ivar vertices_world: (V, 3) float64 metres; `faces` (F, 3) int32.
    :ivar fold: of the Relative that it was made from (population.py), -1 = the generic model.
    """

    category: int
    translation: Float64Array
    rotation_xyzw: Float64Array
    size: Float64Array
    vertices_world: Float64Array
    faces: Int32Array
    fold: int = -1


def models_key(models: Sequence[GenericModel]) -> tuple[tuple[str, int, int], ...]:
    """Return a hashable key of the names and meshes of models."""
    return tuple((m.name, zlib.crc32(np.ascontiguousarray(m.vertices).tobytes()),
                  zlib.crc32(np.ascontiguousarray(m.faces).tobytes())) for m in models)


class Scatterer:
    """
    Draws scattered scenes of the same models; keeps their collision shapes between scenes.

    Sizes have nine steps between -2 and +2 standard deviations, so that collision shapes are
    built once per step and model, not once per scene.
    """

    def __init__(self, models: Sequence[GenericModel],
                 config: ScatterConfig = ScatterConfig()) -> None:
        """Raise HoocError if there are no models or the range of counts is empty."""
        if not models:
            raise HoocError('a training scene needs at least one model, but there are none; '
                            'add categories to the set')
        if config.objects_low > config.objects_high:
            raise HoocError(f'objects_low is {config.objects_low}, above objects_high '
                            f'{config.objects_high}; lower it')
        self.models, self.config = tuple(models), config
        self._shapes: dict[tuple[int, int], Any] = {}

    def _shape(self, index: int, step: int, scale: float) -> Any:
        """Return the cached fcl shape of a model at one size step."""
        key = (index, step)
        if key not in self._shapes:
            model = self.models[index]
            bvh = fcl.BVHModel()
            bvh.beginModel(len(model.vertices), len(model.faces))
            bvh.addSubModel(model.vertices * scale, model.faces)
            bvh.endModel()
            self._shapes[key] = bvh
        return self._shapes[key]

    def scene(self, rng: np.random.Generator) -> list[PlacedObject]:
        """Return objects without overlap, bottoms at z = 0, around (0, 0)."""
        config = self.config
        count = int(rng.integers(config.objects_low, config.objects_high + 1))
        names = np.tile(np.arange(len(self.models)), config.repeats)
        chosen = rng.permutation(names)[:count]
        scales, steps = np.ones(len(chosen)), np.zeros(len(chosen), int)
        if config.size_spread > 0:
            steps = np.clip(np.round(2 * rng.standard_normal(len(chosen))), -4, 4).astype(int)
            scales = np.exp(0.5 * steps * config.size_spread)
        drafts = [self._draft(i, step, scale, rng)
                  for i, step, scale in zip(chosen, steps, scales)]
        # The area of the disc is the sum of the footprints over the share that they cover.
        area = sum(d.footprint for d in drafts)
        radius = np.sqrt(area / (np.pi * config.crowding)) * rng.uniform(0.8, 1.25)
        placed: list[_Draft] = []
        # Large objects first: small ones still find room between them.
        for draft in sorted(drafts, key=lambda d: -d.footprint):
            if self._place(draft, placed, radius, rng):
                placed.append(draft)
        return [draft.placed(self.models) for draft in placed]

    def _draft(self, index: int, step: int, scale: float, rng: np.random.Generator) -> '_Draft':
        """Return an object with a random rotation, not placed yet."""
        model = self.models[index]
        rotation = Rotation.from_euler('z', rng.uniform(-np.pi, np.pi))
        if self.config.pose == 'resting' and len(model.rest_rotations):
            p = np.asarray(model.rest_probability, float) + 1e-3
            row = rng.choice(len(p), p=p / p.sum())
            rotation = rotation * Rotation.from_quat(model.rest_rotations[row])
        return _Draft(int(index), scale, rotation, model, self._shape(index, step, scale))

    def _place(self, draft: '_Draft', placed: Sequence['_Draft'], radius: float,
               rng: np.random.Generator) -> bool:
        """Move the draft to a free place; return whether there is one."""
        for attempt in range(self.config.tries):
            # The disc grows a little with every try, so that nearly every object finds room.
            r = radius * (1 + 0.7 * attempt / self.config.tries) * np.sqrt(rng.random())
            angle = rng.uniform(0, 2 * np.pi)
            draft.move(r * np.cos(angle), r * np.sin(angle))
            if not any(overlapping(draft, other) for other in placed):
                return True
        return False


class _Draft:
    """An object that is being placed: fcl object, oriented mesh, bounding box."""

    def __init__(self, index: int, scale: float, rotation: Rotation, model: GenericModel,
                 bvh: Any) -> None:
        self.index, self.scale, self.rotation = index, scale, rotation
        self.faces = model.faces
        self.turned = (model.vertices * scale) @ rotation.as_matrix().T
        self.low, self.high = self.turned.min(axis=0), self.turned.max(axis=0)
        self.circle = 0.5 * np.linalg.norm((self.high - self.low)[:2])
        self.footprint = ConvexHull(self.turned[:, :2], qhull_options='QJ').volume
        self.size = model.extents * scale
        self.body = fcl.CollisionObject(bvh, fcl.Transform(rotation.as_matrix(), np.zeros(3)))
        self.offset, self.centre = np.zeros(3), np.zeros(2)

    def move(self, x: float, y: float) -> None:
        """Place the object on the table with its bounding box centred at (x, y)."""
        middle = 0.5 * (self.low + self.high)
        self.offset = np.array([x - middle[0], y - middle[1], -self.low[2]])
        self.centre = np.array([x, y])
        self.body.setTransform(fcl.Transform(self.rotation.as_matrix(), self.offset))

    def placed(self, models: Sequence[GenericModel]) -> PlacedObject:
        """Return the finished PlacedObject."""
        model = models[self.index]
        quaternion = self.rotation.as_quat(canonical=True)
        return PlacedObject(self.index + 1, self.offset.copy(), quaternion, self.size,
                            posed_vertices(model, self.offset, quaternion, self.size),
                            model.faces)


def overlapping(a: _Draft, b: _Draft) -> bool:
    """Return whether two drafts overlap: circles, boxes, surfaces, then containment."""
    if np.hypot(*(a.centre - b.centre)) > a.circle + b.circle:
        return False
    low_a, high_a = a.low + a.offset, a.high + a.offset
    low_b, high_b = b.low + b.offset, b.high + b.offset
    if np.any(low_a > high_b) or np.any(low_b > high_a):
        return False
    if fcl.collide(a.body, b.body, fcl.CollisionRequest(), fcl.CollisionResult()):
        return True
    # fcl only tests surfaces and misses a solid that is completely inside another.
    return (inside(b.turned[0] + b.offset, a.turned + a.offset, a.faces)
            or inside(a.turned[0] + a.offset, b.turned + b.offset, b.faces))


@nb.njit(cache=True)
def inside(point: Float64Array, vertices: Float64Array, faces: AnyArray) -> bool:
    """
    Return whether a point (3,) lies inside a mesh: two of three rays cross it an odd number.

    The majority of three directions tolerates a hole in a mesh that is not watertight.
    """
    directions = ((0.021, 0.013, 1.0), (0.8, 0.31, 0.47), (-0.45, 0.83, 0.29))
    votes = 0
    for d0, d1, d2 in directions:
        crossings = 0
        for f in range(faces.shape[0]):
            a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
            e10, e11, e12 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            e20, e21, e22 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
            # Moeller & Trumbore 1997.
            p0, p1, p2 = d1 * e22 - d2 * e21, d2 * e20 - d0 * e22, d0 * e21 - d1 * e20
            det = e10 * p0 + e11 * p1 + e12 * p2
            if abs(det) < 1e-18:
                continue
            s0, s1, s2 = point[0] - a[0], point[1] - a[1], point[2] - a[2]
            u = (s0 * p0 + s1 * p1 + s2 * p2) / det
            if u < 0.0 or u > 1.0:
                continue
            q0, q1, q2 = s1 * e12 - s2 * e11, s2 * e10 - s0 * e12, s0 * e11 - s1 * e10
            v = (d0 * q0 + d1 * q1 + d2 * q2) / det
            if v < 0.0 or u + v > 1.0:
                continue
            if (e20 * q0 + e21 * q1 + e22 * q2) / det > 0.0:
                crossings += 1
        votes += crossings % 2
    return votes >= 2


def scatter(models: Sequence[GenericModel], rng: np.random.Generator,
            config: ScatterConfig = ScatterConfig()) -> list[PlacedObject]:
    """Return one scattered scene; see Scatterer for many."""
    return Scatterer(models, config).scene(rng)
