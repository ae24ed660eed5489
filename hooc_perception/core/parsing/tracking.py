# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Objects of successive frame sets get lasting ids and steady orientations."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import Float64Array, UInt32Array
from hooc_perception.core.config import Config, param
from hooc_perception.core.symmetry import canonical_objects, rotation_error
from hooc_perception.core.types import Candidates, GenericModel, UnknownObjects
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

# A rotation by a radian counts as much as a translation by this share of the longest side: it
# tells two neighbours of one category apart, but a wrong orientation alone makes no new object.
TURN_WEIGHT = 0.1
# Of an object that was carried away and put down, the sides differ by no more than this, in
# natural logarithms: it is seen from other sides.
SAME_SIZE = 0.25


@dataclass(frozen=True)
class TrackConfig(Config):
    """Parameters of the tracker."""

    track_ttl_s: float = param(30.0, 'An object that is missing in the results for longer than '
                               'this is forgotten and gets a new id if it returns; 0: every '
                               'result has new ids.', 's', 0.0, 3600.0, runtime=True)
    track_reach_m: float = param(
        0.15, 'An object within this distance of where one of its category was is the same. '
        'Farther away it is the same only if it is as large and the other one has vanished.', 'm',
        0.001, 10.0, runtime=True)
    keep_hidden_s: float = param(
        300.0, 'An object that the robot hides stays in the results with flag 8, as it was last '
        'seen, for at most this time; 0: it is missing.', 's', 0.0, 86400.0, runtime=True)


@dataclass
class _Track:
    """An object as it was last seen."""

    category: int
    translation: Float64Array
    R: Float64Array
    size: Float64Array
    member: int
    stamp_ns: int


