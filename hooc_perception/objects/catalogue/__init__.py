# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Our own catalogue: 25 household and office things, made by constructive solid geometry.

All are watertight, z up, in metres, of everyday size; `CATALOGUE[name]()` makes one.
"""

from functools import partial

from hooc_perception.objects.catalogue import cutlery, kitchen, office, things, tools, vessels
from hooc_perception.objects.catalogue.write import write_catalogue as _write
from hooc_perception.objects.repair import from_manifold

__all__ = ['CATALOGUE', 'write_catalogue']


def _built(builder):
    """Return the trimesh.Trimesh of a builder's solid, centred."""
    mesh = from_manifold(builder().simplify(1e-5))
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh


CATALOGUE = {name: partial(_built, builder)
             for family in (cutlery, kitchen, office, things, tools, vessels)
             for name, builder in family.BUILDERS.items()}
CATALOGUE = dict(sorted(CATALOGUE.items()))


def write_catalogue(folder, name='catalogue'):
    """
    Write the catalogue as a `hooc-scenes/1` folder without scenes, for `hooc train`.

    It holds dataset.yaml, cameras.yaml (the default rig) and models/<category>.ply.
    """
    return _write(folder, name, {key: build() for key, build in CATALOGUE.items()})
