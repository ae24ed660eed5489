# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether answers follow the changes of a table, and whether ids stay with their objects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hooc_perception.benchmark.changing_table import Change
from hooc_perception.core.arrays import Float64Array
import numpy as np
from scipy.optimize import linear_sum_assignment

# An object is found if one in the answer is no farther away. [m]
NEAR_M = 0.06


@dataclass(frozen=True)
class Found:
    """An object of an answer: id, class id, (3,) float64 centre in metres."""

    id: int
    category: int
    translation: Float64Array


@dataclass(frozen=True)
class Followed:
    """
    How a change was answered.

    :ivar stamp_ns: of the first frame set that shows it.
    :ivar answers: how many answers there were from this frame set on, before the next change.
    :ivar late: how many of them did not show the change before the first that did; None = all.
    :ivar seconds: until the answer came that is the first to show the change; NaN = none.
    """

    change: Change
    stamp_ns: int
    answers: int
    late: int | None
    seconds: float


@dataclass
class ChangeResult:
    """
    How answers have followed a table.

    :ivar followed: one Followed per change.
    :ivar true, found, false: objects on the table, those of them that were found, and objects
        where there are none, summed over all answers.
    :ivar swapped: how often an object got the id of another one on the table.
    :ivar lost_ids: how often one that stayed or was moved got a new id, in the same category;
        `renamed`: because it was taken for another category.
    """

    followed: list[Followed] = field(default_factory=list)
    true: int = 0
    found: int = 0
    false: int = 0
    swapped: int = 0
    lost_ids: int = 0
    renamed: int = 0

    @property
    def lost(self) -> list[Followed]:
        """Return the changes that no answer shows, though there was one."""
        return [f for f in self.followed if f.late is None and f.answers]


class ChangeCheck:
    """
    Compare answers with what stood on the table, frame set by frame set.

    :param places: {name: (3,) float64 centre of the object} at first.
    :ivar since_change: how many frame sets that show the last change have been answered.
    """

    def __init__(self, places: Mapping[int, Float64Array]) -> None:
        self._places, self.since_change = dict(places), 0
        self._states: dict[int, tuple[int, dict[int, Float64Array]]] = {}
        self._changes: list[tuple[int, Change]] = []
        self._answers: dict[int, list[Found]] = {}
        self._came: dict[int, int] = {}     # when the answer came, by the same clock

    def changed(self, stamp_ns: int, change: Change) -> None:
        """Note a change that the frame set of this stamp is the first to show."""
        if change.after is None:
            del self._places[change.name]
        else:
            self._places[change.name] = change.after
        self._changes.append((stamp_ns, change))
        self.since_change = 0

    def sent(self, stamp_ns: int) -> None:
        """Note that a frame set shows the table as it is now."""
        self._states[stamp_ns] = len(self._changes), dict(self._places)

    def answered(self, stamp_ns: int, objects: Sequence[Found], now_ns: int) -> None:
        """Note the answer to a frame set; those to unknown stamps are no answers."""
        if stamp_ns in self._states:
            self._answers[stamp_ns], self._came[stamp_ns] = list(objects), now_ns
            self.since_change += self._states[stamp_ns][0] == len(self._changes)

    def result(self) -> ChangeResult:
        """Return the ChangeResult of all answers so far."""
        result, owners = ChangeResult(), _Owners()
        after: list[list[int]] = [[] for _ in self._changes]    # stamps of the answers
        for stamp in sorted(self._answers):
            number, places = self._states[stamp]
            matches = _matches(places, self._answers[stamp])
            result.true += len(places)
            result.found += len(matches)
            result.false += len(self._answers[stamp]) - len(matches)
            owners.update(places, matches, result)
            if number:
                after[number - 1].append(stamp)
        for (stamp, change), stamps in zip(self._changes, after):
            right = [s for s in stamps if _shows(self._answers[s], change)]
            late = stamps.index(right[0]) if right else None
            seconds = (self._came[right[0]] - stamp) * 1e-9 if right else float('nan')
            result.followed.append(Followed(change, stamp, len(stamps), late, seconds))
        return result


class _Owners:
    """Which object of the table has which id and category, as they were last found."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[int, int]] = {}

    def update(self, places: Mapping[int, Float64Array], matches: Mapping[int, Found],
               result: ChangeResult) -> None:
        """Note the objects that were found, and count in `result` what is wrong with ids."""
        self._known = {name: known for name, known in self._known.items() if name in places}
        before = dict(self._known)
        for name, found in matches.items():
            known = before.get(name)
            self._known[name] = found.id, found.category
            if known is not None and known[0] == found.id:
                continue
            if any(number == found.id for other, (number, _) in before.items() if other != name):
                result.swapped += 1
            elif known is not None and known[1] != found.category:
                result.renamed += 1
            elif known is not None:
                result.lost_ids += 1


def _matches(places: Mapping[int, Float64Array], objects: Sequence[Found]) -> dict[int, Found]:
    """Return {name: Found} of the objects of the table that were found."""
    if not places or not objects:
        return {}
    names = list(places)
    way = np.linalg.norm(np.array([places[name] for name in names])[:, None]
                         - np.array([found.translation for found in objects]), axis=2)
    pairs = zip(*linear_sum_assignment(np.minimum(way, 2 * NEAR_M)))
    return {names[i]: objects[j] for i, j in pairs if way[i, j] <= NEAR_M}


def _shows(objects: Sequence[Found], change: Change) -> bool:
    """Return whether an answer has an object where it is now, and none where it was."""
    def is_there(place: Float64Array) -> bool:
        return any(np.linalg.norm(found.translation - place) <= NEAR_M for found in objects)
    return (change.after is None or is_there(change.after)) and (
        change.before is None or not is_there(change.before))
