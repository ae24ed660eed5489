# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bodies for physics: reshaped models and their convex pieces."""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import Float64Array, Int32Array
from hooc_perception.core.memo import latest
from hooc_perception.core.types import GenericModel
from hooc_perception.objects.repair import closed
from hooc_perception.synthesis.convex import convex_pieces
from hooc_perception.synthesis.reshape import reshape
from hooc_perception.synthesis.scatter import models_key
import numpy as np
import trimesh


@dataclass(frozen=True)
class Body:
    """
    What physics needs of one object.

    :ivar category: class id 1..N.
    :ivar vertices: (V, 3) of the visible mesh, model axes, centred on its bounding box.
    :ivar faces: (F, 3) of the visible mesh.
    :ivar pieces: (n, 3) convex vertex sets in the same axes.
    :ivar rest_rotations: (R, 4) xyzw, may be empty.
    """

    category: int
    vertices: Float64Array
    faces: Int32Array
    pieces: list[Float64Array]
    rest_rotations: Float64Array


class BodyMaker:
    """Makes bodies of generic models; cuts every mesh into convex pieces only once."""

    def __init__(self, models: Sequence[GenericModel]) -> None:
        """Take the models; class id c is models[c - 1]."""
        self.models = tuple(models)
        self._pieces: dict[int, list[Float64Array]] = {}

    def pieces(self, index: int) -> list[Float64Array]:
        """Return the cached convex pieces of models[index]."""
        if index not in self._pieces:
            model = self.models[index]
            solid = closed(trimesh.Trimesh(model.vertices, model.faces, process=False))
            self._pieces[index] = convex_pieces(solid)
        return self._pieces[index]

    def body(self, category: int, rng: np.random.Generator, strength: float = 0.0,
             symmetry: bool = True) -> Body:
        """
        Return a Body of the model with class id `category`, reshaped by `strength`.

        :param symmetry: whether the model's symmetry is kept.
        """
        model = self.models[category - 1]
        pieces = self.pieces(category - 1)
        if strength <= 0:
            return Body(category, model.vertices, model.faces, pieces, model.rest_rotations)
        vertices, _, warp = reshape(model.vertices, model.faces, rng, strength,
                                    model.symmetry if symmetry else None)
        return Body(category, vertices, model.faces, [warp(p) for p in pieces],
                    model.rest_rotations)


@latest(4, key=models_key)
def body_maker(models: Sequence[GenericModel]) -> BodyMaker:
    """Return this process's BodyMaker of the models, so that pieces are cut only once."""
    return BodyMaker(models)
