# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Turn a generic model into a plausible real object: same kind, other proportions.

Section 7 of Basevi & Leonardis 2016 names the mismatch between generic and real shapes as a
limit, and perturbed training geometry as a remedy. A `Warp` moves points, so the same one
applies to a mesh and to its convex pieces for physics. Moving vertices never opens a closed
mesh. Structure changes too: along each axis some parts grow and others shrink (a longer handle on
a smaller pan), and along one axis the girth varies (a flaring wall, a thin handle).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from hooc_perception.core.arrays import AnyArray, Float64Array
from hooc_perception.core.geometry import matrix_from_pose, transform
import numpy as np
from scipy.spatial.transform import Rotation
import trimesh

if TYPE_CHECKING:
    from hooc_perception.synthesis.scatter import PlacedObject

# Standard deviations between two objects of one kind, as logarithms of their sides: overall, and
# per side. Household objects of one category vary in size by about 1 : 1.5.
SIZE_SPREAD = 0.12
ASPECT_SPREAD = 0.12
TAPER_SPREAD = 0.08
BEND_SPREAD = 0.012
LATTICE_SPREAD = 0.035
# The same of the lengths of the parts along each axis, and of the girth at the knots between them.
PART_SPREAD = 0.15
GIRTH_SPREAD = 0.06
KNOTS = 5


@dataclass(frozen=True)
class Warp:
    """
    A smooth map of model space.

    :ivar low: (3,) lower corner of the mesh's bounding box; `extents` (3,) its sides, metres.
    :ivar scale: (3,) factor along each axis.
    :ivar axis: the axis along which taper and bend act.
    :ivar taper: (3,) relative growth of each axis from one end of `axis` to the other.
    :ivar bend: (3,) shift of both ends relative to the middle, metres.
    :ivar lattice: (4, 4, 4, 3) shifts of the control points, metres (free-form deformation
        after Sederberg & Parry 1986).
    :ivar knots: (3, KNOTS) where equally spaced cuts across each axis come to lie, as shares of
        its side, 0 to 1; None = the parts keep their proportions.
    :ivar girth: (KNOTS, 3) factor on each axis at the knots along `axis`.
    :ivar offset: (3,) subtracted at the end.
    """

    low: Float64Array
    extents: Float64Array
    scale: Float64Array
    axis: int
    taper: Float64Array
    bend: Float64Array
    lattice: Float64Array
    knots: Float64Array | None
    girth: Float64Array
    offset: Float64Array

    def __call__(self, points: Float64Array) -> Float64Array:
        """Return warped points (n, 3) float64 of model space."""
        middle = self.low + 0.5 * self.extents
        unit, even = (points - self.low) / self.extents, np.linspace(0, 1, KNOTS)
        if self.knots is not None:
            girth = np.column_stack([np.interp(unit[:, self.axis], even, g)
                                     for g in self.girth.T])
            unit = np.column_stack([np.interp(u, even, k) for u, k in zip(unit.T, self.knots)])
            points = (self.low + unit * self.extents - middle) * girth + middle
        shift = np.zeros(points.shape)
        w = [_bernstein(unit[:, k]) for k in range(3)]
        for i in range(4):
            for j in range(4):
                shift += (w[0][:, i] * w[1][:, j])[:, None] * (w[2] @ self.lattice[i, j])
        along = 2 * unit[:, self.axis] - 1
        moved = (points - middle + shift) * (1 + 0.5 * along[:, None] * self.taper)
        moved = moved + (along ** 2 - 0.5)[:, None] * self.bend
        return moved * self.scale + middle - self.offset


def random_warp(vertices: Float64Array, rng: np.random.Generator, strength: float = 1.0,
                symmetry: AnyArray | None = None, structure: float = 0.0) -> Warp:
    """
    Return a Warp that puts the bounding-box centre of the moved `vertices` (V, 3) at 0.

    :param strength: 0 = none, 1 = as much as real objects differ.
    :param symmetry: (3,) axis orders as in GenericModel, or None. A round object stays round:
        the two axes across share their scale, and it is bent only a little.
    :param structure: factor on `strength` for the lengths and girths of single parts.
    """
    low = vertices.min(axis=0)
    # Sheets have a side of length 0; a millimetre keeps the unit cube well defined.
    extents = np.maximum(vertices.max(axis=0) - low, 1e-3)
    aspect = _clipped(rng, 3) * ASPECT_SPREAD
    round_axes = [] if symmetry is None else [k for k in range(3) if symmetry[k] == 0]
    if len(round_axes) == 1:
        across = [k for k in range(3) if k != round_axes[0]]
        aspect[across] = aspect[across[0]]
    elif round_axes:
        aspect[:] = aspect[0]
    scale = np.exp(strength * (SIZE_SPREAD * _clipped(rng, 1) + aspect))
    axis = int(np.argmax(extents))
    taper = np.full(3, TAPER_SPREAD * strength) * _clipped(rng, 3)
    taper[axis] = 0.0
    bend = BEND_SPREAD * strength * extents[axis] * _clipped(rng, 3)
    bend[axis] = 0.0
    reach = 0.6 * extents + 0.1 * extents.max()
    lattice = LATTICE_SPREAD * strength * reach * _clipped(rng, (4, 4, 4, 3))
    knots, girth = None, np.ones((KNOTS, 3))
    if structure > 0:
        knots, girth = _structure(vertices, axis, rng, strength * structure)
    if round_axes:
        taper *= 0.5 * (len(round_axes) == 1)
        if len(round_axes) == 1:
            taper[:] = taper.max() * (np.arange(3) != axis)
        bend, lattice = 0.2 * bend, 0.25 * lattice
        if knots is not None:
            axis = round_axes[0]
            knots, girth = _round(knots, girth, round_axes)
    warp = Warp(low, extents, scale, axis, taper, bend, lattice, knots, girth, np.zeros(3))
    moved = warp(vertices)
    return replace(warp, offset=0.5 * (moved.min(axis=0) + moved.max(axis=0)))


