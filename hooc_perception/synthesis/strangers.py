# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Things of no category, for training scenes.

What stands on a table is not always something that a model knows. Strangers are drawn from
random procedural shapes, and from members of the built-in catalogue's families that the set does
not have. Their pixels are background to the classifier, so its probability of background at a
foreground pixel is that of something else; candidates on them are wrong to the verifier.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import stage_rng
from hooc_perception.objects.catalogue import family_name, TRAINING, variant
from hooc_perception.synthesis.bodies import Body
from hooc_perception.synthesis.convex import convex_pieces
from hooc_perception.synthesis.reshape import reshape
import numpy as np
from scipy.spatial.transform import Rotation
import trimesh

# Class id of a stranger: that of the background.
STRANGER = 0
# Different shapes per seed; each is reshaped anew in every scene.
SHAPES = 120
# Share of the strangers that come from families which the set does not have.
CATALOGUE_SHARE = 0.5
# Longest side of a procedural shape, metres.
SMALLEST_M, LARGEST_M = 0.05, 0.30


class Strangers:
    """
    Makes bodies of things that belong to no category of a set.

    :param categories: names of the set's categories.
    """

    def __init__(self, categories: Sequence[str]) -> None:
        known = {family_name(name) for name in categories}
        self._families = tuple(sorted(set(TRAINING) - known))

    def body(self, rng: np.random.Generator, strength: float) -> Body:
        """Return the Body of a random stranger of class id STRANGER, reshaped by `strength`."""
        k = int(rng.integers(SHAPES))
        if self._families and rng.random() < CATALOGUE_SHARE:
            mesh, pieces = _member(self._families[k % len(self._families)], k)
        else:
            mesh, pieces = _procedural(k)
        vertices, _, warp = reshape(np.asarray(mesh.vertices), mesh.faces, rng, strength)
        middle = (vertices.max(0) + vertices.min(0)) / 2
        return Body(STRANGER, vertices - middle, np.asarray(mesh.faces, np.int32),
                    [warp(piece) - middle for piece in pieces], np.zeros((0, 4)))


@lru_cache(maxsize=4 * SHAPES)
def _member(family: str, k: int) -> tuple[trimesh.Trimesh, list[Float64Array]]:
    """Return a member of a family of the catalogue and its convex pieces."""
    styles = TRAINING[family]
    mesh = variant(family, styles[k % len(styles)], stage_rng(0, 'stranger member', k))
    mesh = mesh.copy()
    mesh.vertices -= mesh.bounds.mean(0)
    return mesh, convex_pieces(mesh)


@lru_cache(maxsize=SHAPES)
def _procedural(k: int) -> tuple[trimesh.Trimesh, list[Float64Array]]:
    """Return the k-th procedural shape and its convex pieces."""
    rng = stage_rng(0, 'stranger', k)
    parts = MAKERS[k % len(MAKERS)](rng)
    whole = trimesh.util.concatenate(parts)
    assert isinstance(whole, trimesh.Trimesh)
    longest = np.exp(rng.uniform(np.log(SMALLEST_M), np.log(LARGEST_M)))
    scale, middle = longest / whole.extents.max(), whole.bounds.mean(0)
    for part in (whole, *parts):
        part.vertices = (part.vertices - middle) * scale
    return whole, [piece for part in parts for piece in convex_pieces(part)]


def _superquadric(rng: np.random.Generator) -> list[trimesh.Trimesh]:
    """Return a superellipsoid (Barr 1981) with random exponents and sides."""
    mesh = trimesh.creation.icosphere(3)
    e = rng.uniform(0.15, 1.4, 2)
    x, y, z = mesh.vertices.T
    flat = np.hypot(x, y)
    up, round_ = np.arctan2(z, flat), np.arctan2(y, x)

    def power(value: Float64Array, exponent: float) -> Float64Array:
        return np.sign(value) * np.abs(value) ** exponent

    across = power(np.cos(up), e[0])
    mesh.vertices = np.column_stack([across * power(np.cos(round_), e[1]),
                                     across * power(np.sin(round_), e[1]),
                                     power(np.sin(up), e[0])]) * rng.uniform(0.25, 1.0, 3)
    return [mesh]


