# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Share of an object's volume inside other objects: v_k of Eq. 1, exact for every subset.

Each generic model has 512 fixed samples of its interior and a boolean occupancy grid, both in
its unit bounding box, so that scaled and posed copies share them. For every pair of candidates
one bit per sample says whether it lies inside the other one; the union over any subset is then a
bitwise or, and containment needs no special case. Inside is where the mesh winds around a cell
(so parts may overlap, and the whole may be inside out). On a surface that is not closed, rays
along different axes contradict one another: the majority of three decides. If even that excludes
the model's own interior points, the space around these counts as its inside. Therefore no
category has to be left out (the paper left out dustpan and tray).
"""

from collections.abc import Sequence

from hooc_perception.core.arrays import (
    BoolArray,
    Float64Array,
    Int32Array,
    UInt64Array,
)
from hooc_perception.core.energy.kernels import overlap as kernels
from hooc_perception.core.memo import per_model
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]
from scipy.spatial.transform import Rotation

SAMPLES = 512
CELLS = 48
# A mesh whose winding grid holds less than this share of its interior points is not closed.
BELIEVABLE = 0.75


@per_model
def occupancy(model: GenericModel) -> BoolArray:
    """
    Return the (CELLS, CELLS, CELLS) bool grid over the bounding box of a GenericModel.

    Indices run along the model's x, y, z; a cell is True where its centre is inside.
    """
    cells, extents = CELLS, np.maximum(model.extents, 1e-9)
    vertices = np.ascontiguousarray((model.vertices / extents + 0.5) * cells)
    votes = np.zeros((cells, cells, cells), np.uint8)
    for axis in range(3):
        winding = np.zeros(votes.shape, np.int16)
        kernels.wind(vertices, model.faces, axis, cells, winding)
        votes += winding != 0
    grid = votes >= 2
    points = np.asarray(model.interior_points, np.float64)
    if len(points):
        at = np.clip(((points / extents + 0.5) * cells).astype(int), 0, cells - 1)
        if grid[tuple(at.T)].mean() < BELIEVABLE:
            reach = (max(model.volume, 1e-12) / len(points)) ** (1 / 3)
            centres = (np.stack(np.meshgrid(*[np.arange(cells) + 0.5] * 3, indexing='ij'), -1)
                       / cells - 0.5) * extents
            grid = cKDTree(points).query(centres.reshape(-1, 3), workers=1,
                                         distance_upper_bound=reach)[0] < np.inf
            grid = grid.reshape(votes.shape)
    return grid


def interior_samples(model: GenericModel, count: int = SAMPLES) -> Float64Array:
    """
    Return (count, 3) float64 interior samples in the unit bounding box, centred at 0.

    Evenly picked from `interior_points`, repeated where these are fewer; a model without any
    volume is represented by its surface.
    """
    points = model.interior_points if len(model.interior_points) else model.surface_points
    points = np.asarray(points, np.float64) / np.maximum(model.extents, 1e-9)
    if len(points) >= count:
        return points[np.linspace(0, len(points) - 1, count).astype(int)]
    return np.resize(points, (count, 3))


class OverlapTerm:
    """
    The sum of v_k over the objects of a subset, kept up to date flip by flip.

    It has the interface that a search needs (see compositor.py). `value` and `deltas()` are in
    shares of a volume, so its weighted sum with a Compositor is again an energy.

    :param objects: Candidates; class id c is models[c - 1].
    :param count: samples of each interior, a multiple of 64.
    """

    def __init__(self, objects: Candidates, models: Sequence[GenericModel],
                 count: int = SAMPLES) -> None:
        """Compare all pairs whose bounding boxes meet; start from the empty subset."""
        self.n = n = len(objects)
        self._count = count
        self._active = np.zeros(n, bool)
        kinds, row = np.unique(np.column_stack([objects.category, objects.member]), axis=0,
                               return_inverse=True)
        samples = np.zeros((len(kinds), count, 3))
        grids = np.zeros((len(kinds), CELLS, CELLS, CELLS), bool)
        for i, (c, member) in enumerate(kinds):
            shape = models[c - 1].members[member]
            samples[i], grids[i] = interior_samples(shape, count), occupancy(shape)
        R = (Rotation.from_quat(objects.rotation_xyzw).as_matrix() if n
             else np.zeros((0, 3, 3)))
        size = np.maximum(objects.size.astype(np.float64), 1e-9)
        pairs = _meeting_pairs(R, objects.translation, size)
        bits = np.zeros((len(pairs), count // 64), np.uint64)
        kernels.sample_bits(pairs, row.reshape(-1).astype(np.int32), R, objects.translation, size,
                            samples, grids, bits)
        # Keep pairs with a common volume, both directions, ordered by the first.
        mirror = np.lexsort((pairs[:, 0], pairs[:, 1]))
        kept = bits.any(1) | bits[mirror].any(1)
        self._other: Int32Array = pairs[kept, 1]
        self._bits: UInt64Array = bits[kept]
        self._start = np.searchsorted(pairs[kept, 0], np.arange(n + 1))
        self._reverse = np.lexsort((pairs[kept, 0], pairs[kept, 1]))
        self._union, self._once = np.zeros((2, n, count // 64), np.uint64)
        self.reset(self._active)

    @property
    def mask(self) -> BoolArray:
        """Return a copy of the current subset, (n,) bool."""
        return self._active.copy()

    @property
    def value(self) -> float:
        """Return the sum of v_k over the current subset."""
        return self._covered / self._count

    def reset(self, mask: BoolArray) -> None:
        """Start again from the subset `mask` (n,) bool."""
        self._active[:] = mask
        self._covered: int | np.int64 = kernels.cover_all(self._start, self._other, self._bits,
                                               self._active, self._union, self._once)

    def deltas(self) -> Float64Array:
        """Return (n,) float64: the change of `value` by each flip."""
        deltas = np.zeros(self.n, np.int64)
        kernels.flip_deltas(self._start, self._other, self._reverse, self._bits, self._active,
                            self._union, self._once, deltas)
        return deltas / self._count

    def flip(self, k: int) -> None:
        """Let object k join the subset, or leave it if it is in."""
        self._covered = self._covered + kernels.flip_delta(
            k, self._start, self._other, self._reverse, self._bits, self._active, self._union,
            self._once)
        kernels.flip(k, self._start, self._other, self._bits, self._active, self._union,
                     self._once)

    def shares(self, mask: BoolArray) -> Float64Array:
        """Return (m,) float64: v_k of each member of the subset `mask` (n,) bool."""
        members = np.flatnonzero(mask)
        counts = np.zeros(len(members), np.int64)
        kernels.covered(members, np.asarray(mask, bool), self._start, self._other, self._bits,
                        counts)
        return counts / self._count

    def pairwise(self) -> Float64Array:
        """Return (n, n) float64: share of the volume of row k inside object j, subset or not."""
        shares = np.zeros((self.n, self.n))
        for k in range(self.n):
            run = slice(self._start[k], self._start[k + 1])
            bits = np.unpackbits(self._bits[run].view(np.uint8), axis=1)
            shares[k, self._other[run]] = bits.sum(1) / self._count
        return shares

    def evaluate(self, mask: BoolArray) -> float:
        """Return the sum of v_k over the subset `mask` (n,) bool; the current one stays."""
        return float(self.shares(mask).sum())


def _meeting_pairs(R: Float64Array, translation: Float64Array,
                   size: Float64Array) -> Int32Array:
    """Return (m, 2) int32 ordered pairs, both directions, whose world boxes and spheres meet."""
    half = 0.5 * np.einsum('nij,nj->ni', np.abs(R), size)
    radius = 0.5 * np.linalg.norm(size, axis=1)
    apart = np.abs(translation[:, None] - translation[None])
    meet = ((apart < half[:, None] + half[None]).all(-1)
            & (np.linalg.norm(apart, axis=-1) < radius[:, None] + radius[None]))
    np.fill_diagonal(meet, False)
    return np.argwhere(meet).astype(np.int32)


def pairwise(objects: Candidates, models: Sequence[GenericModel]) -> Float64Array:
    """Return (n, n) float64: share of the volume of row k inside object j; 0 on the diagonal."""
    return OverlapTerm(objects, models).pairwise()


def union_shares(objects: Candidates, models: Sequence[GenericModel],
                 count: int = SAMPLES) -> Float64Array:
    """Return (n,) float64: share of each object's volume inside any of the others."""
    return OverlapTerm(objects, models, count).shares(np.ones(len(objects), bool))