def reshape(vertices: Float64Array, faces: AnyArray, rng: np.random.Generator,
            strength: float = 1.0, symmetry: AnyArray | None = None, detail_loss: float = 0.3,
            structure: float = 0.0) -> tuple[Float64Array, Float64Array, Warp]:
    """
    Return (vertices (V, 3) centred, extents (3,), Warp) of a random variant of a mesh.

    :param vertices: (V, 3) float64 in model axes, metres; `faces` (F, 3) stay valid.
    :param detail_loss: chance that fine detail is smoothed away, for meshes that have any.
    :param structure: as in `random_warp`.
    """
    warp = random_warp(vertices, rng, strength, symmetry, structure)
    moved = warp(np.asarray(vertices, np.float64))
    if strength > 0 and rng.random() < detail_loss and len(faces) > 600:
        mesh = trimesh.Trimesh(moved, faces, process=False)
        # Taubin 1995: smooths without shrinking.
        trimesh.smoothing.filter_taubin(mesh, lamb=0.5, nu=0.53, iterations=6)
        moved = np.array(mesh.vertices)
        moved -= 0.5 * (moved.min(axis=0) + moved.max(axis=0))
    return moved, moved.max(axis=0) - moved.min(axis=0), warp


def reshape_placed(placed: 'PlacedObject', rng: np.random.Generator, strength: float,
                   symmetry: AnyArray | None = None) -> 'PlacedObject':
    """Return the object reshaped in place, its lowest point at the old height."""
    R = Rotation.from_quat(placed.rotation_xyzw).as_matrix()
    in_model = (placed.vertices_world - placed.translation) @ R
    moved, size, _ = reshape(in_model, placed.faces, rng, strength, symmetry)
    lowest = placed.vertices_world[:, 2].min()
    translation = placed.translation.copy()
    translation[2] += lowest - (moved @ R.T + translation)[:, 2].min()
    world = transform(matrix_from_pose(translation, placed.rotation_xyzw), moved)
    return replace(placed, translation=translation, size=size, vertices_world=world)


def _structure(vertices: Float64Array, axis: int, rng: np.random.Generator, strength: float,
               ) -> tuple[Float64Array, Float64Array]:
    """Return the knots (3, KNOTS) and the girth (KNOTS, 3) of a Warp."""
    parts = np.exp(strength * PART_SPREAD * _clipped(rng, (3, KNOTS - 1)))
    knots = np.concatenate([np.zeros((3, 1)), np.cumsum(parts, 1)], 1)
    knots /= knots[:, -1:]
    girth = np.exp(strength * GIRTH_SPREAD * _clipped(rng, (KNOTS, 3)))
    girth[:, axis] = 1.0
    # A block with vertices only at its ends stays a block.
    if len(np.unique(np.round(vertices[:, axis], 4))) < KNOTS:
        girth[:] = 1.0
    return knots, girth


def _round(knots: Float64Array, girth: Float64Array, round_axes: Sequence[int],
           ) -> tuple[Float64Array, Float64Array]:
    """Return knots and girth that leave an object round about its first round axis."""
    even = np.linspace(0, 1, KNOTS)
    axis = round_axes[0]
    kept = np.tile(even, (3, 1))
    ring = np.ones_like(girth)
    if len(round_axes) == 1:
        kept[axis] = knots[axis]
        # `girth` is 1 along the axis for which it was drawn: the product is that of another one.
        ring[:] = np.sqrt(girth.prod(axis=1))[:, None]
        ring[:, axis] = 1.0
    return kept, ring


def _clipped(rng: np.random.Generator, shape: int | Sequence[int]) -> Float64Array:
    """Return normal draws clipped to 2.2 standard deviations, without outliers."""
    return np.clip(rng.standard_normal(shape), -2.2, 2.2)


def _bernstein(t: Float64Array) -> Float64Array:
    """Return (n, 4) cubic Bernstein weights."""
    s = 1 - t
    return np.stack([s ** 3, 3 * t * s ** 2, 3 * t ** 2 * s, t ** 3], axis=1)
