# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Meshes of the catalogue's family of a category, as the mesh of the set lies and is sized.

The catalogue's axes are turned onto those of the set's mesh by quarter turns, so that an
orientation means the same whichever mesh it was found with.
"""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.symmetry import symmetry_rotations
from hooc_perception.core.types import GenericModel
from hooc_perception.objects.catalogue import family_name, variant
import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]
import trimesh

# A set's own mesh tells how large its objects are: a family that differs by more is scaled.
SIZE_LIMIT = 2.0
SAMPLES = 400
# Another orientation has to fit better by this share: rather no turn than one by chance.
CLEARLY = 0.9


def family_meshes(model: GenericModel, styles: Sequence[int], rngs: Sequence[
        np.random.Generator | None]) -> list[trimesh.Trimesh]:
    """
    Return meshes of the catalogue's family of a model, in the model's axes and of its size.

    :param styles: of the family, see objects/catalogue.
    :param rngs: of each, draws its proportions; None = nominal ones.
    """
    family = family_name(model.name)
    assert family is not None
    reference = variant(family)
    ratio = model.longest_side / float(reference.extents.max())
    T = np.eye(4)
    T[:3, :3] = _aligning(reference, model)
    if not 1 / SIZE_LIMIT < ratio < SIZE_LIMIT:
        T[:3, :3] *= ratio
    meshes = [variant(family, style, rng) for style, rng in zip(styles, rngs)]
    for mesh in meshes:
        mesh.apply_transform(T)
    return meshes


def _aligning(mesh: trimesh.Trimesh, model: GenericModel) -> Float64Array:
    """Return the rotation (3, 3) by quarter turns that brings a mesh closest to a model."""
    goal = _cloud(model.vertices, model.faces) / model.longest_side
    own = _cloud(mesh.vertices, mesh.faces) / float(mesh.extents.max())
    turns = symmetry_rotations((4, 4, 4))
    misfit = np.array([_distance(own @ R.T, goal) for R in turns])
    best = int(np.argmin(misfit))
    return turns[best] if misfit[best] < CLEARLY * misfit[0] else np.eye(3)


def _cloud(vertices: Float64Array, faces: np.ndarray) -> Float64Array:
    """Return (SAMPLES, 3) points on the surface of a mesh."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return np.asarray(trimesh.sample.sample_surface(mesh, SAMPLES, seed=0)[0], np.float64)


def _distance(a: Float64Array, b: Float64Array) -> float:
    """Return the mean distance between two clouds, from point to nearest point, both ways."""
    return float(cKDTree(a).query(b)[0].mean() + cKDTree(b).query(a)[0].mean())
