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

from hooc_perception.core.arrays import BoolArray, Float64Array, Int64Array
from hooc_perception.core.energy.kernels import overlap as kernels
from hooc_perception.core.energy.kernels import overlap_flips as flips
from hooc_perception.core.memo import per_model
from hooc_perception.core.types import Candidates, GenericModel
import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]
from scipy.spatial.transform import Rotation

SAMPLES = 512
CELLS = 48
# Objects for whose comparisons room is made at first.
LEAST_ROWS = 32
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
    shares of a volume, so its weighted sum with a Compositor is again an energy. An object is
    compared with all others when it is first chosen: most of a pool never is.

    :param objects: Candidates; class id c is models[c - 1].
    :param count: samples of each interior, a multiple of 64.
    """

    def __init__(self, objects: Candidates, models: Sequence[GenericModel],
                 count: int = SAMPLES) -> None:
        """Start from the empty subset."""
        self.n = n = len(objects)
        self._count, words = count, count // 64
        self._poses, self._solids = _poses_and_solids(objects, models, count)
        self._active = np.zeros(n, bool)
        self._row = np.full(n, -1)
        # Of compared objects, with all: see kernels.compare. More rows are added as needed.
        self._meets = np.zeros((0, n), bool)
        self._inside, self._around = np.zeros((2, 0, n, words), np.uint64)
        self._compared = 0
        self._union, self._once = np.zeros((2, n, words), np.uint64)
        self._deltas = np.zeros(n, np.int64)
        self._covered: int | np.int64 = 0

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
        chosen = np.flatnonzero(self._active)
        rows = self._rows_of(chosen)
        self._covered = flips.restart(chosen, rows, self._active, self._meets, self._inside,
                                        self._around, self._union, self._once, self._deltas)

    def deltas(self) -> Float64Array:
        """Return (n,) float64: the change of `value` by each flip."""
        return self._deltas / self._count

    def deltas_without(self, members: Int64Array) -> Float64Array:
        """
        Return (m, n) float64: the change of `value` by adding each object once a member has left.

        :param members: (m,) int64 of the current subset; what their columns hold is undefined.
        """
        chosen = np.flatnonzero(self._active)
        return flips.deltas_without(
            members, self._rows_of(members), chosen, self._row[chosen], self._active,
            self._meets, self._inside, self._around, self._union, self._deltas) / self._count

    def flip(self, k: int) -> None:
        """Let object k join the subset, or leave it if it is in."""
        self._covered = self._covered + self._deltas[k]
        self._active[k] = not self._active[k]
        chosen, row = np.flatnonzero(self._active), int(self._rows_of(np.array([k]))[0])
        flips.update(k, row, chosen, self._row[chosen], self._active, self._meets,
                       self._inside, self._around, self._union, self._once, self._deltas)

    def shares(self, mask: BoolArray) -> Float64Array:
        """Return (m,) float64: v_k of each member of the subset `mask` (n,) bool."""
        members = np.flatnonzero(mask)
        counts = np.zeros(len(members), np.int64)
        rows = self._rows_of(members)
        flips.covered(members, rows, self._meets, self._around, counts)
        return counts / self._count

    def pairwise(self) -> Float64Array:
        """Return (n, n) float64: share of the volume of row k inside object j, subset or not."""
        rows = self._rows_of(np.arange(self.n))
        bits = np.unpackbits(self._inside[rows].view(np.uint8), axis=2)
        return bits.sum(2) / self._count

    def evaluate(self, mask: BoolArray) -> float:
        """Return the sum of v_k over the subset `mask` (n,) bool; the current one stays."""
        return float(self.shares(mask).sum())

    def _rows_of(self, objects: Int64Array) -> Int64Array:
        """Return the rows (m,) of objects (m,), which are compared now if they were not yet."""
        new = objects[self._row[objects] < 0]
        if len(new):
            self._compare(new)
        return self._row[objects]

    def _compare(self, new: Int64Array) -> None:
        """Compare objects (m,), none of which was compared before, with all."""
        first, last = self._compared, self._compared + len(new)
        if last > len(self._meets):
            more = max(last, 2 * len(self._meets), LEAST_ROWS) - len(self._meets)
            self._meets = np.concatenate([self._meets, np.zeros((more, self.n), bool)])
            room = np.zeros((more, *self._inside.shape[1:]), np.uint64)
            self._inside = np.concatenate([self._inside, room])
            self._around = np.concatenate([self._around, room])
        self._row[new], self._compared = np.arange(first, last), last
        kernels.compare(new, self._poses, self._solids, self._meets[first:last],
                        self._inside[first:last], self._around[first:last])


def _poses_and_solids(objects: Candidates, models: Sequence[GenericModel], count: int,
                      ) -> tuple[kernels.Poses, kernels.Solids]:
    """Return what the kernels take of objects and the models that they use."""
    kinds, row = np.unique(np.column_stack([objects.category, objects.member]), axis=0,
                           return_inverse=True)
    shapes = [models[c - 1].members[member] for c, member in kinds]
    samples = [interior_samples(shape, count) for shape in shapes]
    grids = [occupancy(shape) for shape in shapes]
    R = (Rotation.from_quat(objects.rotation_xyzw).as_matrix() if len(objects)
         else np.zeros((0, 3, 3)))
    size = np.maximum(objects.size.astype(np.float64), 1e-9)
    half = 0.5 * np.einsum('nij,nj->ni', np.abs(R), size)
    return (kernels.Poses(R, np.ascontiguousarray(objects.translation, np.float64), size, half,
                          0.5 * np.linalg.norm(size, axis=1), row.reshape(-1).astype(np.int32)),
            kernels.Solids(np.array(samples).reshape(-1, count, 3),
                           np.array(grids, bool).reshape(-1, CELLS, CELLS, CELLS)))


def pairwise(objects: Candidates, models: Sequence[GenericModel]) -> Float64Array:
    """Return (n, n) float64: share of the volume of row k inside object j; 0 on the diagonal."""
    return OverlapTerm(objects, models).pairwise()


def union_shares(objects: Candidates, models: Sequence[GenericModel],
                 count: int = SAMPLES) -> Float64Array:
    """Return (n,) float64: share of each object's volume inside any of the others."""
    return OverlapTerm(objects, models, count).shares(np.ones(len(objects), bool))
