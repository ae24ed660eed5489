# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bodies for physics: reshaped models and their convex pieces."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hooc_perception.core.arrays import Float64Array, Int32Array
from hooc_perception.core.memo import latest
from hooc_perception.core.types import GenericModel
from hooc_perception.synthesis.convex import pieces_of
from hooc_perception.synthesis.population import Population, Relative
from hooc_perception.synthesis.reshape import reshape
from hooc_perception.synthesis.scatter import models_key
import numpy as np

# Share of the objects that are made from the set's own mesh where there are relatives.
GENERIC_SHARE = 0.5
# Relatives differ by themselves: they are reshaped less than the generic model, by this factor.
RELATIVE_STRENGTH = 0.5


@dataclass(frozen=True)
class Body:
    """
    What physics needs of one object.

    :ivar category: class id 1..N.
    :ivar vertices: (V, 3) of the visible mesh, model axes, centred on its bounding box.
    :ivar faces: (F, 3) of the visible mesh.
    :ivar pieces: (n, 3) convex vertex sets in the same axes.
    :ivar rest_rotations: (R, 4) xyzw, may be empty.
    :ivar fold: of the Relative that it was made from, -1 = made from the generic model.
    """

    category: int
    vertices: Float64Array
    faces: Int32Array
    pieces: list[Float64Array]
    rest_rotations: Float64Array
    fold: int = -1

    def scaled(self, factor: float) -> 'Body':
        """Return the same body, `factor` times as large."""
        return replace(self, vertices=self.vertices * factor,
                       pieces=[piece * factor for piece in self.pieces])


class BodyMaker:
    """
    Makes bodies of generic models and their relatives; cuts every mesh into pieces only once.

    :param models: class id c is models[c - 1].
    :param population: relatives of each, () = none.
    """

    def __init__(self, models: Sequence[GenericModel], population: Population = ()) -> None:
        self.models, self.population = tuple(models), population
        self._pieces: dict[int, list[Float64Array]] = {}

    def pieces(self, index: int) -> list[Float64Array]:
        """Return the cached convex pieces of models[index]."""
        if index not in self._pieces:
            self._pieces[index] = pieces_of(self.models[index])
        return self._pieces[index]

    def body(self, category: int, rng: np.random.Generator, strength: float = 0.0,
             symmetry: bool = True, fold: int | None = None,
             generic_share: float = GENERIC_SHARE) -> Body:
        """
        Return a Body of class id `category`, reshaped by `strength`.

        It is made from the generic model or from one of its relatives.

        :param symmetry: whether the model's symmetry is kept.
        :param fold: only relatives of this fold, where there are any.
        :param generic_share: how often the generic model is taken although there are relatives.
        """
        relative = self._relative(category, rng, fold, generic_share)
        if relative is None:
            model, pieces, own = self.models[category - 1], self.pieces(category - 1), -1
        else:
            model, pieces, own = relative.model, relative.pieces, relative.fold
            strength *= RELATIVE_STRENGTH
        if strength <= 0:
            return Body(category, model.vertices, model.faces, pieces, model.rest_rotations, own)
        vertices, _, warp = reshape(model.vertices, model.faces, rng, strength,
                                    model.symmetry if symmetry else None,
                                    structure=float(bool(self.population)))
        return Body(category, vertices, model.faces, [warp(p) for p in pieces],
                    model.rest_rotations, own)

    def _relative(self, category: int, rng: np.random.Generator,
                  fold: int | None, generic_share: float) -> Relative | None:
        """Return a random relative of a category, None for the generic model itself."""
        relatives = self.population[category - 1] if self.population else ()
        if fold is not None:
            relatives = tuple(r for r in relatives if r.fold == fold)
        elif relatives and rng.random() < generic_share:
            return None
        return relatives[rng.integers(len(relatives))] if relatives else None


@latest(4, key=lambda models, population=(): (models_key(models), tuple(
    models_key([r.model for r in relatives]) for relatives in population)))
def body_maker(models: Sequence[GenericModel], population: Population = ()) -> BodyMaker:
    """Return this process's BodyMaker of the models, so that pieces are cut only once."""
    return BodyMaker(models, population)
