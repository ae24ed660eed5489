# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The built-in catalogue: families of 25 household and office objects.

A family is a tuple of styles, each a solid made by constructive geometry whose proportions are
drawn at random. All are watertight, z up, in metres, of everyday size. The first style at its
nominal proportions is the generic model of the category: `CATALOGUE[name]()` makes it. Styles in
TRAINING take part in training where a set has a category of that name; those in HELD_OUT never
do: the objects of the synthetic twin are made from them.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from hooc_perception.objects.catalogue import (
    balls,
    cans,
    cutlery,
    fruit,
    kitchen,
    office,
    rings,
    tools,
    vessels,
)
from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.write import write_catalogue as _write
from hooc_perception.objects.manifold import from_manifold
from manifold3d import Manifold
import numpy as np
import trimesh

__all__ = ['CATALOGUE', 'FAMILIES', 'HELD_OUT', 'TRAINING', 'family_name', 'variant',
           'write_catalogue']

Style = Callable[[Draw], Manifold]
FAMILIES: dict[str, tuple[Style, ...]] = dict(sorted(
    item for group in (balls, cans, cutlery, fruit, kitchen, office, rings, tools, vessels)
    for item in group.STYLES.items()))
# Every third style is kept from training.
TRAINING = {name: tuple(k for k in range(len(styles)) if k % 3 != 2)
            for name, styles in FAMILIES.items()}
HELD_OUT = {name: tuple(k for k in range(len(styles)) if k % 3 == 2)
            for name, styles in FAMILIES.items()}
# Other names of the same things.
ALIASES = {'mug': 'teacup', 'cup': 'teacup', 'coffee_cup': 'teacup', 'tumbler': 'glass',
           'beaker': 'glass', 'pitcher': 'jug', 'pan': 'frying_pan', 'skillet': 'frying_pan',
           'tin': 'can', 'tin_can': 'can', 'soda_can': 'can', 'carton': 'box',
           'cereal_box': 'box', 'tape': 'sellotape_core', 'turner': 'spatula',
           'power_drill': 'drill', 'toothpaste': 'tube', 'tennis_ball': 'ball'}


def family_name(category: str) -> str | None:
    """Return the name of the family that a category of this name belongs to, None = unknown."""
    name = category.strip().lower().replace(' ', '_').replace('-', '_')
    name = ALIASES.get(name, name)
    return name if name in FAMILIES else None


def variant(family: str, style: int = 0, rng: np.random.Generator | None = None,
            ) -> trimesh.Trimesh:
    """
    Return a member of a family, its bounding box centred at the origin.

    :param style: index into FAMILIES[family].
    :param rng: draws its proportions; None = the nominal ones.
    """
    mesh = from_manifold(FAMILIES[family][style](Draw(rng)).simplify(1e-5))
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh


CATALOGUE: dict[str, Callable[[], trimesh.Trimesh]] = {
    name: partial(variant, name) for name in FAMILIES}


def write_catalogue(folder: str | Path, name: str = 'catalogue') -> Path:
    """
    Write the catalogue as a `hooc-scenes/1` folder without scenes, for `hooc train`.

    It holds dataset.yaml, cameras.yaml (the default rig) and models/<category>.ply.
    """
    return _write(folder, name, {key: build() for key, build in CATALOGUE.items()})
