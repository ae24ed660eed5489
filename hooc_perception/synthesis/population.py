# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The shapes from which the objects of training scenes are made.

A category is more than one mesh. Its relatives take part in training beside the generic mesh: the
variants that the set gives and, where training asks for them, members of the built-in catalogue's
family of the same name, or strongly reshaped copies where there is none. They teach what varies
between objects of one kind; the answer still speaks of the meshes of the set alone. Relatives
belong to folds. Every tree of the classifier sees all folds but one, so that a scene with the
members of that one shows how well the tree does on shapes that it has never seen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.types import GenericModel
from hooc_perception.objects.catalogue import family_name, TRAINING
from hooc_perception.objects.derive import derive
from hooc_perception.objects.family import family_meshes
from hooc_perception.synthesis.convex import pieces_of
from hooc_perception.synthesis.reshape import reshape
from joblib import delayed, Parallel
import numpy as np
import trimesh

# Sets of shapes; each tree of a classifier is kept from one of them.
FOLDS = 3
# Members drawn from each style of a family; training bends every object anew in addition.
DRAWS = 2
# Copies of a mesh without a family, and how strongly they are reshaped.
COPIES, COPY_STRENGTH = 6, 1.5
# Few samples are enough: nobody draws from them.
SURFACE_POINTS, INTERIOR_POINTS = 64, 16


@dataclass(frozen=True)
class Relative:
    """
    Another shape of a category.

    :ivar model: GenericModel in axes of its own.
    :ivar pieces: (n, 3) convex vertex sets that cover it, for physics.
    :ivar fold: 0 .. FOLDS - 1.
    """

    model: GenericModel
    pieces: list[Float64Array]
    fold: int


# Relatives of each category; class id c has population[c - 1].
Population = tuple[tuple[Relative, ...], ...]


def relatives_of(models: Sequence[GenericModel], seed: int, jobs: int = 1,
                 styles: Mapping[str, Sequence[int]] | None = TRAINING,
                 fold: int | None = None) -> Population:
    """
    Return the Population of the models; the same seed gives the same one for any `jobs`.

    :param styles: of each family of the catalogue, those that take part; None = the variants that
        the set gives are the only relatives.
    :param fold: make only those of this fold; None = all.
    :return: () where no category has a relative.
    """
    population = cast(list[tuple[Relative, ...]], Parallel(n_jobs=jobs)(
        delayed(_relatives)(model, index, seed, styles, fold)
        for index, model in enumerate(models)))
    return tuple(population) if any(population) else ()


def _relatives(model: GenericModel, index: int, seed: int,
               styles: Mapping[str, Sequence[int]] | None,
               fold: int | None) -> tuple[Relative, ...]:
    """Return the relatives of the `index`-th model, see `relatives_of`."""
    made = []
    family = family_name(model.name)
    folds = range(FOLDS) if fold is None else (fold,)
    if styles is not None and family:
        draws = [(style, n % FOLDS, stage_rng(seed, 'relatives', index, style + 1, draw))
                 for n, style in enumerate(styles[family]) if n % FOLDS in folds
                 for draw in range(DRAWS)]
        meshes = family_meshes(model, [d[0] for d in draws], [d[2] for d in draws])
        made = [(_derived(model.name, mesh, rng), own)
                for mesh, (_, own, rng) in zip(meshes, draws)]
    elif styles is not None:
        made = [(_copy(model, stage_rng(seed, 'relatives', index, 0, k)), k % FOLDS)
                for k in range(COPIES) if k % FOLDS in folds]
    made += [(variant, k % FOLDS) for k, variant in enumerate(model.variants)
             if k % FOLDS in folds]
    return tuple(Relative(shape, pieces_of(shape), own) for shape, own in made)


def _copy(model: GenericModel, rng: np.random.Generator) -> GenericModel:
    """Return a strongly reshaped copy of a model."""
    moved = reshape(model.vertices, model.faces, rng, COPY_STRENGTH, model.symmetry,
                    structure=1.0)[0]
    return _derived(model.name, trimesh.Trimesh(moved, model.faces, process=False), rng)


def _derived(name: str, mesh: trimesh.Trimesh, rng: np.random.Generator) -> GenericModel:
    """Return the GenericModel of a relative's mesh."""
    return derive(name, mesh, rng, SURFACE_POINTS, INTERIOR_POINTS)