class Tracker:
    """
    Give the objects of successive results lasting ids and steady orientations.

    Objects of one category are matched so that the sum of their motions is least; rotations that
    leave a symmetric model as it is count nothing. What is left over was carried: an object has
    the id of one of its category, mesh and size that has vanished. An object whose category
    changes gets a new id; one that is found in its place with another mesh of its family keeps it.

    :param models: tuple of GenericModel; class id c is models[c - 1].
    """

    def __init__(self, models: Sequence[GenericModel],
                 config: TrackConfig = TrackConfig()) -> None:
        self.models, self.config = models, config
        self._tracks: dict[int, _Track] = {}
        # Id -> (translation, stamp in ns) of things of no category.
        self._things: dict[int, tuple[Float64Array, int]] = {}
        self._next_id = 1
        self._last_ns: int | None = None
        # Stamp of the result that stands, and of the one before: what is in it is not missing,
        # however long the next one takes.
        self._standing_ns: int | None = None
        self._before_ns: int | None = None

    def forget(self) -> None:
        """Forget all objects; their ids are not used again."""
        self._tracks, self._things, self._last_ns = {}, {}, None
        self.retract()

    def retract(self) -> None:
        """Take all objects for missing from the last result on: it does not stand any more."""
        self._standing_ns = None

    def hold(self, ids: UInt32Array, stamp_ns: int) -> None:
        """Let the time of objects that are known to be there, though hidden, begin anew."""
        for number in ids.tolist():
            if number in self._tracks:
                self._tracks[number].stamp_ns = stamp_ns

    def update(self, stamp_ns: int, objects: Candidates) -> tuple[UInt32Array, Candidates]:
        """
        Return (ids (n,) uint32, Candidates) of the next result.

        The objects are the same up to the symmetries of their models: a known object keeps its
        orientation, a new one is turned as little from the world's axes as possible. A stamp
        before the last one means that time was set back: all objects are forgotten.
        """
        if self._last_ns is not None and stamp_ns < self._last_ns:
            self.forget()
        self._before_ns, self._standing_ns, self._last_ns = self._standing_ns, stamp_ns, stamp_ns
        self._tracks = {number: track for number, track in self._tracks.items()
                        if self._is_known(track.stamp_ns, stamp_ns)}
        objects = canonical_objects(objects, self.models)
        ids = np.zeros(len(objects), np.uint32)
        references: list[Float64Array | None] = [None] * len(objects)
        if self.config.track_ttl_s > 0:
            for row, number in self._matches(objects):
                ids[row], references[row] = number, self._tracks[number].R
            for row, number in self._carried(objects, ids):
                ids[row] = number
            objects = canonical_objects(objects, self.models, references)
        for row in np.flatnonzero(ids == 0):
            ids[row] = self._next_id
            self._next_id += 1
        for row, number in enumerate(ids):
            self._tracks[int(number)] = _Track(
                int(objects.category[row]), objects.translation[row],
                Rotation.from_quat(objects.rotation_xyzw[row]).as_matrix(),
                objects.size[row].astype(float), int(objects.member[row]), stamp_ns)
        return ids, objects

    def update_unknown(self, stamp_ns: int, unknown: UnknownObjects) -> UInt32Array:
        """
        Return ids (n,) uint32 of the things of no category, after `update` of the same stamp.

        They are matched by where they are; ids are unlike those of known objects.
        """
        self._things = {number: thing for number, thing in self._things.items()
                        if self._is_known(thing[1], stamp_ns)}
        ids = np.zeros(len(unknown), np.uint32)
        if len(unknown) and self._things:
            numbers, known = list(self._things), [thing[0] for thing in self._things.values()]
            way = np.linalg.norm(unknown.translation[:, None] - np.array(known)[None], axis=2)
            far = way > self.config.track_reach_m
            for i, j in zip(*linear_sum_assignment(np.where(far, 1 + way[~far].sum(), way))):
                if not far[i, j]:
                    ids[i] = numbers[j]
        for row in np.flatnonzero(ids == 0):
            ids[row] = self._next_id
            self._next_id += 1
        for number, translation in zip(ids.tolist(), unknown.translation):
            self._things[number] = translation, stamp_ns
        return ids

    def _is_known(self, seen_ns: int, stamp_ns: int) -> bool:
        """Return whether what was last found at a time is remembered for the next result."""
        ttl_s = self.config.track_ttl_s
        return ttl_s > 0 and (seen_ns == self._before_ns or stamp_ns - seen_ns <= ttl_s * 1e9)

    def _carried(self, objects: Candidates, ids: UInt32Array) -> list[tuple[int, int]]:
        """Return (row, id) of new objects that have vanished elsewhere, the likest first."""
        gone = {n: track for n, track in self._tracks.items() if n not in ids}
        pairs = []
        for row in np.flatnonzero(ids == 0):
            for number, track in gone.items():
                if (track.category, track.member) != (objects.category[row], objects.member[row]):
                    continue
                ratio = np.sort(objects.size[row].astype(float)) / np.sort(track.size)
                apart = float(np.abs(np.log(np.maximum(ratio, 1e-9))).max())
                if apart <= SAME_SIZE:
                    # The one that vanished last, then the likest.
                    pairs.append((-track.stamp_ns, apart, int(row), number))
        matched: list[tuple[int, int]] = []
        for _, _, row, number in sorted(pairs):
            if all(row != r and number != n for r, n in matched):
                matched.append((row, number))
        return matched

    def _matches(self, objects: Candidates) -> Iterator[tuple[int, int]]:
        """Yield (row, id) of the objects that are known already."""
        rotations = [Rotation.from_quat(q).as_matrix() for q in objects.rotation_xyzw]
        for category in np.unique(objects.category):
            rows = np.flatnonzero(objects.category == category)
            known = [n for n, track in self._tracks.items() if track.category == category]
            if not known:
                continue
            shapes = objects.take(rows).shapes(self.models)
            cost = np.zeros((len(rows), len(known)))
            far = np.zeros(cost.shape, bool)
            for i, (row, model) in enumerate(zip(rows, shapes)):
                for j, number in enumerate(known):
                    track = self._tracks[number]
                    way = np.linalg.norm(objects.translation[row] - track.translation)
                    far[i, j] = way > self.config.track_reach_m
                    cost[i, j] = way + TURN_WEIGHT * model.longest_side * rotation_error(
                        rotations[row], track.R, model.symmetry)
            # A forbidden match costs more than all allowed ones together.
            cost[far] = 1 + cost[~far].sum()
            for i, j in zip(*linear_sum_assignment(cost)):
                if not far[i, j]:
                    yield int(rows[i]), known[j]
