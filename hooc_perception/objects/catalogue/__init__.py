# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The built-in catalogue: 25 household and office objects made by constructive solid geometry.

All are watertight, z up, in metres, of everyday size; `CATALOGUE[name]()` makes one.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from hooc_perception.objects.catalogue import cutlery, kitchen, office, things, tools, vessels
from hooc_perception.objects.catalogue.write import write_catalogue as _write
from hooc_perception.objects.manifold import from_manifold
from manifold3d import Manifold
import trimesh

__all__ = ['CATALOGUE', 'write_catalogue']


def _built(builder: Callable[[], Manifold]) -> trimesh.Trimesh:
    """Return the trimesh.Trimesh of a builder's solid, centred."""
    mesh = from_manifold(builder().simplify(1e-5))
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh


CATALOGUE: dict[str, Callable[[], trimesh.Trimesh]] = {
    name: partial(_built, builder)
    for name, builder in sorted(
        item for family in (cutlery, kitchen, office, things, tools, vessels)
        for item in family.BUILDERS.items())}


def write_catalogue(folder: str | Path, name: str = 'catalogue') -> Path:
    """
    Write the catalogue as a `hooc-scenes/1` folder without scenes, for `hooc train`.

    It holds dataset.yaml, cameras.yaml (the default rig) and models/<category>.ply.
    """
    return _write(folder, name, {key: build() for key, build in CATALOGUE.items()})