def _lathe(rng: np.random.Generator) -> list[trimesh.Trimesh]:
    """Return a solid or hollow body of revolution with a random profile."""
    n = int(rng.integers(4, 8))
    z = np.linspace(0, 1, n)
    radius = np.clip(np.cumsum(rng.normal(0, 0.12, n)) + rng.uniform(0.15, 0.6), 0.06, 0.9)
    outer = np.column_stack([radius, z])
    if rng.random() < 0.5:      # hollow: down the inside again
        wall = rng.uniform(0.02, 0.08)
        inner = np.column_stack([np.maximum(radius - wall, 0.01), z])[::-1]
        inner[-1, 1] = wall
        profile = np.concatenate([[[0, 0]], outer, inner, [[0, wall]]])
    else:
        profile = np.concatenate([[[0, 0]], outer, [[0, 1]]])
    mesh = trimesh.creation.revolve(profile, sections=24)
    mesh.fix_normals()
    return [mesh]


def _primitive(rng: np.random.Generator, longest: float) -> trimesh.Trimesh:
    """Return a turned box, cylinder, capsule or cone."""
    kind, sides = rng.integers(4), longest * np.exp(rng.uniform(np.log(0.2), 0, 3))
    part = (trimesh.creation.box(sides), trimesh.creation.cylinder(sides[0] / 2, sides[1]),
            trimesh.creation.capsule(sides[1], sides[0] / 3),
            trimesh.creation.cone(sides[0] / 2, sides[1]))[kind]
    T = np.eye(4)
    if rng.random() < 0.5:
        T[:3, :3] = Rotation.random(None, rng).as_matrix()
    return part.apply_transform(T)


def _attached(parts: list[trimesh.Trimesh], rng: np.random.Generator,
              longest: float) -> list[trimesh.Trimesh]:
    """Return the parts and one more primitive, whose middle lies on the surface of one."""
    host = parts[rng.integers(len(parts))]
    part = _primitive(rng, longest)
    part.apply_translation(host.vertices[rng.integers(len(host.vertices))])
    return [*parts, part]


def _union(rng: np.random.Generator) -> list[trimesh.Trimesh]:
    """Return three to six primitives, each attached to another one."""
    parts = [_primitive(rng, 1.0)]
    for _ in range(int(rng.integers(2, 6))):
        parts = _attached(parts, rng, 0.8)
    return parts


def _odd_vessel(rng: np.random.Generator) -> list[trimesh.Trimesh]:
    """Return a body of revolution with one to three other things attached to it."""
    parts = _lathe(rng)
    for _ in range(int(rng.integers(1, 4))):
        parts = _attached(parts, rng, 0.7)
    return parts


def _odd_blob(rng: np.random.Generator) -> list[trimesh.Trimesh]:
    """Return a superellipsoid with up to two other things attached to it."""
    parts = _superquadric(rng)
    for _ in range(int(rng.integers(0, 3))):
        parts = _attached(parts, rng, 0.9)
    return parts


def _bent_tube(rng: np.random.Generator) -> list[trimesh.Trimesh]:
    """Return a chain of thick segments along a bent line, as of a strap or a handle."""
    n, thick = int(rng.integers(4, 8)), rng.uniform(0.05, 0.3)
    steps = np.cumsum(rng.normal(0, 0.9, (n, 3)) * [1, 1, 0.4], axis=0)
    points = np.cumsum(np.column_stack([np.cos(steps[:, 0]), np.sin(steps[:, 0]),
                                        0.5 * np.sin(steps[:, 1])]), axis=0)
    parts = []
    for a, b in zip(points[:-1], points[1:]):
        part = trimesh.creation.cylinder(thick, segment=[a, b], sections=12)
        parts.append(part)
    parts += [trimesh.creation.icosphere(1, thick).apply_translation(p) for p in points[1:-1]]
    return parts


def _slab(rng: np.random.Generator) -> list[trimesh.Trimesh]:
    """Return a flat or long block with something on it, as of a device."""
    sides = np.array([1.0, rng.uniform(0.3, 1.0), rng.uniform(0.05, 0.4)])
    top = sides * rng.uniform(0.2, 0.8, 3)
    block, knob = trimesh.creation.box(sides), trimesh.creation.box(top)
    knob.apply_translation([*(rng.uniform(-0.5, 0.5, 2) * (sides - top)[:2]),
                            (sides[2] + 0.9 * top[2]) / 2])
    return [block, knob]


MAKERS: tuple[Callable[[np.random.Generator], list[trimesh.Trimesh]], ...] = (
    _odd_blob, _odd_vessel, _union, _bent_tube, _slab, _union)
