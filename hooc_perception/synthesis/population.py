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
from hooc_perception.objects.repair import closed
from hooc_perception.synthesis.convex import convex_pieces
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
                 styles: Mapping[str, Sequence[int]] | None = TRAINING) -> Population:
    """
    Return the Population of the models; the same seed gives the same one for any `jobs`.

    :param styles: of each family of the catalogue, those that take part; None = the variants that
        the set gives are the only relatives.
    :return: () where nobody has a relative.
    """
    wanted = []
    for index, model in enumerate(models if styles is not None else ()):
        assert styles is not None
        family = family_name(model.name)
        if family:
            wanted += [(index, style, n % FOLDS, draw)
                       for n, style in enumerate(styles[family]) for draw in range(DRAWS)]
        else:
            wanted += [(index, -1, copy % FOLDS, copy) for copy in range(COPIES)]
    given = [(index, shape, k % FOLDS) for index, model in enumerate(models)
             for k, shape in enumerate(model.variants)]
    made = Parallel(n_jobs=jobs)(
        delayed(_relative)(models[index], style, fold,
                           stage_rng(seed, 'relatives', index, style + 1, draw))
        for index, style, fold, draw in wanted)
    population: list[list[Relative]] = [[] for _ in models]
    for (index, *_), relative in zip(wanted, made):
        population[index].append(relative)
    solid = Parallel(n_jobs=jobs)(delayed(_pieces)(shape) for _, shape, _ in given)
    for (index, shape, fold), pieces in zip(given, cast(list[list[Float64Array]], solid)):
        population[index].append(Relative(shape, pieces, fold))
    return tuple(tuple(each) for each in population) if any(population) else ()


def _relative(model: GenericModel, style: int, fold: int, rng: np.random.Generator) -> Relative:
    """Return a Relative of a model: a style of its family, or a reshaped copy (-1)."""
    if style < 0:
        moved = reshape(model.vertices, model.faces, rng, COPY_STRENGTH, model.symmetry,
                        structure=1.0)[0]
        mesh = trimesh.Trimesh(moved, model.faces, process=False)
    else:
        mesh = family_meshes(model, (style,), (rng,))[0]
    shape = derive(model.name, mesh, rng, SURFACE_POINTS, INTERIOR_POINTS)
    return Relative(shape, _pieces(shape), fold)


def _pieces(shape: GenericModel) -> list[Float64Array]:
    """Return the convex vertex sets (n, 3) that cover a mesh."""
    return convex_pieces(closed(trimesh.Trimesh(shape.vertices, shape.faces, process=False)))
