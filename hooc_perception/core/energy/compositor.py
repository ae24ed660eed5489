# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The cost of a subset of candidates, composed nearest wins, kept up to date flip by flip.

A search needs the following from an energy, and nothing else:

    n           number of candidates
    mask        (n,) bool, the current subset
    value       its energy
    deltas()    (n,) float64, how the energy changes if candidate k flips (joins or leaves);
                inf where it must not join
    deltas_without(members)  (m, n) float64, for each member the change by adding each outsider
                once that member has left; inf for members, and where it must not join
    flip(k)     flip it
    reset(mask) start again from a subset
    evaluate(mask)  the energy of any subset, without touching the current one

`Compositor` is the part of such an energy that is evaluated in the images,

    E(S) = sum_i c_i(S) + sum_{k in S} unary_k

where c_i is the cost of the candidate of S that is nearest at pixel i, or the cost of pixel i
with nothing shown. `Eq1` (eq1.py) adds the overlap of volumes, `OverlapTerm` (overlap.py), in
the same way. Nothing here knows geometry: the pixels of all views share one numbering, and a
pixel that no list names is left out.

Costs are rounded to multiples of 2^-22 of the greatest one. Sums of such numbers are exact in
float64, so no drift builds up over millions of flips, `value` equals `evaluate(mask)` to the
last bit, and equal subsets have equal energies on every machine.
"""

from hooc_perception.core.arrays import (
    AnyArray,
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
)
from hooc_perception.core.energy.kernels import compositor as kernels
from hooc_perception.core.energy.kernels import compositor_layout as layout
from hooc_perception.core.energy.kernels.compositor import Lists, Runs
from hooc_perception.errors import HoocError
import numba as nb
import numpy as np
from numpy.typing import ArrayLike

COST_BITS = 22


class Compositor:
    """
    Pixel and unary costs of subsets of n candidates.

    :param offsets: (n + 1,) integers; entries offsets[k]:offsets[k + 1] belong to candidate k.
    :param pixel: (E,) integers in 0..P-1; no candidate names a pixel twice.
    :param depth: (E,) metres; the smallest wins, ties go to the lower candidate.
    :param cost: (E,) finite cost of the pixel if this candidate is shown there.
    :param cost_none: (P,) finite cost of every pixel if no candidate is shown there.
    :param unary: (n,) cost of each chosen candidate; default 0.
    :param group: (n,) integers, for instance the category; default one group.
    :param max_per_group: most chosen candidates per group; 0 = no limit. `deltas` is inf where a
        flip would exceed it; `flip` itself does not check.
    """

    def __init__(self, offsets: ArrayLike, pixel: ArrayLike, depth: ArrayLike, cost: ArrayLike,
                 cost_none: ArrayLike, unary: ArrayLike | None = None,
                 group: ArrayLike | None = None, max_per_group: int = 0) -> None:
        """Sort the pixel lists; start from the empty subset. Raise HoocError on bad shapes."""
        offsets = np.ascontiguousarray(offsets, np.int64)
        self.n = n = len(offsets) - 1
        pixel, depth = np.asarray(pixel, np.int64), np.ascontiguousarray(depth, np.float32)
        cost, cost_none = np.asarray(cost, np.float64), np.asarray(cost_none, np.float64)
        unary = np.zeros(n) if unary is None else np.asarray(unary, np.float64)
        _check(offsets, pixel, depth, cost, cost_none, unary)
        greatest = max((np.abs(a).max() for a in (cost, cost_none) if len(a)), default=0.0)
        self._quantum = 2.0 ** (np.ceil(np.log2(max(greatest, 1e-30))) - COST_BITS)
        # Pixels that no candidate covers cost the same whatever is chosen: summed once.
        seen = np.bincount(pixel, minlength=len(cost_none)) > 0
        self.pixels: Int64Array = np.flatnonzero(seen)
        cost_none = self._rounded(cost_none)
        self._unseen = float(cost_none[~seen].sum())
        self._unary = self._rounded(unary)
        owner, slot_cost, self._run, self._entry = layout.build(
            offsets, (np.cumsum(seen) - 1)[pixel].astype(np.int32), depth,
            self._rounded(cost).astype(np.float32), cost_none[self.pixels].astype(np.float32),
            nb.get_num_threads())
        self._kind, self._lists, self._runs = _merged(self._run, owner, slot_cost, n)
        n_kinds = len(self._runs[2]) - 1
        self._group: Int64Array = (np.zeros(n, np.int64) if group is None
                                   else np.unique(group, return_inverse=True)[1])
        self._max_per_group = int(max_per_group)
        self._active = np.zeros(n + 1, bool)
        self._active[n] = True
        self._first, self._second = np.zeros((2, n_kinds), np.int32)
        self._nearest = np.zeros(n_kinds, np.int32)
        self._deltas = np.zeros(n + 1)
        self.reset(np.zeros(n, bool))

    @property
    def mask(self) -> BoolArray:
        """Return a copy of the current subset, (n,) bool."""
        return self._active[:self.n].copy()

    @property
    def value(self) -> float:
        """Return the energy of the current subset."""
        return self._pixel_cost + self._unary_cost

    @property
    def n_merged(self) -> int:
        """Return the number of pixels that are left after merging those with equal candidates."""
        return len(self._first)

    def reset(self, mask: BoolArray) -> None:
        """Start again from the subset `mask` (n,) bool."""
        self._active[:self.n] = mask
        self._pixel_cost: float = self._unseen + kernels.restart(
            self._active, self._runs, self._first, self._second, self._deltas)
        self._unary_cost = float(self._unary[self._active[:self.n]].sum())
        self._count = np.bincount(self._group[self._active[:self.n]],
                                  minlength=self._group.max(initial=0) + 1)

    def deltas(self, limited: bool = True) -> Float64Array:
        """
        Return (n,) float64: the change of `value` by each flip, inf where not allowed.

        :param limited: False ignores the limit of the groups.
        """
        active = self._active[:self.n]
        deltas = self._deltas[:self.n] + np.where(active, -self._unary, self._unary)
        if limited and self._max_per_group:
            full = self._count >= self._max_per_group
            deltas[~active & full[self._group]] = np.inf
        return deltas

    def deltas_without(self, members: Int64Array) -> Float64Array:
        """
        Return (m, n) float64: the change of `value` by adding each outsider once a member left.

        What flipping member i and then asking for `deltas` would give in row i; inf for members.

        :param members: (m,) int64 of the current subset.
        """
        deltas = kernels.deltas_without(members, self._lists, self._runs, self._active,
                                        self._first, self._second, self._deltas)[:, :self.n]
        deltas += self._unary
        deltas[:, self._active[:self.n]] = np.inf
        if self._max_per_group:
            group = self._group[members, None]
            count = self._count[self._group] - (group == self._group)
            deltas[count >= self._max_per_group] = np.inf
        return deltas

    def flip(self, k: int) -> None:
        """Let candidate k join the subset, or leave it if it is in."""
        joins = not self._active[k]
        self._pixel_cost += self._deltas[k]
        self._unary_cost += self._unary[k] if joins else -self._unary[k]
        self._count[self._group[k]] += 1 if joins else -1
        (kernels.add if joins else kernels.remove)(
            k, self._lists, self._runs, self._active, self._first, self._second, self._deltas)

    def reprice(self, unary: Float64Array) -> None:
        """Replace the unary cost (n,) of each candidate; the subset stays."""
        self._unary = self._rounded(unary)
        self._unary_cost = float(self._unary[self._active[:self.n]].sum())

    def _rounded(self, costs: Float64Array) -> Float64Array:
        return np.round(costs / self._quantum) * self._quantum

    def evaluate(self, mask: BoolArray) -> float:
        """Return the energy of the subset `mask` (n,) bool; the current one stays."""
        members = np.flatnonzero(mask)
        return self._unseen + self._unary[members].sum() + kernels.evaluate(
            members, self._lists, self._runs, self._nearest)

    def entries_shown(self, mask: BoolArray) -> Int64Array:
        """
        Return (len(self.pixels),) int64: which entry of the lists is seen at each of `pixels`.

        -1 where nothing of the subset `mask` (n,) bool is seen; the current one stays.
        """
        kernels.evaluate(np.flatnonzero(mask), self._lists, self._runs, self._nearest)
        _, _, start = self._runs
        place = self._nearest - start[:-1]
        return self._entry[self._run[:-1] + place[self._kind]].astype(np.int64)

    def shown(self) -> Int32Array:
        """Return (len(self.pixels),) int32: the candidate shown at each of `pixels`, or -1."""
        owners, _, _ = self._runs
        owner = owners[self._first][self._kind]
        return np.where(owner == self.n, -1, owner).astype(np.int32)


def _check(offsets: Int64Array, pixel: Int64Array, depth: Float32Array, cost: Float64Array,
           cost_none: Float64Array, unary: Float64Array) -> None:
    """Raise HoocError if the lists of a Compositor disagree or hold what is no number."""
    n = len(offsets) - 1
    if not len(pixel) == len(depth) == len(cost) == offsets[-1] or len(unary) != n:
        raise HoocError(f'the pixel lists of {n} candidates disagree in length: pixel '
                        f'{len(pixel)}, depth {len(depth)}, cost {len(cost)}, unary '
                        f'{len(unary)}, offsets end at {offsets[-1]}')
    if not all(np.isfinite(a).all() for a in (cost, cost_none, unary)):
        raise HoocError('pixel and unary costs must be finite; leave pixels without a '
                        'reading out of the lists')
    if len(pixel) and not (0 <= np.min(pixel) and np.max(pixel) < len(cost_none)):
        raise HoocError(f'a candidate names a pixel outside 0..{len(cost_none) - 1}')


def _merged(start: Int32Array, owner: Int32Array, cost: Float32Array,
            n: int) -> tuple[AnyArray, Lists, Runs]:
    """Return (kind of each pixel, its Lists, its Runs) of pixels merged by equal owners."""
    _, example, kind = np.unique(layout.fingerprints(start, owner), return_index=True,
                                 return_inverse=True)
    # Number the kinds as they come in the images: neighbours stay neighbours in memory.
    order = np.argsort(example)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    kind, example = rank[kind], example[order]
    same, lists, runs = layout.merge(start, owner, cost, n, kind, example)
    if not same:  # two fingerprints in 2^64 collided: do without merging
        kind = np.arange(len(kind))
        _, lists, runs = layout.merge(start, owner, cost, n, kind, kind)
    return kind, lists, runs
